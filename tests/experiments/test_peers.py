"""Peers: what they say of scenes whose answers are known, and what is said of those not there."""

import importlib.util
import sys

import numpy as np
import pytest

from rtbench.accuracy.cases import Cases
from rtbench.errors import RtbenchError
from rtbench.experiments import peers
from rtbench.experiments.peers import PEERS, Peer
from rtbench.workloads.aimed import aimed_rays
from rtbench.workloads.solids import icosphere

# Two triangles in z = 0 and z = -1, the nearer one given last, and rays from above.
VERTICES = np.array(
    [[0, 0, -1], [8, 0, -1], [0, 8, -1], [0, 0, 0], [4, 0, 0], [0, 4, 0]], dtype=np.float64
)
FACES = np.array([[0, 1, 2], [3, 4, 5]])
ORIGINS = np.array([[1, 2, 2], [4, 2, 2], [1, 1, -0.5], [9, 9, 2], [1, 1, -3]], dtype=float)
DIRECTIONS = np.array([[0, 0, -4]] * 5, dtype=float)
TRIANGLE = [1, 0, 0, -1, -1]
T = [0.5, 0.75, 0.125]
WEIGHTS = [0.25, 0.5, 0.125], [0.5, 0.25, 0.125]  # u, v


def there(peer):
    if why := peers.absence(peer):
        pytest.skip(f"{peer.name}: {why}")
    return peer


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_peers_find_the_nearest_triangle(peer):
    found = peers.nearest(there(peer), VERTICES, FACES, ORIGINS, DIRECTIONS)
    assert found.triangle.tolist() == TRIANGLE
    assert found.hit.tolist() == [index >= 0 for index in TRIANGLE]
    for values, right in ((found.t, T), (found.u, WEIGHTS[0]), (found.v, WEIGHTS[1])):
        assert np.isnan(values[3:]).all()
        told = not np.isnan(values[:3]).any()  # a library need not tell
        assert not told or values[:3] == pytest.approx(right, rel=1e-6)
    assert peer.version.split()[0] == peer.package.split()[0]


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_peers_leak_nowhere_but_between_triangles(peer):
    rays = aimed_rays(icosphere(1), {"face": 300}, np.dtype(there(peer).precision).type)
    arrays = rays.mesh.vertices, rays.mesh.faces, rays.origins, rays.directions
    found = peers.nearest(peer, *arrays)
    assert found.hit.all() and not rays.elsewhere(found.triangle).any()


def exactly(vertices, faces):
    """An adapter whose answers are those of linear equations; it refuses what is no number."""
    assert vertices.dtype == np.float64

    def ask(origins, directions):
        if not np.isfinite(vertices).all():
            raise ValueError("no numbers")
        triangle, t, u, v = np.full(len(origins), -1), *np.full((3, len(origins)), np.nan)
        for k, (o, d) in enumerate(zip(origins, directions, strict=True)):
            for i, (a, b, c) in enumerate(vertices[faces]):
                matrix = np.stack([-d, b - a, c - a], axis=1)
                if np.linalg.det(matrix):
                    far, x, y = np.linalg.solve(matrix, o - a)
                    if min(x, y, 1 - x - y) >= 0 and far > 0 and not far >= t[k]:
                        triangle[k], t[k], u[k], v[k] = i, far, x, y
        return triangle, t, u, v

    return ask


EXACTLY = Peer("exactly", "linear equations", "numpy", ("numpy",), "float64", exactly)


def cases(triangles, origins, directions, family=None, group=None, rules=(0,)):
    n = len(triangles)
    none = np.full(n, np.nan)
    group = np.full(n, -1) if group is None else np.array(group)
    return Cases(
        *(np.array(triangles, float).transpose(1, 0, 2)),
        org=np.array(origins, float),
        dir=np.array(directions, float),
        family=np.zeros(n, int) if family is None else np.array(family),
        family_names=tuple(f"family {k}" for k in range(len(rules))),
        difficulty=np.zeros(n),
        f32_ok=np.ones(n, bool),
        cls=np.zeros(n, int),
        expect=np.full(n, 2),
        sos_hit=np.full(n, -1),
        class_names=("miss",),
        t=none,
        u=none,
        v=none,
        eta=none,
        cond_t=none,
        cond_u=none,
        cond_v=none,
        group=group,
        group_rule=np.array(rules),
    )


def test_each_case_is_a_scene_of_its_own():
    triangles = VERTICES[FACES][[1, 0, 1, 1]].copy()
    triangles[3, 1, 2] = np.nan
    rays = ORIGINS[[0, 0, 3, 0]], DIRECTIONS[[0, 0, 3, 0]]
    found = peers.peer_answers(EXACTLY, cases(triangles, *rays))
    assert found.hit.tolist() == [True, True, False, False]
    assert found.triangle.tolist() == [0, 0, -1, -1]
    assert found.t[:2].tolist() == [0.5, 0.75]
    assert np.isnan(found.t[2:]).all() and found.refused == 1


def test_a_group_is_one_scene_and_a_leak_where_none_of_it_is_hit():
    # Families: no groups; once; alike. Groups: 5 hit in its second triangle, 7 in none.
    triangles = VERTICES[FACES][[0, 1, 0, 1, 0, 1, 1]]
    family, group = [1, 1, 1, 1, 0, 2, 2], [5, 5, 7, 7, -1, 8, 8]
    hit, miss = ORIGINS[0], ORIGINS[3]
    rays = [hit, hit, miss, miss, hit, hit, hit], [DIRECTIONS[0]] * 7
    told = cases(triangles, *rays, family=family, group=group, rules=(0, 1, 3))
    groups, met = peers.groups_met(EXACTLY, told)
    assert groups.tolist() == [5, 7] and met.tolist() == [True, False]
    none = cases(triangles, *rays)
    assert [array.tolist() for array in peers.groups_met(EXACTLY, none)] == [[], []]


def test_what_does_not_lie_ahead_is_a_miss():
    def behind(vertices, faces):
        ends = np.array([0.0, -1.0, np.nan, 2.0])
        return lambda origins, directions: (np.arange(4), ends, ends.copy(), ends.copy())

    peer = Peer("behind", "looks back", "numpy", ("numpy",), "float32", behind)
    found = peers.nearest(peer, VERTICES, FACES, np.zeros((4, 3)), np.ones((4, 3)))
    assert found.hit.tolist() == [False, False, True, True]  # one need not say where
    assert found.triangle.tolist() == [-1, -1, 2, 3]


def test_who_is_absent_is_named_with_the_cure(monkeypatch, tmp_path):
    absent = Peer(
        "nobody", "nobody", "no-such-package", ("rtbench_no_such_module",), "float32", exactly
    )
    assert peers.absence(absent) == "not installed (pip install no-such-package)"
    (tmp_path / "rtbench_half_there.py").write_text(
        "raise ImportError('libusb:\\n cannot open')", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(tmp_path)
    importlib.invalidate_caches()
    broken = Peer("broken", "broken", "numpy", ("numpy", "rtbench_half_there"), "float32", exactly)
    assert peers.absence(broken) == "installed, but cannot be imported: libusb: cannot open"
    assert "rtbench_half_there" not in sys.modules


def test_names():
    assert len({peer.name for peer in PEERS}) == len(PEERS) >= 9
    assert peers.find("igl").package == "libigl"
    with pytest.raises(RtbenchError, match=r"unknown peer 'embre'.*embree"):
        peers.find("embre")
