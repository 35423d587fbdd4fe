"""Which kernels there are, and kernels of a user's own file."""

import numpy as np
import pytest

import rtbench
from rtbench.compiled.catalogue import facts
from rtbench.compiled.loops import loop
from rtbench.compiled.operations import operations
from rtbench.errors import RtbenchError
from rtbench.kernels.registry import all_kernels, find, select

LISTINGS = ("moller0", "moller1", "moller2", "moller3", "badouel", "chirkov")
METHODS = {  # which of them project, or meet the plane first, and so can test a point alone
    "badouel_cramer": True,
    "baldwin_weber": True,
    "half_spaces_origin": False,
    "half_spaces_perpendicular": True,
    "keidy": True,
    "kensler_shirley": False,
    "kensler_shirley_with_normal": False,
    "kensler_shirley_stored": False,
    "moller_trumbore": False,
    "perpendicular_planes": True,
    "pluecker": False,
    "pluecker_stored": False,
    "shevtsov": True,
    "signed_areas": True,
    "wald": True,
}
STABLE = ("half_spaces_origin", "kensler_shirley", "moller_trumbore", "pluecker")
NEVER_LEAKING = ("adaptive_exact", "half_open", "watertight", "watertight_safe")
ENDINGS = ("", "_uvt", "_last", "_last_uvt", "_whole", "_last_whole", "_text9")

HEAD = """
import math
import numpy as np
from rtbench.kernels.contract import EPSILON, HIT, NO_T, ONE, ZERO, kernel

def declared(**more):
    return kernel(title="own", method="own", domain="line", outcomes=("hit", "miss"),
                  source="a user", **more)
"""

# The distance to the plane of the triangle, in three ways of writing it.
PLANE = """
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

def normal_of(tri):
    ax = tri.v1[0] - tri.v0[0]
    ay = tri.v1[1] - tri.v0[1]
    az = tri.v1[2] - tri.v0[2]
    bx = tri.v2[0] - tri.v0[0]
    by = tri.v2[1] - tri.v0[1]
    bz = tri.v2[2] - tri.v0[2]
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx

HALF = 0.1 * 5

@declared(outputs=("t", "u", "v"))
def plane(tri, ray):
    n = normal_of(tri)
    slope = dot(n, ray.dir)
    if -EPSILON < slope and slope < EPSILON:
        return 1, NO_T, NO_T, NO_T
    t = (dot(n, tri.v0) - dot(n, ray.orig)) / slope
    steep = abs(slope) / math.sqrt(dot(n, n))
    return HIT, t, steep, HALF if slope > ZERO else -HALF * ONE
"""


def write(folder, body, name="own.py", head=HEAD):
    path = folder / name
    path.write_text(head + body)
    return path


def test_the_package_has_every_method_with_and_without_u_and_v():
    expected = {*LISTINGS, *NEVER_LEAKING}
    expected |= {f"{method}_stable{whole}" for method in STABLE for whole in ("", "_whole")}
    for method, tests_points in METHODS.items():
        order = [e.replace("uvt", "tuv") for e in ENDINGS] if "moller" in method else ENDINGS
        expected |= {method + ending for ending in order}
        expected |= {f"{method}_inside"} if tests_points else set()
    expected |= {f"{name}_uv" for name in expected}
    assert set(all_kernels()) == expected | {"angle_sum"}
    assert all(kernel.name == name for name, kernel in all_kernels().items())


def test_each_has_as_many_outcomes_as_its_listing_has_codes():
    counts = {name: len(all_kernels()[name].outcomes) for name in LISTINGS}
    assert counts == dict.fromkeys(LISTINGS, 6) | {"badouel": 5, "chirkov": 2}


def test_names_and_globs_select_each_kernel_once_in_order():
    chosen = select(["chirkov", "moller[01]", "mol*1", "chirkov"])
    assert [kernel.name for kernel in chosen] == ["chirkov", "moller0", "moller1"]
    assert [kernel.name for kernel in select(["*"])] == list(all_kernels())
    assert [kernel.name for kernel in select(["moller?"])] == [f"moller{i}" for i in range(4)]
    assert select([]) == []


