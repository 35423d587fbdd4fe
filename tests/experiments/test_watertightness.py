"""Leaks: kernels that are watertight have none, others as many as they show pair by pair."""

import numpy as np
import pytest

from rtbench.compiled.intersect import intersect
from rtbench.errors import RtbenchError
from rtbench.experiments import config as configs
from rtbench.experiments import watertightness
from rtbench.experiments.config import Config
from rtbench.experiments.peers import Peer
from rtbench.experiments.watertightness import PLACES, counts, leaks, nearest, shares
from rtbench.kernels import registry
from rtbench.report.plots import figures
from rtbench.report.run_tables import tables_of
from rtbench.workloads.aimed import aimed_rays
from rtbench.workloads.hard_cases import corpus
from rtbench.workloads.solids import icosphere, random_sphere

SMALL = Config(
    experiment="watertightness",
    kernels=("moller_trumbore",),
    precisions=("float32",),
    triangles=20,
    rays=400,
)
SOME = {"vertex": 60, "edge": 60, "face": 20}


@pytest.fixture(autouse=True)
def nobody_else(monkeypatch):
    monkeypatch.setattr(watertightness, "PEERS", ())


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", ["watertight", "watertight_safe", "adaptive_exact"])
def test_watertight_kernels_leak_nowhere(name, precision):
    kernel = registry.find(name)
    for offset, factor in PLACES.values():
        mesh = icosphere(1).scaled(factor).moved(offset)
        for row in leaks(kernel, precision, mesh, 6_000):
            assert row["leaks"] == 0 and row["elsewhere"] == 0, row
    # Not convex: whoever is in front of the vertex aimed at is hit instead, but somebody is.
    assert not any(row["leaks"] for row in leaks(kernel, precision, random_sphere(6), 6_000))


@pytest.mark.parametrize("name", ["moller_trumbore", "chirkov", "badouel"])
def test_leaks_are_rays_that_hit_no_triangle_alone(name):
    """Found pair by pair, by another loop over other records."""
    rays = aimed_rays(icosphere(0), SOME, np.float32)
    n, m = len(rays.origins), len(rays.mesh.faces)
    found = intersect(
        name,
        np.tile(rays.mesh.triangles, (n, 1, 1)),
        np.repeat(rays.origins, m, axis=0),
        np.repeat(rays.directions, m, axis=0),
    )
    hit = found.hit.reshape(n, m)
    triangle = nearest(registry.find(name), "float32", rays)
    np.testing.assert_array_equal(triangle >= 0, hit.any(axis=1))
    assert hit[triangle >= 0, triangle[triangle >= 0]].all()
    for number, row in enumerate(counts(rays, triangle)):
        own = rays.aim == number
        assert row["leaks"] == np.count_nonzero(own & ~hit.any(axis=1))
        assert row["rays"] == np.count_nonzero(own)
    assert sum(row["leaks"] for row in counts(rays, triangle)) > 0


def test_portions_change_nothing(monkeypatch):
    rays = aimed_rays(icosphere(0), SOME, np.float32)
    kernel = registry.find("moller_trumbore")
    whole, seen = nearest(kernel, "float32", rays), []
    monkeypatch.setattr(watertightness, "PORTION", 20 * 7)
    np.testing.assert_array_equal(nearest(kernel, "float32", rays, seen.append), whole)
    assert seen == sorted(seen) and seen[-1] == 1 and len(seen) == 19


def test_hits_far_from_the_target_are_counted():
    rays = aimed_rays(icosphere(0), {"vertex": 2, "edge": 1, "face": 1})
    own = [np.flatnonzero((rays.mesh.faces == target[0]).any(axis=1))[0] for target in rays.target]
    far = [np.flatnonzero(~np.isin(rays.mesh.faces, t).any(axis=1))[0] for t in rays.target]
    vertex, edge, face = counts(rays, np.array([far[0], -1, own[2], far[3]]))
    assert (vertex["rays"], vertex["leaks"], vertex["elsewhere"]) == (2, 1, 1)
    assert (edge["leaks"], edge["elsewhere"]) == (0, 0)
    assert (face["leaks"], face["elsewhere"]) == (0, 1)
    wild = aimed_rays(random_sphere(5), {"vertex": 2})
    assert "elsewhere" not in counts(wild, np.array([0, 1]))[0]


