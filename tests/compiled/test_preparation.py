"""What kernels store of a triangle: against formulas over whole arrays, and against rationals."""

import math
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest

from rtbench.compiled import preparation
from rtbench.compiled.exact import UNDEFINED, exact_records
from rtbench.compiled.layout import arithmetics, fill, record_types
from rtbench.compiled.operations import preparation_operations
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import HIT, NO_T, kernel
from rtbench.kernels.registry import all_kernels

KERNELS = all_kernels()
PREPARED = {  # of each way to prepare one kernel
    each.prepare.__name__: each for each in KERNELS.values() if each.prepare is not None
}
KINDS = [("float32", "own"), ("float64", "own"), ("mixed", "own"), ("float32", "double")]


def stack(*columns):
    return np.stack(columns, axis=1)


def cross(a, b):
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return stack(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


def dot(a, b):
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def axes(normal):
    w = np.argmax(np.abs(normal), axis=1)
    return w, (w + 1) % 3, (w + 2) % 3


def along(vectors, axis):
    return np.take_along_axis(vectors, axis[:, None], axis=1)[:, 0]


def line(a, b):
    x, y, z = (stack(a[:, i], b[:, i]) for i in range(3))
    minor = [p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((x, y), (x, z), (y, z))]
    return stack(*minor[:2], x[:, 0] - x[:, 1], minor[2], z[:, 0] - z[:, 1], y[:, 1] - y[:, 0])


def stored_plane(a, b, c):
    normal = cross(b - a, c - a)
    normal = normal / np.sqrt(dot(normal, normal))[:, None]
    i0 = np.argmax(np.abs(normal), axis=1)
    i1, i2 = np.array([[1, 2], [0, 2], [0, 1]])[i0].T
    return {"normal": normal, "d": -dot(a, normal), "i0": i0, "i1": i1, "i2": i2}


def normal(a, b, c):
    return {"normal": cross(b - a, c - a)}


def edge_normal(a, b, c):
    return {"normal": cross(b - a, a - c)}


def edges(a, b, c):
    return edge_normal(a, b, c) | {"a": a, "ab": b - a, "ca": a - c}


def planes(a, b, c):
    n = cross(b - a, c - a)
    square = dot(n, n)[:, None]
    nb, nc = cross(c - a, n) / square, cross(n, b - a) / square
    return {"n": n, "nd": -dot(n, a), "nb": nb, "bd": -dot(nb, a), "nc": nc, "cd": -dot(nc, a)}


def coordinates(a, b, c):
    n = cross(b - a, c - a)
    return {"bc": line(b, c), "ca": line(c, a), "ab": line(a, b), "n": n, "nd": dot(n, a)}


def transformation(a, b, c):
    ab, ac = b - a, c - a
    normal = cross(ab, ac)
    w, u, v = axes(normal)
    nw = along(normal, w)
    return {
        "bu": along(ac, v) / nw,
        "bv": -along(ac, u) / nw,
        "bd": (along(c, u) * along(a, v) - along(c, v) * along(a, u)) / nw,
        "cu": -along(ab, v) / nw,
        "cv": along(ab, u) / nw,
        "cd": (along(b, v) * along(a, u) - along(b, u) * along(a, v)) / nw,
        "nu": along(normal, u) / nw,
        "nv": along(normal, v) / nw,
        "nd": -dot(a, normal) / nw,
        "w": w,
        "u": u,
        "v": v,
    }


def lines(a, b, c):
    n = cross(b - a, c - a)
    w, u, v = axes(n)
    nu, nv = along(n, u) / along(n, w), along(n, v) / along(n, w)
    au, av = along(a, u), along(a, v)
    bu, bv, cu, cv = along(b - a, u), along(b - a, v), along(c - a, u), along(c - a, v)
    area = bu * cv - cu * bv
    return {
        **{"nu": nu, "nv": nv, "nd": nu * au + nv * av + along(a, w), "w": w},
        **{"bu": cv / area, "bv": -cu / area, "bd": (av * cu - au * cv) / area, "u": u},
        **{"cu": -bv / area, "cv": bu / area, "cd": (au * bv - av * bu) / area, "v": v},
    }


def projected(a, b, c):
    n = cross(b - a, c - a)
    w, u, v = axes(n)
    nw = along(n, w)
    nu, nv, au, av = along(n, u) / nw, along(n, v) / nw, along(a, u), along(a, v)
    ab, ac = b - a, c - a
    return {
        **{"nu": nu, "nv": nv, "nd": nu * au + nv * av + along(a, w), "au": au, "av": av},
        **{"eou": along(ab, u) / nw, "eov": along(ab, v) / nw},
        **{"eiu": along(ac, u) / nw, "eiv": along(ac, v) / nw, "w": w, "u": u, "v": v},
    }


OVER_ARRAYS = {
    each.__name__: each
    for each in (
        *(
            stored_plane,
            normal,
            edge_normal,
            edges,
            planes,
            coordinates,
            lines,
            projected,
            transformation,
        ),
    )
}


def vertices(n=3000, seed=5):
    """Return random triangles, some without area, some parallel to an axis, some alike in two."""
    a, b, c = np.random.default_rng(seed).random((3, n, 3), dtype=np.float32) * 2 - 1
    b[:20] = a[:20]
    c[20:40] = b[20:40]
    a[40:60, 2] = b[40:60, 2] = c[40:60, 2]
    a[60:80, 1], b[60:80, 1], c[60:80, 1] = a[60:80, 0], b[60:80, 0], c[60:80, 0]
    return a, b, c


def test_every_way_to_prepare_has_a_formula_here():
    assert set(PREPARED) == set(OVER_ARRAYS)


@pytest.mark.parametrize(("precision", "prepared"), KINDS)
@pytest.mark.parametrize("name", PREPARED)
def test_what_is_stored_is_bit_for_bit_that_of_the_formulas_over_arrays(name, precision, prepared):
    made = PREPARED[name]
    corners = vertices()
    data, arithmetic, real = arithmetics(precision, prepared)
    stored = preparation.prepared(made.prepare, corners, data, arithmetic, real)
    with np.errstate(all="ignore"):
        wanted = OVER_ARRAYS[name](*(v.astype(data).astype(arithmetic) for v in corners))
        wanted = {
            k: v.astype(real if v.dtype.kind == "f" else np.uint32) for k, v in wanted.items()
        }
    assert list(stored.dtype.names) == list(wanted)
    for field, values in wanted.items():
        found = np.ascontiguousarray(stored[field])
        assert found.dtype == values.dtype
        np.testing.assert_array_equal(found, values)  # NaN where NaN
        if found.dtype.kind == "f":
            there = ~np.isnan(values)
            assert np.array_equal(np.signbit(found)[there], np.signbit(values)[there])


@pytest.mark.parametrize("name", PREPARED)
def test_exact_data_are_what_float64_comes_near_to(name):
    made = PREPARED[name]
    corners = tuple(v[80:180] for v in vertices())
    rays = np.ones((100, 3))
    triangles, _ = exact_records(made, corners, rays, rays)
    floats = preparation.prepared(made.prepare, corners, *[np.float64] * 3)
    for exact, found in zip(triangles, floats, strict=True):
        normal = [float(x) for x in exact.normal] if name == "stored_plane" else []
        scale = 1 / math.hypot(*normal) if normal else 1.0
        for field in floats.dtype.names:
            value = getattr(exact, field)
            if floats.dtype[field].base.kind == "u":
                assert value == found[field]
                continue
            parts = value if isinstance(value, tuple) else (value,)
            assert all(type(part) is Fraction for part in parts)
            # The triangles are no slivers: 1e-9 is far above the rounding, far below the values.
            wanted = np.array([float(part) * scale for part in parts])
            np.testing.assert_allclose(found[field], wanted.reshape(found[field].shape), 1e-9, 1e-9)


def test_the_exact_normal_keeps_its_length():
    a, b, c = (np.array([p], float) for p in ((0, 0, 0), (3, 0, 0), (0, 5, 0)))
    (triangle,), _ = exact_records(KERNELS["badouel"], (a, b, c), a, b)
    assert triangle.normal == (0, 0, 15)
    assert (triangle.d, triangle.i0, triangle.i1, triangle.i2) == (0, 2, 0, 1)


def test_exact_data_of_a_triangle_without_area_are_undefined():
    a = np.ones((1, 3))
    (triangle,), _ = exact_records(KERNELS["wald"], (a, a, a), a, a)
    assert triangle.bu is UNDEFINED and not triangle.nd < 0 and not triangle.nd >= 0


def test_double_preparation_is_rounded_once_at_the_end():
    corners = vertices()
    rays = np.ones((len(corners[0]), 3))
    made = KERNELS["perpendicular_planes"]
    own, double = (
        fill(made, "own", "float32", corners, rays, rays, prepared=how)[0]["nd"]
        for how in ("own", "double")
    )
    a, b, c = (v.astype(np.float64) for v in corners)
    assert np.array_equal(double, (-dot(cross(b - a, c - a), a)).astype(np.float32))
    assert not np.array_equal(own, double)


def prepares(function):
    """Return a kernel that stores what a function prepares, and reads it."""

    def reader(tri, ray):
        return HIT, tri.field * ray.dir[0]

    declare = kernel(
        title="hand-made",
        method="hand-made",
        domain="line",
        outcomes=("hit", "miss"),
        source="this test",
        prepare=function,
    )
    return declare(reader).kernels[0]


def test_fields_are_those_of_the_dict_in_their_order_and_shape():
    def several(tri):
        return {
            "field": tri.v0[0] + tri.v1[1],
            "four": (tri.v0[0], tri.v1[0], tri.v2[0], tri.v2[1]),
            "axis": 2 if tri.v0[2] > tri.v0[1] else 1,
        }

    assert preparation.stored_type(several, np.float64) == np.dtype(
        [("field", "f8"), ("four", "f8", (4,)), ("axis", "u4")], align=True
    )
    stored = preparation.prepared(
        several, tuple(np.arange(9.0).reshape(3, 1, 3)), *[np.float32] * 3
    )
    assert stored["field"] == 4 and stored["axis"] == 2
    assert stored["four"].tolist() == [[0, 3, 6, 7]]


@pytest.mark.parametrize(
    "text",
    [
        "def strange(tri):\n    stored = {'field': tri.v0[0]}\n    return stored\n",
        "def strange(tri):\n    return tri.v0[0]\n",
        "def strange(tri):\n    return {}\n",
        "def strange(tri):\n    return {**{'field': tri.v0[0]}}\n",
        "def strange(v0, v1, v2):\n    return {'field': v0[0]}\n",
        "def strange(tri):\n    if tri.v0[0] > 0.0:\n        return {'field': 1.0}\n"
        "    return {'field': 2.0}\n",
    ],
)
def test_what_is_no_dict_display_is_told_in_one_line(tmp_path, text):
    path = tmp_path / "strange.py"
    path.write_text(text)
    names = {}
    exec(compile(text, path, "exec"), names)
    with pytest.raises(RtbenchError) as told:
        record_types(prepares(names["strange"]), "own", "float32")
    assert str(told.value) == (
        "prepare 'strange' must take (tri) and end in return {\"field\": ...}, its only return"
    )


def test_a_prepare_that_cannot_be_run_or_stored_is_told():
    def misspelt(tri):
        return {"field": tri.v3[0]}

    def text(tri):
        return {"field": "text"}

    def whole(tri):
        return {"field": tri.v0}

    for function, says in (
        (misspelt, "prepare 'misspelt' fails: .*no attribute 'v3'"),
        (text, "prepare 'text' stores 'field' as 'text': a number"),
    ):
        with pytest.raises(RtbenchError, match=says) as told:
            record_types(prepares(function), "own", "float32")
        assert "\n" not in str(told.value)
    assert preparation.stored_type(whole, np.float32)["field"].shape == (3,)


def test_what_does_not_compile_is_told_in_one_line():
    def called(tri):
        return {"field": tri.v0[0].__abs__()}

    with pytest.raises(RtbenchError, match="prepare 'called' does not compile") as told:
        preparation.prepared(called, vertices(100), *[np.float32] * 3)
    assert "\n" not in str(told.value)


def test_what_is_irrational_has_no_exact_form():
    def root(tri):
        return {"field": math.sqrt(abs(tri.v0[0])), "miss": NO_T}

    ones = np.ones((1, 3))
    with pytest.raises(RtbenchError, match="root stores an irrational 'field'"):
        exact_records(prepares(root), (ones, ones, ones), ones, ones)


def test_operations_of_preparing_are_those_counted_by_hand():
    def counts(name):
        return tuple(preparation_operations(KERNELS[name]).values())

    # two edges; one cross product
    assert counts("kensler_shirley_with_normal") == (0, 6 + 3, 6, 0, 0)
    # two edges; three products; N.N; three distances of A and their signs; two vectors divided
    assert counts("perpendicular_planes") == (2 + 3 * 2, 6 + 3 * 3 + 3, 3 * 6 + 3 + 3 * 3, 6, 0)
    assert preparation_operations(KERNELS["moller1"]) is None


def test_what_a_kernel_stores_is_known_without_numba():
    code = """
import sys
from rtbench.compiled.layout import record_types
from rtbench.kernels.registry import all_kernels
for kernel in all_kernels().values():
    record_types(kernel, "padded", "float32")
print("numba" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
