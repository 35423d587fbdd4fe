"""Baldwin and Weber's map, against what it is to do and against the matrices as printed."""

import numpy as np
import pytest

from rtbench.compiled.catalogue import facts
from rtbench.compiled.exact import exact_records
from rtbench.compiled.layout import fill
from rtbench.kernels.registry import find
from rtbench.workloads.pairs import random_pairs

KERNEL = find("baldwin_weber_uv")


def triangles(n=60):
    """Return triangles whose normals are greatest along each axis, of either sign."""
    pairs = random_pairs(n, "pcg64", seed=8)
    return np.stack([pairs.v0, pairs.v1, pairs.v2], axis=1).astype(np.float64)


def image(tri, point):
    """Return b, c and the height of a point."""
    pu, pv, pw = point[tri.u], point[tri.v], point[tri.w]
    return (
        tri.bu * pu + tri.bv * pv + tri.bd,
        tri.cu * pu + tri.cv * pv + tri.cd,
        tri.nu * pu + tri.nv * pv + pw + tri.nd,
    )


def test_the_vertices_become_those_of_the_unit_triangle_exactly():
    given = triangles()
    rays = np.ones((len(given), 3))
    stored, _ = exact_records(KERNEL, tuple(given[:, i] for i in range(3)), rays, rays)
    for tri in stored:
        assert image(tri, tri.v0) == (0, 0, 0)
        assert image(tri, tri.v1) == (1, 0, 0)
        assert image(tri, tri.v2) == (0, 1, 0)
    assert {tri.w for tri in stored} == {0, 1, 2}
    assert all((tri.u, tri.v) == ((tri.w + 1) % 3, (tri.w + 2) % 3) for tri in stored)


def printed(v1, v2, v3):
    """Return the 3 x 4 matrix as the paper's code computes it, by the axis of the normal."""
    e1, e2 = v2 - v1, v3 - v1
    n = np.array(
        [
            e1[1] * e2[2] - e1[2] * e2[1],
            e1[2] * e2[0] - e1[0] * e2[2],
            e1[0] * e2[1] - e1[1] * e2[0],
        ]
    )
    num = v1[0] * n[0] + v1[1] * n[1] + v1[2] * n[2]
    x, y, z = n
    if abs(x) > abs(y) and abs(x) > abs(z):
        x1 = v2[1] * v1[2] - v2[2] * v1[1]
        x2 = v3[1] * v1[2] - v3[2] * v1[1]
        rows = [0, e2[2], -e2[1], x2], [0, -e1[2], e1[1], -x1], [x, y, z, -num]
    elif abs(y) > abs(z):
        x1 = v2[2] * v1[0] - v2[0] * v1[2]
        x2 = v3[2] * v1[0] - v3[0] * v1[2]
        rows = [-e2[2], 0, e2[0], x2], [e1[2], 0, -e1[0], -x1], [x, y, z, -num]
    else:
        x1 = v2[0] * v1[1] - v2[1] * v1[0]
        x2 = v3[0] * v1[1] - v3[1] * v1[0]
        rows = [e2[1], -e2[0], 0, x2], [-e1[1], e1[0], 0, -x1], [x, y, z, -num]
    return np.array(rows, v1.dtype) / np.abs(n).max() * np.sign(n[np.abs(n).argmax()])


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_nine_numbers_are_those_of_the_printed_matrix(precision):
    given = triangles().astype(precision)
    rays = np.ones((len(given), 3))
    vertices = [np.ascontiguousarray(given[:, i]) for i in range(3)]
    records, _ = fill(KERNEL, "own", precision, vertices, rays, rays)
    for record, corners in zip(records, given, strict=True):
        matrix = printed(*corners)
        u, v, w = record["u"], record["v"], record["w"]
        assert matrix[:, w].tolist() == [0, 0, 1]  # the column that is not stored
        for row, name in zip(matrix, "bcn", strict=True):
            assert [row[u], row[v], row[3]] == [record[f"{name}{part}"] for part in "uvd"]


def test_no_vertex_is_read_and_twelve_numbers_are_stored():
    told = facts(KERNEL)
    assert (told["bytes_per_triangle"], told["stored"]) == (48, "precomputed")
