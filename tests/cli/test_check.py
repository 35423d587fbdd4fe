"""``rtbench check``: the table, JSON, a corpus of one's own, functions, claims, bad input."""

import json
import platform
import subprocess
import sys

import numpy as np
import pytest

from rtbench.kernels.contract import CLAIMS
from rtbench.workloads import hard_cases

FAMILIES = ("control_random", "near_edge", "shared_edge_exact", "tiny_triangle", "inf_nan")

KERNELS = """
from rtbench.kernels.contract import EPSILON, HIT, NO_T, kernel


@kernel(title="plane", method="plane", domain="line", outcomes=("hit", "miss"), source="a test",
        claims=("S3", "S4"{more}))
def plane(tri, ray):
    t = (tri.v0[2] - ray.orig[2]) / ray.dir[2]
    if abs(ray.dir[2]) < EPSILON:
        return 1, NO_T
    return HIT, t
"""

FUNCTIONS = """
import warnings
import numpy as np

NUMBER = 3


def never(triangles, origins, directions):
    print("noise")
    warnings.warn("noise")
    return np.zeros(len(origins), dtype=bool)


def plane(triangles, origins, directions):
    with np.errstate(all="ignore"):
        t = (triangles[:, 0, 2] - origins[:, 2]) / directions[:, 2]
    return np.isfinite(t), t


def bad(triangles, origins, directions):
    return origins


def raising(triangles, origins, directions):
    raise RuntimeError("no luck")
"""


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    cases = hard_cases.corpus(1)
    wanted = [cases.family_names.index(name) for name in FAMILIES]
    path = tmp_path_factory.mktemp("corpus") / "some.npz"
    cases.take(np.isin(cases.family, wanted)).save(path)
    return path


@pytest.fixture
def functions(rtbench, tmp_path):
    (tmp_path / "here" / "my_functions.py").write_text(FUNCTIONS)
    return tmp_path / "here" / "my_functions.py"


KEYS = ["kernel", "precision", "wrong", "unstable", "leaks", "groups", "doubles"]
KEYS += ["invalid_accepted", "permutation", "c_star", "p99_t", "p99_u", "p99_v", "verdict"]


def test_json(rtbench, corpus):
    told = rtbench("check", "moller1", "moller1_uv", "--corpus", corpus, "--format", "json")
    assert told.code == 0
    found = json.loads(told.out)
    assert [(one["kernel"], one["precision"]) for one in found] == [
        (kernel, precision)
        for kernel in ("moller1", "moller1_uv")
        for precision in ("float32", "float64")
    ]
    for one in found:
        assert list(one)[: len(KEYS)] == KEYS
        assert list(one["verdict"]) == list(CLAIMS)
        assert all(isinstance(holds, bool) for holds in one["verdict"].values())
        assert all(isinstance(one[key], int) for key in KEYS[2:9])
        assert (one["p99_u"] is None) == (one["kernel"] == "moller1")
        assert not one["verdict"]["S1"] and one["unstable"] > 100 and one["c_star"] > 1e5
        assert one["edges"] == "closed" and one["wrong_by_method"] == 0
    # The two forms give the same answers.
    assert {key: found[0][key] for key in KEYS[2:11]} == {key: found[2][key] for key in KEYS[2:11]}


def test_one_kernel_is_told_by_family(rtbench):
    told = rtbench("check", "moller1_uv", "--precision", "float32", "--quiet")
    assert (told.code, told.err) == (0, "")
    assert "moller1_uv float32 fails S1 S2" in told.out
    assert "its EPSILON is absolute" in told.out
    assert "moller1_uv float32 by family" in told.out
    line = next(line for line in told.out.splitlines() if line.startswith("tiny_triangle"))
    assert line.split()[2:4] == ["108", "(31.8"] or float(line.split()[3].strip("(")) > 10
    assert "over log10 of the length of dir" in told.out


def test_a_family_of_one_s_own_corpus(rtbench, corpus):
    told = rtbench("check", "wald_uv", "--corpus", corpus, "--family", "near_edge", "-q")
    assert told.code == 0
    assert told.out.count("\nnear_edge ") == 2 and "tiny_triangle  " not in told.out


def test_csv_is_the_table_of_kernels(rtbench, corpus):
    told = rtbench("check", "wald", "--corpus", corpus, "-q", "--format", "csv")
    lines = told.out.splitlines()
    assert lines[0].startswith("kernel,precision,wrong,unstable,") and len(lines) == 3


@pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64", reason="glibc's fenv_t on x86-64"
)
def test_a_function_whose_library_flushes_subnormals_is_told_of(tmp_path):
    (tmp_path / "flushing.py").write_text(
        "import ctypes\n"
        "import numpy as np\n\n\n"
        "def never(triangles, origins, directions):\n"
        "    libm, words = ctypes.CDLL('libm.so.6'), (ctypes.c_uint32 * 8)()\n"
        "    libm.fegetenv(words)\n"
        "    words[7] |= 0x8000  # flush to zero\n"
        "    libm.fesetenv(words)\n"
        "    return np.zeros(len(origins), bool)\n"
    )
    command = [sys.executable, "-m", "rtbench", "check", "flushing.py:never"]
    command += ["--family", "near_edge"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0
    assert "subnormal results (FTZ) count as zero in this process" in done.stderr


@pytest.mark.parametrize("name", ["my_functions:{}", "my_functions.py:{}"])
def test_functions(rtbench, functions, corpus, name):
    told = rtbench(
        *("check", name.format("never"), name.format("plane"), "--corpus", corpus),
        *("--format", "json", "--precision", "float64", "--quiet"),
    )
    assert told.code == 0 and told.err == "noise\n"
    never, plane = json.loads(told.out)
    assert never["kernel"] == name.format("never") and never["edges"] == "open"
    assert never["leaks"] == never["groups"] == 270 and never["doubles"] == 0
    assert never["p99_t"] is None and never["verdict"]["S3"] and not never["verdict"]["S1"]
    assert plane["leaks"] < 100 and plane["wrong"] > 100 and plane["p99_t"] > 0
    assert plane["claims"] == [] and plane["wrong_by_method"] is None


def test_a_broken_claim_ends_with_one(rtbench, corpus, tmp_path):
    path = tmp_path / "here" / "mine.py"
    path.write_text(KERNELS.replace("{more}", ', "S1", "S2"'))
    told = rtbench("check", f"{path}:plane", "--corpus", corpus, "--precision", "float32", "-q")
    assert told.code == 1
    assert "plane" in told.out.splitlines()[4]
    assert told.err.count("\n") == 1
    assert told.err.startswith("rtbench: plane float32 claims ")
    assert "S1: " in told.err and "unstable answers, worst in" in told.err


def test_a_kept_claim_ends_with_zero(rtbench, corpus, tmp_path):
    path = tmp_path / "here" / "modest.py"
    path.write_text(KERNELS.replace("{more}", "").replace('"S3", "S4"', '"S4",'))
    family = ("--family", "control_random")
    told = rtbench("check", f"{path}:plane", "--corpus", corpus, *family, "-q")
    assert (told.code, told.err) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("moler1",), "unknown kernel 'moler1'; did you mean 'moller1'?"),
        (("wald_inside",), "wald_inside tests whether a point lies in a triangle"),
        (("moller1", "--precision", "float16"), "unknown precision 'float16'"),
        (("moller1", "--corpus", "nothing.npz"), "nothing.npz"),
        (("moller1", "--corpus", "my_functions.py"), "not an npz file of cases"),
        (("moller1", "--all"), "--all and 'moller1'"),
        (("moller1", "--seed", "-1"), "seed -1 is not allowed"),
        (("nowhere:f",), "'nowhere' cannot be imported: ModuleNotFoundError"),
        (("nowhere.py:f",), "file 'nowhere.py' is not there"),
        (("my_functions:nevr",), "did you mean 'never'?"),
        (("my_functions:NUMBER",), "is no function: it is of type int"),
        (("my_functions:bad",), "returns hit of shape ("),
        (("my_functions:raising",), "my_functions:raising fails in float32: RuntimeError: no luck"),
        (("my_functions:never", "--precision", "mixed"), "cannot be asked in mixed"),
    ],
)
def test_bad_input(rtbench, functions, corpus, arguments, said):
    if "--corpus" not in arguments and "--seed" not in arguments:
        arguments = (*arguments, "--corpus", corpus)
    told = rtbench("check", *arguments, "--quiet")
    assert (told.code, told.out) == (2, "")
    assert told.err.startswith("rtbench: ") and told.err.count("\n") == 1
    assert said in told.err


def test_an_unknown_family_is_told(rtbench, corpus):
    told = rtbench("check", "moller1", "--corpus", corpus, "--family", "needel", "-q")
    assert told.code == 2 and "unknown family 'needel'; did you mean 'needle'?" in told.err


def test_no_cases_are_not_passed(rtbench, tmp_path):
    hard_cases.direction_lengths(1, pairs=1).take(slice(0)).save(tmp_path / "none.npz")
    told = rtbench("check", "moller1", "--corpus", tmp_path / "none.npz", "-q")
    assert (told.code, told.out) == (2, "") and "has no cases" in told.err
