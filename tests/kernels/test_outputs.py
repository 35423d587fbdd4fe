"""NAME_hit, NAME_point and NAME_normal: the same test, asked for something else."""

import json
import os
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import plain
import pytest
import running_error
import workload

import rtbench
from rtbench.compiled import syntax
from rtbench.compiled.operations import operations
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import HIT, OUTPUTS
from rtbench.kernels.registry import all_kernels, derived, find, select

KERNELS = all_kernels()
ENDED = [n for n, k in KERNELS.items() if k.ending and k.outputs == ("t",)]
COMPILED = (
    "wald",
    "moller_trumbore_last",
    "signed_areas_last_whole",
    "keidy_uvt",
    "pluecker_text9",
)


def test_forms_are_made_on_demand_and_not_listed():
    for name in ENDED:
        forms = derived(KERNELS[name])
        takes_tmax = KERNELS[name].takes_tmax
        assert f"{name}_hit" in forms and (f"{name}_point" in forms) == takes_tmax
        for form, kernel in forms.items():
            assert find(form) is find(form) and find(form) == kernel and kernel.name == form
            assert form not in KERNELS and "_uv_" not in form
            assert kernel.outputs == OUTPUTS[form.rpartition("_")[2]]
            assert kernel.title != KERNELS[name].title
    assert [kernel.name for kernel in select(["wald_point", "wald", "wald_point"])] == [
        "wald_point",
        "wald",
    ]
    for whole in ("moller1", "chirkov_uv", "angle_sum", "wald_uv"):
        assert derived(KERNELS[whole]) == {}


def test_a_normal_is_had_where_the_pieces_give_one():
    with_normal = {n for n in ENDED if f"{n}_normal" in derived(KERNELS[n])}
    methods = {KERNELS[n].function.__name__ for n in with_normal}
    every = {k.function.__name__ for k in KERNELS.values() if k.ending}
    # Projected and transformed, these never have one in three coordinates.
    assert every - methods == {"moller_trumbore", "wald", "shevtsov", "baldwin_weber"}


@pytest.mark.parametrize(
    ("name", "nearest"),
    [
        ("wald_pont", "wald_point"),
        ("keidy_norml", "keidy_normal"),
        ("moler1", "moller1"),
        ("wald_uv_hit", "wald_uvt_hit"),
        ("wald_inside_point", "wald_inside_hit"),
    ],
)
def test_what_is_not_there_is_told_with_the_nearest(name, nearest):
    with pytest.raises(RtbenchError, match=f"unknown kernel '{name}'; did you mean '{nearest}'"):
        find(name)


def test_they_need_what_they_return_and_no_more():
    for name in ENDED:
        hit, t = operations(find(f"{name}_hit")), operations(KERNELS[name])
        assert all(hit[what] <= t[what] for what in t)
        if KERNELS[name].takes_tmax:
            point = operations(find(f"{name}_point"))
            assert (point["mul"] - t["mul"], point["add"] - t["add"]) == (3, 3)
    # A hit alone never divides where the division comes last.
    for name in ENDED:
        if KERNELS[name].ending.division == "last":
            assert operations(find(f"{name}_hit"))["div"] == 0
        for form in derived(KERNELS[name]):
            assert syntax.tree(find(form)).name == form


@pytest.mark.parametrize("precision", workload.DATA)
@pytest.mark.parametrize("name", COMPILED)
def test_a_point_lies_on_the_ray_and_a_hit_is_the_same_hit(name, precision):
    group = workload.groups(precision)["random, tmax"]
    outcome, outputs = group.answers(KERNELS[name], precision)
    hit = outcome == HIT
    assert hit.sum() > 20
    alone, nothing = group.answers(find(f"{name}_hit"), precision)
    assert np.array_equal(alone, outcome) and nothing == {}
    point = find(f"{name}_point")
    same, xyz = group.answers(point, precision)
    assert np.array_equal(same, outcome)
    run = running_error.run(
        point, precision, group.triangles, group.origins, group.directions, group.tmax
    )
    reference = group.reference
    for axis, what in enumerate("xyz"):
        right = group.origins[:, axis] + reference.t * group.directions[:, axis].astype(float)
        room = run.outputs[what][1] + 4 * reference.t_error + 2.0**-50
        assert (np.abs(xyz[what] - right)[hit] <= room[hit]).all()
        # The point is O + t D of this very t, in this precision.
        rounded = group.origins[:, axis] + group.directions[:, axis] * outputs["t"]
        assert np.array_equal(xyz[what][hit], rounded[hit])