@pytest.mark.parametrize("precision", ["float32", "float64", "mixed"])
def test_a_kernel_of_a_file_runs_and_equals_numpy(precision, tmp_path):
    """Helpers that take vectors, tuples, globals, math, a conditional expression: in each type."""
    path = write(tmp_path, PLANE)
    random = np.random.default_rng(5)
    tris = random.random((300, 3, 3)).astype(np.float32)
    org, dir = (random.random((2, 300, 3)) - 0.5).astype(np.float32)
    found = rtbench.intersect(f"{path}:plane_uv", tris, org, dir, precision, tmin=-np.inf)
    v0, v1, v2 = (tris[:, i].astype(float) for i in range(3))
    normal = np.cross(v1 - v0, v2 - v0)
    slope = (normal * dir).sum(1)
    np.testing.assert_array_equal(found.outcome, np.abs(slope) < 1e-6)
    accuracy = 1e-2 if precision == "float32" else 1e-10
    at = np.abs(slope) > (1e-3 if precision == "float32" else 1e-6)
    assert at.sum() > 200
    t = (normal * (v0 - org)).sum(1) / slope
    np.testing.assert_allclose(found.t[at], t[at], rtol=accuracy, atol=accuracy)
    steep = np.abs(slope) / np.linalg.norm(normal, axis=1)
    np.testing.assert_allclose(found.u[at], steep[at], rtol=accuracy)
    half = found.t.dtype.type(0.1 * 5)
    assert np.array_equal(found.v[at], np.where(slope > 0, half, -half)[at])
    if precision == "mixed":  # every step of it is in float64, whatever helper it stands in
        double = rtbench.intersect(f"{path}:plane_uv", tris, org, dir, "float64", tmin=-np.inf)
        for field in "tuv":
            values = getattr(found, field), getattr(double, field)
            assert np.array_equal(*values, equal_nan=True)


def test_the_form_without_u_and_v_of_a_file_s_kernel_needs_less(tmp_path):
    path = write(tmp_path, PLANE)
    without, with_uv = (find(f"{path}:{name}") for name in ("plane", "plane_uv"))
    assert (without.outputs, with_uv.outputs) == (("t",), ("t", "u", "v"))
    less, more = operations(without), operations(with_uv)
    # By hand: dot(n, n), its root's quotient, abs, and HALF with its condition and minus.
    assert (more["div"] - less["div"], more["dots"] - less["dots"]) == (1, 1)
    assert (more["cond"] - less["cond"], more["mul"] - less["mul"]) == (1, 4)
    assert loop(without).code_digest != loop(with_uv).code_digest


def test_facts_of_a_file_s_kernel(tmp_path):
    told = facts(find(f"{write(tmp_path, PLANE)}:plane_uv"))
    assert (told["name"], told["bytes_per_triangle"], told["domain"]) == ("plane_uv", 36, "line")


def test_a_file_s_kernel_is_selected_beside_others(tmp_path):
    path = write(tmp_path, PLANE)
    chosen = select(["moller1", f"{path}:plane", f"{path}:plane"])
    assert [kernel.name for kernel in chosen] == ["moller1", "plane"]


def test_a_kernel_may_be_called_as_the_generated_module_s_own_names(tmp_path):
    body = "".join(
        f"@declared()\ndef {name}(tri, ray):\n    return HIT, ray.dir[{axis}]\n"
        for axis, name in enumerate(("test", "nest", "loop"))
    )
    path = write(tmp_path, body)
    for axis, name in enumerate(("test", "nest", "loop")):
        found = rtbench.intersect(
            f"{path}:{name}", np.zeros((1, 3, 3)), np.zeros((1, 3)), np.array([[5.0, 6, 7]])
        )
        assert found.t.tolist() == [[5.0], [6.0], [7.0]][axis]


SIMPLE = "@declared()\ndef simple(tri, ray):\n    return HIT, ray.dir[0]\n"


@pytest.mark.parametrize(
    ("body", "name", "message"),
    [
        (SIMPLE, "smiple", r"unknown kernel of own.py 'smiple'; did you mean 'simple'\?"),
        ("def broken(:\n", "broken", "cannot be imported: SyntaxError"),
        ("raise RuntimeError('a\\nb')\n", "x", "cannot be imported: RuntimeError: a b"),
        ("import nosuchmodule\n", "x", "cannot be imported: ModuleNotFoundError"),
        ("def plain(tri, ray):\n    return HIT, ONE\n", "plain", "declares no kernel"),
        (SIMPLE.replace("simple", "moller1"), "moller1", "has the name of a built-in one"),
        (SIMPLE.replace("(tri, ray)", "(triangle, ray)"), "simple", "must take .tri, ray."),
        (SIMPLE.replace("def s", "def S"), "Simple", "'Simple': only a-z, 0-9 and _"),
        ("from rtbench.kernels.moller import moller1\n", "moller1", "declares no kernel"),
    ],
)
def test_bad_files_are_one_line(body, name, message, tmp_path):
    path = write(tmp_path, body)
    with pytest.raises(RtbenchError, match=message) as told:
        find(f"{path}:{name}")
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("ray.dir[0] * SCALE", "reads 'SCALE', which is not defined"),
        ("os.getpid() * ONE", "reads module 'os': numbers, plain functions, numpy and math"),
        ("table[0]", "reads 'table' of type list"),
        ("again(ONE)", "'again' calls itself"),
        ("REAL(ray.dir[0])", "reads 'REAL', which the generated module needs"),
        ("ray.dir[0].nothing", "'simple' does not compile: "),
        ("tri.v7[0]", r"'simple' reads tri.v7: unknown field 'v7'; did you mean 'v"),
    ],
)
def test_bad_kernels_are_one_line_when_they_are_compiled(body, message, tmp_path):
    head = HEAD + (
        "import os\ntable = [1.0]\ndef REAL(x):\n    return x\ndef again(x):\n    return again(x)\n"
    )
    path = write(tmp_path, SIMPLE.replace("ray.dir[0]", body), head=head)
    with pytest.raises(RtbenchError, match=message) as told:
        loop(find(f"{path}:simple"))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("returned", ["HIT", "", "(HIT,)", "result"])
