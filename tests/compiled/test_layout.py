"""Triangles and rays in memory: the thesis's records, and what a kernel needs."""

import numpy as np
import pytest

from rtbench.accuracy.certified import reference
from rtbench.compiled.exact import exact_records
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import LAYOUTS, bytes_per_triangle, fill, record_types
from rtbench.compiled.loops import loop
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


@pytest.mark.parametrize(
    ("name", "packed", "padded"),
    [
        ("wald", 48, 48),
        ("perpendicular_planes", 48, 48),
        ("kensler_shirley_stored", 48, 64),
        ("shevtsov", 48, 48),
        ("kensler_shirley", 36, 48),
        ("kensler_shirley_with_normal", 48, 64),
        ("signed_areas", 48, 64),
        ("badouel_cramer", 60, 64),
        ("moller_trumbore", 36, 48),
    ],
)
def test_bytes_as_havel_pads_them(name, packed, padded):
    """Rows of 16 bytes: three numbers and a fourth in the room they leave, Havel 2008, 4.2.5."""
    assert bytes_per_triangle(KERNELS[name]) == packed
    assert bytes_per_triangle(KERNELS[name], "padded") == padded


@pytest.mark.parametrize("precision", ["float32", "float64", "mixed"])
def test_padded_fields_do_not_overlap_and_vectors_begin_a_row(precision):
    for name, each in KERNELS.items():
        triangle, _ = record_types(each, "padded", precision)
        assert triangle.itemsize % 16 == 0
        ends = 0
        for offset, field in sorted((triangle.fields[f][1], f) for f in triangle.names):
            assert offset >= ends, name
            ends = offset + triangle[field].itemsize
            assert not triangle[field].shape or offset % 16 == 0
        assert ends <= triangle.itemsize


@pytest.mark.parametrize(
    "name", ["wald_uv", "kensler_shirley_stored_uv", "badouel_uv", "pluecker_stored"]
)
def test_answers_are_the_same_in_every_layout(name):
    random = np.random.default_rng(9)
    vertices = tuple(random.random((3, 400, 3)))
    origins, directions = random.random((400, 3)), random.random((400, 3)) - 0.5
    kernel = KERNELS[name]
    answers = [
        run_once(
            loop(kernel, "float32", layout),
            kernel,
            "float32",
            *fill(kernel, layout, "float32", vertices, origins, directions),
        )
        for layout in LAYOUTS
    ]
    assert 10 < (answers[0][0] == HIT).sum() < 390
    for other in answers[1:]:
        for one, another in zip(answers[0], other, strict=True):
            assert np.array_equal(one, another, equal_nan=True)


def test_what_is_prepared_in_double_is_nearer_to_the_exact_numbers():
    """Wald's plane and lines in float32: rounded once, or computed from rounded differences."""
    random = np.random.default_rng(12)
    vertices = tuple(random.random((3, 500, 3)).astype(np.float32))
    rays = random.random((2, 500, 3))
    kernel = KERNELS["wald_uv"]
    exact, _ = exact_records(kernel, vertices, *rays)
    fields = ("nu", "nv", "nd", "bu", "bv", "bd", "cu", "cv", "cd")
    errors = {}
    for prepared in ("own", "double"):
        stored, _ = fill(kernel, "own", "float32", vertices, *rays, prepared=prepared)
        for field in fields:
            right = np.array([float(getattr(triangle, field)) for triangle in exact])
            off = np.abs(stored[field].astype(float) - right) / np.abs(right)
            errors[prepared, field] = off
    for field in fields:
        own, double = errors["own", field], errors["double", field]
        # Rounded once: half a unit in the last place, whatever was lost in between.
        assert double.max() <= 2.0**-24 * (1 + 1e-3)
        assert np.median(double) < np.median(own) and own.max() > 4 * double.max()


def test_answers_of_what_is_prepared_in_double_are_other_and_nearer():
    random = np.random.default_rng(13)
    vertices = tuple(random.random((3, 4000, 3)).astype(np.float32))
    weights = random.dirichlet((2, 2, 2), 4000)
    points = sum(weights[:, i, None] * vertices[i] for i in range(3))
    origins = random.random((4000, 3)).astype(np.float32)
    directions = (points - origins).astype(np.float32)
    kernel = KERNELS["wald_uv"]
    exact = reference(np.stack(vertices, axis=1), origins, directions)
    off = {}
    for prepared in ("own", "double"):
        records = fill(kernel, "own", "float32", vertices, origins, directions, prepared=prepared)
        _, *found = run_once(loop(kernel, "float32", "own"), kernel, "float32", *records)
        off[prepared] = [
            np.abs(values - right)
            for values, right in zip(found, (exact.t, exact.u, exact.v), strict=True)
        ]
    for own, double in zip(off["own"], off["double"], strict=True):
        both = np.isfinite(own) & np.isfinite(double)
        assert both.mean() > 0.9
        assert np.mean(double[both]) < np.mean(own[both])


def test_an_unknown_preparation():
    given = np.zeros((1, 3))
    with pytest.raises(RtbenchError, match=r"preparation 'doubel'; did you mean 'double'\?"):
        fill(KERNELS["wald"], "own", "float32", (given,) * 3, given, given, prepared="doubel")
