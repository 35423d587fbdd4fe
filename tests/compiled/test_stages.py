"""A kernel cut off after each of its stages."""

import re
from pathlib import Path

import numpy as np
import pytest

from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import fill
from rtbench.compiled.loops import loop
from rtbench.compiled.stages import cut, stages
from rtbench.errors import RtbenchError
from rtbench.kernels import moller
from rtbench.kernels.registry import all_kernels, find
from rtbench.workloads.pairs import pairs_at_density, random_pairs

KERNELS = all_kernels()
MOLLER1 = [
    "edges",
    "P = D x E2",
    "det = E1 . P",
    "condition: sign of det",
    "T = O - V0",
    "u = T . P",
    "condition: u",
    "Q = T x E1",
    "v = D . Q",
    "condition: v",
    "division",
]


def answers(kernel, pairs, precision, stage=None):
    vertices = pairs.v0, pairs.v1, pairs.v2
    records = fill(kernel, "shared", precision, vertices, pairs.orig, pairs.dir, pairs.end)
    return run_once(loop(kernel, precision, stage=stage), kernel, precision, *records)


def test_stages_stand_in_the_order_of_the_source():
    assert stages(KERNELS["moller1"]) == MOLLER1
    assert stages(KERNELS["chirkov"])[:3] == [
        "sides of origin and end",
        "differences",
        "areas at edges a and b",
    ]


@pytest.mark.parametrize("name", [name for name, each in KERNELS.items() if not each.ending])
def test_every_bare_string_of_the_source_is_a_stage(name):
    kernel = KERNELS[name]
    path = Path(moller.__file__).with_name(f"{kernel.function.__module__.rpartition('.')[2]}.py")
    source = path.read_text()
    body = source.split(f"def {kernel.function.__name__}(")[1].split("\n@kernel")[0]
    assert stages(kernel) == list(dict.fromkeys(re.findall(r'^ +"([^"]+)"$', body, re.M)))


@pytest.mark.parametrize(
    ("name", "precision"),
    [
        ("moller1", "float64"),
        ("moller1", "mixed"),
        ("moller3", "float32"),
        ("badouel_uv", "mixed"),
        ("chirkov_uv", "float32"),
    ],
)
def test_every_cut_form_returns_code_0_on_pairs_that_hit(name, precision):
    pairs = pairs_at_density(50, 1.0, seed=5)
    for stage in stages(KERNELS[name]):
        outcome, t, *_ = answers(KERNELS[name], pairs, precision, stage)
        assert (outcome == 0).all(), stage
        assert np.isfinite(t).all(), stage


def test_a_pair_that_ends_before_the_stage_keeps_its_outcome():
    """moller1 cut off after u leaves with 1 or 3 where u is outside, and with 0 elsewhere."""
    pairs = random_pairs(2000, seed=9)
    whole, *_ = answers(KERNELS["moller1"], pairs, "float32")
    cut_off, *_ = answers(KERNELS["moller1"], pairs, "float32", "condition: u")
    early = np.isin(whole, [1, 3, 5])
    assert early.any() and not early.all()
    assert np.array_equal(cut_off, np.where(early, whole, 0))


def vectors(pairs):
    v0, v1, v2, o, d, end = (
        np.asarray(a, np.float64)
        for a in (pairs.v0, pairs.v1, pairs.v2, pairs.orig, pairs.dir, pairs.end)
    )
    return v1 - v0, v2 - v0, o - v0, o, d, end


def test_moller_cut_off_returns_the_sum_of_what_the_rest_needs():
    pairs = pairs_at_density(200, 1.0, seed=6)
    e1, e2, s, _, d, _ = vectors(pairs)
    p, q = np.cross(d, e2), np.cross(s, e1)
    det, u, v = (e1 * p).sum(1), (s * p).sum(1), (d * q).sum(1)
    edges = (e1 + e2).sum(1)
    expected = {
        "edges": edges,
        "P = D x E2": edges + p.sum(1),
        "det = E1 . P": edges + p.sum(1) + det,
        "u = T . P": edges + s.sum(1) + det + u,  # P is not read again
        "Q = T x E1": e2.sum(1) + q.sum(1) + det + u,  # nor are E1 and T
        "v = D . Q": e2.sum(1) + q.sum(1) + det + u + v,
        "condition: v": e2.sum(1) + q.sum(1) + det,
        "division": e2.sum(1) + q.sum(1) + 1 / det,
    }
    for stage, value in expected.items():
        _, t, _, _ = answers(KERNELS["moller1"], pairs, "float64", stage)
        np.testing.assert_allclose(t, value, rtol=0, atol=1e-12 * np.abs(value).max())


def test_the_form_with_u_and_v_keeps_them_alive_to_the_end():
    pairs = pairs_at_density(100, 1.0, seed=6)
    e1, e2, s, _, d, _ = vectors(pairs)
    p, q = np.cross(d, e2), np.cross(s, e1)
    det, u, v = (e1 * p).sum(1), (s * p).sum(1), (d * q).sum(1)
    value = e2.sum(1) + q.sum(1) + 1 / det + u + v
    _, *outputs = answers(KERNELS["moller1_uv"], pairs, "float64", "division")
    for output in outputs:
        np.testing.assert_allclose(output, value, rtol=0, atol=1e-12 * np.abs(value).max())


def test_what_is_assigned_anew_before_it_is_read_is_not_alive():
    """Chirkov's base is about v0, then about v1: the first is over with the areas at a and b."""
    pairs = pairs_at_density(100, 1.0, seed=7)
    v0, v1, v2 = (np.asarray(a, np.float64) for a in (pairs.v0, pairs.v1, pairs.v2))
    _, _, _, o, _, end = vectors(pairs)
    normal = np.cross(v1 - v0, v2 - v0)
    normal /= np.sqrt((normal**2).sum(1))[:, None]
    sides = [(normal * (x - v0)).sum(1) for x in (o, end)]
    axes = [pairs.i1[:, None], pairs.i2[:, None]]

    def plane(x):
        return np.concatenate([np.take_along_axis(x, axis, 1) for axis in axes], 1)

    def area(a, b):
        return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]

    a, b, along, base = (plane(x) for x in (v1 - v0, v2 - v0, end - o, o - v0))
    across = sides[0] - sides[1]
    area_a = sides[0] * area(a, along) + across * area(a, base)
    area_b = sides[0] * area(along, b) + across * area(base, b)
    value = sides[0] + across + along.sum(1) + area_a + area_b
    _, t, _, _ = answers(KERNELS["chirkov"], pairs, "float64", "areas at edges a and b")
    np.testing.assert_allclose(t, value, rtol=0, atol=1e-12 * np.abs(value).max())


def test_the_marks_cost_nothing(tmp_path):
    """The same source without them gives the same machine code."""
    source = Path(moller.__file__).read_text()
    bare = re.sub(r'^ +"[^"]+"\n', "", source, flags=re.M).replace("def moller", "def bare")
    assert bare.count("\n") < source.count("\n") - 40
    file = tmp_path / "bare.py"
    file.write_text(bare)
    for number in range(4):
        with_marks = loop(KERNELS[f"moller{number}_uv"]).code_digest
        assert loop(find(f"{file}:bare{number}_uv")).code_digest == with_marks


def test_an_unknown_stage_is_told_with_the_nearest():
    with pytest.raises(RtbenchError, match=r"stage .*'divison'; did you mean 'division'\?"):
        cut(KERNELS["moller1"], "divison")
