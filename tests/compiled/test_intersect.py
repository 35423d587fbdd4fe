"""rtbench.intersect, word for word what is promised to those who call it."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import rtbench
from rtbench.kernels.registry import all_kernels

KERNELS = all_kernels()
# Whole listings, every method as it is by itself, and one method with every ending.
RAYS = [
    name
    for name, each in KERNELS.items()
    if each.domain is not None
    and (
        not each.ending
        or name == f"{each.function.__name__}_uv"
        or (name.startswith("wald") and name.endswith("_uv"))
    )
]
LINES = [name for name in RAYS if KERNELS[name].domain == "line"]
PRECISIONS = {"float32": np.float32, "float64": np.float64, "mixed": np.float64}

# A right triangle in the plane z = 1, seen along z; the line meets it at u = 0.25, v = 0.5.
TRIANGLE = np.array([[[0.0, 0, 1], [4, 0, 1], [0, 4, 1]]])
ORIGIN = np.array([[1.0, 2, -1]])
DIRECTION = np.array([[0.0, 0, 2]])  # t = 1, in units of the direction


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", RAYS)
def test_a_hit_by_hand(name, precision):
    found = rtbench.intersect(name, TRIANGLE, ORIGIN, DIRECTION, precision)
    assert isinstance(found, rtbench.Hits)
    assert (found.hit.tolist(), found.outcome.tolist(), found.t.tolist()) == ([True], [0], [1.0])
    expected = ([0.25], [0.5]) if name.endswith("_uv") else (["nan"], ["nan"])
    told = [["nan" if np.isnan(x) else x for x in each] for each in (found.u, found.v)]
    assert tuple(told) == expected
    assert found.triangle is None


@pytest.mark.parametrize("precision", PRECISIONS)
def test_types_of_the_results(precision):
    found = rtbench.intersect("moller1_uv", TRIANGLE, ORIGIN, DIRECTION, precision)
    assert (found.hit.dtype, found.outcome.dtype) == (np.bool_, np.int32)
    assert {found.t.dtype, found.u.dtype, found.v.dtype} == {np.dtype(PRECISIONS[precision])}


@pytest.mark.parametrize("name", [*RAYS, "keidy_inside_uv"])
def test_no_pairs_at_all(name):
    found = rtbench.intersect(name, np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3)))
    for values in (found.hit, found.outcome, found.t, found.u, found.v):
        assert values.shape == (0,)


@pytest.mark.parametrize("name", [name for name in RAYS if name not in LINES])
def test_a_ray_never_meets_what_lies_behind_its_origin(name):
    found = rtbench.intersect(name, TRIANGLE, ORIGIN, -DIRECTION, tmin=-np.inf)
    assert not found.hit[0] and found.outcome[0] > 0
    assert np.isnan([found.t, found.u, found.v]).all()


def test_a_ray_kernel_s_own_tmax_is_kept_and_gives_its_code():
    for name in ("wald_uv", "wald_last_uv", "angle_sum"):
        found = rtbench.intersect(name, TRIANGLE, ORIGIN, DIRECTION, tmax=0.75)
        assert (found.hit.tolist(), found.outcome.tolist()) == ([False], [1])
    found = rtbench.intersect("wald_uv", TRIANGLE, ORIGIN, DIRECTION, tmin=1.0)
    assert (found.hit.tolist(), found.outcome.tolist()) == ([False], [0])


@pytest.mark.parametrize("name", [name for name in KERNELS if name.endswith("_inside_uv")])
def test_a_point_is_the_origin_and_has_no_t(name):
    found = rtbench.intersect(name, TRIANGLE, ORIGIN + np.array([0, 0, 2]), DIRECTION)
    assert (found.hit[0], found.u[0], found.v[0]) == (True, 0.25, 0.5)
    assert np.isnan(found.t).all()
    assert not rtbench.intersect(name, TRIANGLE, ORIGIN + np.array([3, 0, 2]), DIRECTION).hit[0]


def test_without_a_t_no_tmin_can_be_kept():
    assert rtbench.intersect("wald_hit", TRIANGLE, ORIGIN, DIRECTION).hit.tolist() == [True]
    with pytest.raises(ValueError, match="kernel wald_hit returns no t"):
        rtbench.intersect("wald_hit", TRIANGLE, ORIGIN, DIRECTION, tmin=0.5)


@pytest.mark.parametrize("name", LINES)
def test_a_line_meets_what_lies_behind_its_origin_only_if_asked_to(name):
    behind = rtbench.intersect(name, TRIANGLE, ORIGIN, -DIRECTION)
    assert (behind.hit.tolist(), behind.outcome.tolist()) == ([False], [0])
    assert np.isnan([behind.t, behind.u, behind.v]).all()
    line = rtbench.intersect(name, TRIANGLE, ORIGIN, -DIRECTION, tmin=-np.inf)
    assert (line.hit.tolist(), line.t.tolist()) == ([True], [-1.0])


@pytest.mark.parametrize(
    ("tmin", "tmax", "hit"),
    [
        (0.0, 1.0, False),
        (0.0, np.nextafter(1, 2), True),
        (1.0, 2.0, False),
        (np.nextafter(1, 0), 2.0, True),
        (np.float32(1), 2.0, False),
        (0, 1, False),
        (-np.inf, np.inf, True),
        (2.0, 0.0, False),
        (np.nan, 2.0, False),
        (0.0, 1e300, True),
        (-1e300, 2.0, True),
    ],
)
@pytest.mark.parametrize("precision", PRECISIONS)
def test_both_ends_are_open_and_not_rounded_to_the_precision_of_t(tmin, tmax, hit, precision):
    limits = {"tmin": tmin, "tmax": tmax, "precision": precision}
    found = rtbench.intersect("moller1", TRIANGLE, ORIGIN, DIRECTION, **limits)
    assert found.hit.tolist() == [hit]
    assert np.isnan(found.t).tolist() == [not hit]


@pytest.mark.parametrize("name", RAYS)
def test_on_a_miss_everything_but_the_outcome_is_nan(name):
    """Badouel knows t of a miss; intersect does not tell it."""
    misses = np.array([[9.0, 1, -1], [1, 9, -1], [-3, 1, -1], [1, -3, -1], [3, 3, -1]])
    count = len(misses)
    found = rtbench.intersect(
        name, TRIANGLE.repeat(count, 0), misses, DIRECTION.repeat(count, 0), tmin=-np.inf
    )
    assert not found.hit.any() and (found.outcome > 0).all()
    assert np.isnan([found.t, found.u, found.v]).all()


@pytest.mark.parametrize("name", RAYS)
def test_a_direction_in_the_plane_is_a_miss(name):
    found = rtbench.intersect(name, TRIANGLE, np.array([[1.0, 2, 1]]), np.array([[1.0, 0, 0]]))
    assert not found.hit[0] and found.outcome[0] != 0


@pytest.mark.parametrize("name", [name for name in RAYS if name.endswith("_uv")])
def test_u_is_the_weight_of_v1_and_v_that_of_v2(name):
    random = np.random.default_rng(8)
    triangles = random.random((200, 3, 3))
    weights = random.dirichlet((2, 2, 2), 200)
    points = np.einsum("ni,nij->nj", weights, triangles)
    origins = random.random((200, 3))
    found = rtbench.intersect(name, triangles, origins, points - origins, "float64")
    assert found.hit.mean() > 0.9  # Chirkov and a grazing few may differ
    at = found.hit
    np.testing.assert_allclose(found.t[at], 1, atol=1e-6)
    np.testing.assert_allclose(found.u[at], weights[at, 1], atol=1e-6)
    np.testing.assert_allclose(found.v[at], weights[at, 2], atol=1e-6)


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", "longdouble", "i1", "i8", "u4", ">f4", ">f8"])
def test_any_dtype_is_rounded_to_the_data_s_precision(dtype):
    arrays = [a.astype(dtype) for a in (TRIANGLE + 1, ORIGIN + 1, DIRECTION)]
    for precision in PRECISIONS:
        found = rtbench.intersect("chirkov_uv", *arrays, precision)
        assert (found.hit[0], found.t[0], found.u[0], found.v[0]) == (True, 1, 0.25, 0.5)


def test_lists_are_arrays_too():
    found = rtbench.intersect("moller1", TRIANGLE.tolist(), ORIGIN.tolist(), DIRECTION.tolist())
    assert found.t.tolist() == [1.0]


@pytest.mark.parametrize("name", ["moller1", "badouel_uv", "chirkov"])
def test_memory_order_makes_no_difference_and_nothing_given_is_written(name):
    random = np.random.default_rng(4)
    triangles, origins, directions = (random.random((3, 500, 3, 3))[0], *random.random((2, 500, 3)))
    given = rtbench.intersect(name, triangles, origins, directions - 0.5, tmin=-np.inf)
    assert given.hit.any() and not given.hit.all()
    strided = np.zeros((1000, 3, 6))
    strided[::2, :, ::2] = triangles
    views = (
        strided[::2, :, ::2],
        np.asfortranarray(origins),
        np.ascontiguousarray((directions - 0.5)[::-1])[::-1],
    )
    for view in views:
        view.flags.writeable = False
    again = rtbench.intersect(name, *views, tmin=-np.inf)
    for field in ("hit", "outcome", "t", "u", "v"):
        assert np.array_equal(
            getattr(given, field), getattr(again, field), equal_nan=field in "tuv"
        )


def test_numbers_beyond_float32_and_nan_are_no_warning():
    """A printed listing promises nothing about them, but intersect must come back."""
    for bad in (1e300, np.inf, np.nan):
        for name in RAYS:
            triangle = np.where(TRIANGLE == 4, bad, TRIANGLE)
            found = rtbench.intersect(name, triangle, ORIGIN, DIRECTION)
            assert found.hit.shape == (1,)


@pytest.mark.parametrize(
    ("triangles", "origins", "directions"),
    [
        (np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3))),
        (np.zeros((2, 3, 2)), np.zeros((2, 3)), np.zeros((2, 3))),
        (np.zeros((3, 3)), np.zeros(3), np.zeros(3)),
        (np.zeros((2, 3, 3)), np.zeros((1, 3)), np.zeros((2, 3))),
        (np.zeros((2, 3, 3)), np.zeros((2, 3)), np.zeros((3, 3))),
        (np.zeros((1, 3, 3)), np.zeros((2, 3)), np.zeros((2, 3))),
        (np.zeros((2, 3, 3)), np.zeros((2, 4)), np.zeros((2, 3))),
        (np.zeros((2, 3, 3)), np.zeros((2, 3)), np.zeros((2, 1))),
        (np.zeros((2, 3, 3, 1)), np.zeros((2, 3)), np.zeros((2, 3))),
        ([], [], []),
        (0, 0, 0),
    ],
)
def test_wrong_shapes(triangles, origins, directions):
    with pytest.raises(ValueError, match=r"shape|as many of each"):
        rtbench.intersect("moller1", triangles, origins, directions)


@pytest.mark.parametrize("dtype", [complex, object, "U3", bool])
def test_what_is_no_number(dtype):
    with pytest.raises(ValueError, match="dtype"):
        rtbench.intersect("moller1", TRIANGLE, ORIGIN.astype(dtype), DIRECTION)


def test_unknown_names_are_value_errors_with_the_nearest():
    with pytest.raises(ValueError, match=r"unknown kernel 'moler1'; did you mean 'moller1'\?"):
        rtbench.intersect("moler1", TRIANGLE, ORIGIN, DIRECTION)
    with pytest.raises(ValueError, match=r"precision 'float46'; did you mean 'float64'\?"):
        rtbench.intersect("moller1", TRIANGLE, ORIGIN, DIRECTION, "float46")
    for wrong in (None, 5, "", "nowhere.py:moller1"):
        with pytest.raises(ValueError, match="kernel"):
            rtbench.intersect(wrong, TRIANGLE, ORIGIN, DIRECTION)
        with pytest.raises(ValueError, match="precision"):
            rtbench.intersect("moller1", TRIANGLE, ORIGIN, DIRECTION, wrong)


def test_the_listed_kernels_have_what_is_promised():
    listed = rtbench.list_kernels()
    assert [each["name"] for each in listed] == list(KERNELS)
    for each in listed:
        assert set(each) >= {
            "name",
            "method",
            "domain",
            "outputs",
            "precisions",
            "bytes_per_triangle",
            "bytes_per_triangle_padded",
            "stored",
            "ending",
            "operations",
            "source",
        }
        assert each["domain"] in ("line", "ray", "segment", None)
        assert (each["domain"] is None) == (each["ending"] == "inside")
        assert each["stored"] in ("none", "normal", "precomputed")
        assert each["bytes_per_triangle_padded"] % 16 == 0
        assert each["bytes_per_triangle_padded"] >= each["bytes_per_triangle"]
        assert set(each["operations"]) == {"add", "sub", "mul", "div", "cond"}
        assert each["precisions"] == ["float32", "float64", "mixed"]
        assert each["outputs"] == (["t", "u", "v"] if each["name"].endswith("_uv") else ["t"])
    for name in RAYS:
        rtbench.intersect(name, TRIANGLE, ORIGIN, DIRECTION)


def python(code):
    """Run code in a fresh interpreter and return what it prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True
    )
    return done.stdout.split()


def test_importing_is_quick_and_listing_needs_no_compiler():
    assert python("import sys, rtbench; print(*sys.modules.keys() & {'numba', 'numpy'})") == []
    code = "import sys, rtbench; rtbench.list_kernels(); print('numba' in sys.modules)"
    assert python(code) == ["False"]


def test_public_names_equal_no_folder_s():
    folders = {path.name for path in Path(rtbench.__file__).parent.iterdir() if path.is_dir()}
    assert {"Hits", "intersect", "list_kernels"} <= set(rtbench.__all__) <= set(dir(rtbench))
    assert not folders & set(rtbench.__all__)
    for name in rtbench.__all__:
        assert getattr(rtbench, name).__name__ == name


def test_hits_is_one_class_wherever_it_comes_from():
    from rtbench.compiled.intersect import Hits

    assert rtbench.Hits is Hits
    assert type(rtbench.intersect("moller1", TRIANGLE, ORIGIN, DIRECTION)) is Hits


def test_an_unknown_public_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'Tre'"):
        _ = rtbench.Tre