def some_cases():
    """A part of the corpus; of a group all or none."""
    every = corpus()
    number = np.where(every.group < 0, np.arange(len(every)), every.group)
    return every.take(number % 20 == 0)


def test_a_run_tells_leaks_peers_and_who_is_absent(go, table, monkeypatch):
    def blind(vertices, faces):
        return lambda origins, directions: (
            np.full(len(origins), -1),
            *np.full((3, len(origins)), np.nan),
        )

    here = Peer("blind", "sees nothing", "numpy", ("numpy",), "float32", blind, most=100)

    def broken(vertices, faces):
        raise RuntimeError("no\nlicence")

    gone = Peer("gone", "is not there", "gone", ("rtbench_gone",), "float32", blind)
    fails = Peer("fails", "is broken", "numpy", ("numpy",), "float32", broken)
    monkeypatch.setattr(watertightness, "PEERS", (fails, here, gone))
    monkeypatch.setattr(watertightness, "BESIDE", ("watertight_safe_uv",))
    monkeypatch.setattr(watertightness, "_cases", lambda bench: some_cases())
    done = go(SMALL)
    assert done.finished
    rows = table(done, "leaks.csv")
    assert len(rows) == 2 * len(PLACES) * 3
    told = {(r["kernel"], r["place"], r["aim"]): r for r in rows}
    for place in PLACES:
        for aim, asked in shares(100).items():
            row = told["blind", place, aim]
            assert int(row["leaks"]) == int(row["rays"]) == asked
        assert told["moller_trumbore", place, "face"]["leaks"] == "0"
        assert told["moller_trumbore", place, "vertex"]["rays"] == "200"
    assert int(told["moller_trumbore", "at the origin", "vertex"]["leaks"]) > 0
    safe, seen = table(done, "peers.csv")
    assert (safe["kernel"], safe["peer"]) == ("watertight_safe_uv", "")
    assert safe["unstable"] == safe["leaks"] == "0" and safe["scene_leaks"] == ""
    assert int(seen["wrong"]) > 50 and seen["leaks"] == seen["groups"] == seen["scene_leaks"]
    assert (seen["doubles"], seen["invalid_accepted"], seen["p99_t"]) == ("0", "0", "")
    assert any("peers not asked: gone (not installed" in remark for remark in done.info["remarks"])
    assert "peer fails failed when it was asked: no licence" in done.info["remarks"]
    assert [peer["absent"] is None for peer in done.info["peers"]] == [False, True, False]
    texts = "\n".join(found.render() for found in tables_of(done))
    assert "0 of 200" in texts and "gone: not installed" in texts and "100 % in float32" in texts
    (panels,) = [figure.axes for figure in figures(done).values()]
    assert [panel.get_title() for panel in panels] == list(PLACES)
    # A million rays of which half leak; who leaks nothing stands at 3 in 400.
    first = [float(line.get_xdata()[0]) for line in panels[1].lines if len(line.get_xdata())]
    assert first[-1] == 1e6
    leaked = sum(
        int(told["moller_trumbore", "far away", aim]["leaks"]) for aim in ("vertex", "edge")
    )
    assert first[0] == pytest.approx(1e6 * (leaked or 3) / 400)


def test_what_cannot_be_asked(go):
    with pytest.raises(RtbenchError, match="no kernel returns t"):
        go(SMALL, kernels=("keidy_inside_uv",))
    with pytest.raises(RtbenchError, match=r"triangles 300 is not allowed.*320"):
        go(SMALL, triangles=300)


def test_the_shipped_config_asks_a_million_rays_of_every_method():
    config = configs.find("watertight")
    assert config.rays == 1_000_000 and config.quick().rays == 100_000
    every = watertightness.own_forms(registry.all_kernels().values())
    names = {kernel.name for kernel in watertightness.chosen(every)[0]}
    assert {"moller1", "wald", "watertight_safe", "adaptive_exact"} <= names
    assert not any(name.endswith("_uv") for name in names)