def test_a_kernel_that_does_not_return_what_it_declares(returned, tmp_path):
    body = f"@declared()\ndef simple(tri, ray):\n    result = HIT, ONE\n    return {returned}\n"
    kernel = find(f"{write(tmp_path, body)}:simple")
    with pytest.raises(RtbenchError, match="'simple' must return its outcome, t; it has"):
        loop(kernel)


def test_a_kernel_that_returns_nothing(tmp_path):
    body = "@declared()\ndef simple(tri, ray):\n    t = ray.dir[0]\n"
    with pytest.raises(RtbenchError, match="'simple' returns nothing"):
        loop(find(f"{write(tmp_path, body)}:simple"))


def test_a_missing_file(tmp_path):
    with pytest.raises(RtbenchError, match=r"kernel file '.*nowhere.py' is not there"):
        find(f"{tmp_path / 'nowhere.py'}:moller1")
    with pytest.raises(RtbenchError, match="is not there"):
        find(f"{tmp_path}.py:moller1")


@pytest.mark.parametrize("pattern", ["moler*", "badouel[0-9]"])
def test_a_glob_that_matches_nothing(pattern):
    with pytest.raises(RtbenchError, match="unknown kernel pattern"):
        select([pattern])


def test_two_kernels_of_one_name(tmp_path):
    paths = [write(tmp_path, SIMPLE, name) for name in ("one.py", "two.py")]
    with pytest.raises(RtbenchError, match="two kernels are named 'simple': rename one"):
        select([f"{path}:simple" for path in paths])


LITERALS = """
from rtbench.kernels.contract import HIT, NO_T, kernel

TWO = 2


@kernel(title="l", method="l", domain="line", outcomes=("hit", "miss"), source="none")
def literal(tri, ray):
    x = tri.v0[0] * 0.5 + 1.0
    if x > 1.25:
        return HIT, x
    return 1, NO_T


@kernel(title="w", method="w", domain="line", outcomes=("hit", "miss"), source="none")
def whole(tri, ray):
    x = tri.v0[0] * TWO
    if x > ray.orig[0]:
        return HIT, x
    return 1, NO_T
"""


def test_literals_do_not_make_float64_of_float32(tmp_path):
    from rtbench.compiled.loops import loop
    from rtbench.compiled.machine_code import widens

    file = tmp_path / "typed.py"
    file.write_text(LITERALS, encoding="utf-8")
    literal, whole = (loop(find(f"{file}:{name}")) for name in ("literal", "whole"))
    assert not widens(literal.assembly)
    # An untyped whole number does: it is found out, and remarked by every run.
    assert widens(whole.assembly)
    # The forms that return most, one an ending or a whole listing: what the others do is in them.
    for name, kernel in all_kernels().items():
        if name in LISTINGS or (name.startswith("wald") and name.endswith("_uv")):
            assert not widens(loop(kernel, layout="own").assembly), name


def test_the_name_of_the_empty_loop_is_taken(tmp_path):
    file = tmp_path / "none.py"
    file.write_text(LITERALS.replace("def literal", "def empty"), encoding="utf-8")
    with pytest.raises(RtbenchError, match="empty"):
        find(f"{file}:empty")


@pytest.mark.parametrize(
    "line", ["v = vertex(tri)", "p = tri\n    v = p.v0[0]", "v = two(ray, tri)"]
)
def test_tri_and_ray_keep_their_names(tmp_path, line):
    """A field read under another name would be missing from the kernel's own layout."""
    file = tmp_path / "renamed.py"
    file.write_text(
        "from rtbench.kernels.contract import HIT, kernel\n"
        "def vertex(a):\n    return a.v0[0]\n"
        "def two(tri, ray):\n    return tri.v0[0] + ray.orig[0]\n"
        '@kernel(title="r", method="r", domain="line", outcomes=("hit", "no"), source="none")\n'
        f"def renamed(tri, ray):\n    {line}\n    return HIT, v\n",
        encoding="utf-8",
    )
    kernel = find(f"{file}:renamed")
    with pytest.raises(RtbenchError, match="another name"):
        facts(kernel)
    with pytest.raises(ValueError, match="another name"):
        rtbench.intersect(kernel, np.zeros((1, 3, 3)), np.zeros((1, 3)), np.ones((1, 3)))