@pytest.mark.parametrize("precision", workload.DATA)
@pytest.mark.parametrize("name", COMPILED[2:])
def test_a_normal_is_parallel_to_the_exact_one(name, precision):
    group = workload.groups(precision)["random"]
    kernel = find(f"{name}_normal")
    outcome, found = group.answers(kernel, precision)
    run = running_error.run(
        kernel, precision, group.triangles, group.origins, group.directions, group.tmax
    )
    assert (outcome == HIT).sum() > 20
    for i in np.flatnonzero(outcome == HIT):
        a, b, c = ([Fraction(float(x)) for x in corner] for corner in group.triangles[i])
        e, f = ([y - x for x, y in zip(a, other, strict=True)] for other in (b, c))
        exact = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
        normal = [Fraction(float(found[what][i])) for what in OUTPUTS["normal"]]
        bounds = [Fraction(float(run.outputs[what][1][i])) for what in OUTPUTS["normal"]]
        factor = sum(x * y for x, y in zip(normal, exact, strict=True)) / sum(x * x for x in exact)
        assert factor != 0
        # Each component is off by no more than it and the others, which the factor is taken of.
        for x, y in zip(normal, exact, strict=True):
            assert abs(x - factor * y) <= 2 * sum(bounds)


TOY = '''
"""A toy of one file: Cramer's rule by three determinants."""

from rtbench.kernels.pieces import method, pieces


@method(title="Toy", method="Toy", source="this test")
def toy(tri, ray):
    ax, ay, az = tri.v0[0] - ray.orig[0], tri.v0[1] - ray.orig[1], tri.v0[2] - ray.orig[2]
    ex, ey, ez = tri.v0[0] - tri.v1[0], tri.v0[1] - tri.v1[1], tri.v0[2] - tri.v1[2]
    fx, fy, fz = tri.v0[0] - tri.v2[0], tri.v0[1] - tri.v2[1], tri.v0[2] - tri.v2[2]
    mx, my, mz = fy * ray.dir[2] - ray.dir[1] * fz, ray.dir[0] * fz - fx * ray.dir[2], (
        fx * ray.dir[1] - fy * ray.dir[0]
    )
    denominator = ex * mx + ey * my + ez * mz
    b = ax * mx + ay * my + az * mz
    kx, ky, kz = ex * ay - ax * ey, ax * ez - ex * az, ey * az - ay * ez
    c = ray.dir[2] * kx + ray.dir[1] * ky + ray.dir[0] * kz
    t = -(fz * kx + fy * ky + fx * kz)
    return pieces(denominator, t, b, c)
'''
TOY_NAMES = {
    "toy" + ending + uv
    for ending in (
        *("", "_uvt", "_last", "_last_uvt", "_whole", "_last_whole", "_text9"),
        *("_stable", "_stable_whole"),
    )
    for uv in ("", "_uv")
}


def test_a_toy_method_of_a_file_has_every_ending_and_output(tmp_path):
    path = tmp_path / "toy.py"
    path.write_text(TOY, encoding="utf-8")
    group = workload.groups("float64")["random"]
    pairs = group.triangles, group.origins, group.directions
    for name in sorted(TOY_NAMES):
        answers = plain.run(find(f"{path}:{name}"), *pairs)
        assert np.array_equal([each[0] == HIT for each in answers], group.right("ray")), name
    found = rtbench.intersect(f"{path}:toy_last", *pairs, "float64")
    assert np.array_equal(found.hit, group.right("ray"))
    assert find(f"{path}:toy_last_point").outputs == OUTPUTS["point"]
    with pytest.raises(RtbenchError, match=r"unknown kernel of toy\.py 'toy_normal'"):
        find(f"{path}:toy_normal")


def test_a_toy_method_in_the_package_folder_is_listed_with_no_other_line_changed(tmp_path):
    copied = tmp_path / "rtbench"
    shutil.copytree(
        Path(rtbench.__file__).parent, copied, ignore=shutil.ignore_patterns("__pycache__")
    )
    (copied / "kernels" / "toy.py").write_text(TOY, encoding="utf-8")
    told = subprocess.run(
        [sys.executable, "-m", "rtbench", "kernels", "--format", "json"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    listed = {kernel["name"] for kernel in json.loads(told.stdout)}
    assert listed - set(KERNELS) == TOY_NAMES and set(KERNELS) <= listed
