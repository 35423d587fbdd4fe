"""Triangles and rays in memory: the thesis's records, and what a kernel needs."""

import numpy as np
import pytest

from rtbench.compiled.layout import bytes_per_triangle, fill, record_types
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import HIT, kernel
from rtbench.kernels.registry import all_kernels

KERNELS = all_kernels()


def declared(function, **more):
    return kernel(
        title="hand-made",
        method="hand-made",
        domain="line",
        outcomes=("hit", "miss"),
        source="this test",
        **more,
    )(function).kernels[0]


LISTINGS = [name for name, each in KERNELS.items() if not each.ending and not each.takes_tmax]


@pytest.mark.parametrize("name", LISTINGS)
def test_the_thesis_s_records(name):
    """Blecha 2007, section 4.5: float v0[3], v1[3], v2[3], normal[3], d; three indices."""
    triangle, ray = record_types(KERNELS[name], "shared", "float32")
    offsets = {field: triangle.fields[field][1] for field in triangle.names}
    assert offsets == {
        "v0": 0,
        "v1": 12,
        "v2": 24,
        "normal": 36,
        "d": 48,
        "i0": 52,
        "i1": 56,
        "i2": 60,
    }
    assert triangle.itemsize == 64
    assert {field: ray.fields[field][1] for field in ray.names} == {"orig": 0, "end": 12, "dir": 24}
    assert ray.itemsize == 36


def test_in_float64_they_are_as_a_c_compiler_lays_them():
    """13 doubles, three 4-byte indices, 4 bytes up to the alignment of a double."""
    triangle, ray = record_types(KERNELS["badouel"], "shared", "float64")
    assert (triangle.itemsize, ray.itemsize) == (13 * 8 + 3 * 4 + 4, 72)


def test_own_records_hold_what_the_kernel_reads():
    triangle, ray = record_types(KERNELS["moller1"], "own", "float32")
    assert (triangle.names, ray.names) == (("v0", "v1", "v2"), ("orig", "dir"))
    triangle, ray = record_types(KERNELS["badouel"], "own", "float32")
    assert triangle.names == ("v0", "v1", "v2", "normal", "d", "i1", "i2")
    assert ray.names == ("orig", "dir")
    assert record_types(KERNELS["chirkov"], "own", "float32")[1].names == ("orig", "end", "dir")


@pytest.mark.parametrize(
    ("name", "count"), [("moller0", 36), ("moller3_uv", 36), ("badouel", 60), ("chirkov_uv", 60)]
)
def test_bytes_per_triangle(name, count):
    """Three vertices of 12 bytes; Badouel and Chirkov: normal, d and two indices beside them."""
    assert bytes_per_triangle(KERNELS[name]) == count


def test_mixed_keeps_data_in_float32_and_what_is_computed_in_float64():
    triangle, ray = record_types(KERNELS["chirkov"], "shared", "mixed")
    single, double = np.dtype(np.float32), np.dtype(np.float64)
    assert {triangle[name].base for name in ("v0", "v1", "v2")} == {single}
    assert {triangle[name].base for name in ("normal", "d")} == {double}
    assert [ray[name].base for name in ("orig", "end", "dir")] == [single, double, single]


def test_what_is_filled_in_is_what_was_given():
    random = np.random.default_rng(2)
    vertices = tuple(random.random((3, 10, 3)))
    origins, directions, ends = random.random((3, 10, 3))
    for layout in ("shared", "own"):
        tris, rays = fill(
            KERNELS["chirkov"], layout, "float64", vertices, origins, directions, ends
        )
        for name, values in zip(("v0", "v1", "v2"), vertices, strict=True):
            assert np.array_equal(tris[name], values)
        for name, values in (("orig", origins), ("dir", directions), ("end", ends)):
            assert np.array_equal(rays[name], values)
        normal = np.cross(vertices[1] - vertices[0], vertices[2] - vertices[0])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        np.testing.assert_allclose(tris["normal"], normal, rtol=1e-13)
        np.testing.assert_allclose(tris["d"], -(normal * vertices[0]).sum(1), atol=1e-14)
        axes = np.sort(np.argsort(np.abs(normal), axis=1)[:, :2], axis=1)
        assert np.array_equal(np.stack([tris["i1"], tris["i2"]], axis=1), axes)


@pytest.mark.parametrize("precision", ["float32", "float64", "mixed"])
def test_end_is_origin_plus_direction_in_the_precision_of_the_arithmetic(precision):
    origins = np.array([[0.1, 1e8, 1.0]])
    directions = np.array([[0.2, 1.0, 1e-12]])
    vertices = (np.zeros((1, 3)), np.ones((1, 3)), np.array([[0.0, 1, 0]]))
    _, rays = fill(KERNELS["chirkov"], "own", precision, vertices, origins, directions)
    data = np.float64 if precision == "float64" else np.float32
    wide = origins.astype(data).astype(float) + directions.astype(data).astype(float)
    expected = wide.astype(np.float32) if precision == "float32" else wide
    assert np.array_equal(rays["end"], expected)
    assert rays["end"].dtype == expected.dtype


def test_data_is_rounded_once_to_its_precision():
    fine = np.full((1, 3), 1 + 2.0**-24 + 2.0**-40)
    tris, _ = fill(KERNELS["moller1"], "own", "mixed", (fine,) * 3, fine, fine)
    assert tris["v0"][0, 0] == np.float32(1 + 2.0**-23)


def test_a_field_that_nothing_provides_is_one_line_with_the_nearest():
    def misspelt(tri, ray):
        return HIT, tri.v4[0] * ray.origin[0]

    with pytest.raises(RtbenchError) as told:
        record_types(declared(misspelt), "own", "float32")
    message = str(told.value)
    assert "'misspelt' reads tri.v4" in message and "did you mean 'v" in message
    assert "\n" not in message


def test_a_ray_field_that_nothing_provides_is_told_too():
    def misspelt(tri, ray):
        return HIT, tri.v0[0] * ray.origin[0]

    with pytest.raises(RtbenchError, match=r"reads ray.origin.*did you mean 'orig'\?"):
        record_types(declared(misspelt), "shared", "float32")


def test_what_a_kernel_prepares_stands_behind_the_thesis_s_fields():
    def thick(tri, ray):
        return HIT, tri.thickness * ray.dir[0]

    def thickness(tri):
        return {"thickness": tri.v0[0] + tri.v1[1]}

    made = declared(thick, prepare=thickness)
    triangle, _ = record_types(made, "shared", "float32")
    assert triangle.fields["thickness"][1] == 64
    assert record_types(made, "own", "float32")[0].names == ("thickness",)
    vertices = tuple(np.arange(9.0).reshape(3, 1, 3))
    for layout in ("shared", "own"):
        tris, _ = fill(made, layout, "float32", vertices, np.zeros((1, 3)), np.ones((1, 3)))
        assert tris["thickness"] == 0 + 4


def test_unknown_layout_and_precision():
    with pytest.raises(RtbenchError, match=r"layout 'shard'; did you mean 'shared'\?"):
        record_types(KERNELS["moller1"], "shard", "float32")
    with pytest.raises(RtbenchError, match=r"precision 'float23'; did you mean 'float32'\?"):
        record_types(KERNELS["moller1"], "own", "float23")
