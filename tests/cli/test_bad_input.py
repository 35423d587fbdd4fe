"""Bad input: one line, the exit code, nothing on stdout, and nothing left behind."""

import json

import pytest

from rtbench.experiments import run
from rtbench.experiments.config import Config

SMALL = ("--tris", 40, "--reps", 4, "--kernel", "moller1", "--density", 0.5, "--quiet")


def refused(ended, code=2):
    assert (ended.code, ended.out) == (code, "")
    assert ended.err.startswith("rtbench: ") and ended.err.endswith("\n")
    assert ended.err.count("\n") == 1, "not one line"
    assert "Traceback" not in ended.err
    return ended.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--density", "-0.1"), "density -0.1 is not allowed (allowed: 0 to 1)"),
        (("--density", "1.5"), "density 1.5 is not allowed"),
        (("--density", "nan"), "density nan is not allowed"),
        (("--density", "inf"), "density inf is not allowed"),
        (("--density", "most"), "'most' is not a valid float"),
        (("--density", "0.3", "--density", "0.3"), "densities names 0.3 twice"),
        (("--density",), "requires an argument"),
        (("--tris", "0"), "triangles 0 is not allowed"),
        (("--tris", "-3"), "triangles -3 is not allowed"),
        (("--tris", "many"), "'many' is not a valid integer"),
        (("--tris", "1.5"), "'1.5' is not a valid integer"),
        (("--tris", "9" * 30), "is not allowed"),
        (("--reps", "0"), "repetitions 0 is not allowed"),
        (("--reps", "-1"), "repetitions -1 is not allowed"),
        (("--kernel", "moler1"), "unknown kernel 'moler1'; did you mean 'moller1'?"),
        (("--kernel", "zzz*"), "unknown kernel pattern 'zzz*'"),
        (("--kernel", ""), "unknown kernel ''"),
        (("--kernel", "nowhere.py:mine"), "nowhere.py' is not there"),
        (("--precision", "float16"), "unknown precision 'float16'; did you mean"),
        (("--order", "sorte"), "unknown order 'sorte'; did you mean 'sorted'?"),
        (("--layout", "shard"), "unknown layout 'shard'; did you mean 'shared'?"),
        (("--generator", "pcg46"), "unknown generator 'pcg46'; did you mean 'pcg64'?"),
        (("--tris", "1", "--density", "0.3"), "density 0.3 cannot be reached with 1 pairs"),
        (("--processes", "0"), "processes 0 is not allowed"),
        (("--samples", "0"), "samples 0 is not allowed"),
        (("--reps", "10", "--samples", "11"), "need at least as many repetitions"),
        (("--reps", "10", "--samples", "3", "--processes", "4"), "4 processes x 3 samples"),
        (("--seed", "-1"), "seed -1 is not allowed"),
        (("--generator", "msvc", "--seed", "4294967296", "--tris", "9"), "4294967296"),
        (("--cpu", "9999"), "--cpu 9999: "),
        (("--cpu", "-1"), "--cpu -1: "),
        (("--foo",), "No such option"),
        (("--format", "xml"), "'xml' is not one of"),
        (("blecha-4.22",), "unknown config 'blecha-4.22'; did you mean 'blecha-4.2'?"),
        (("blecha-4.2", "blecha-4.3"), "unexpected extra argument"),
        (("nowhere/blecha-4.2.toml",), "unknown config"),
        (("working-set", "--kernel", "nobody", "--quick"), "unknown kernel 'nobody'"),
        (("--resume", "nothing"), "unknown run 'nothing'"),
        (("--resume", ""), "unknown run ''"),
        (("--resume", "blecha-pc1"), "published record"),
        (("--resume", "blecha-pc1", "--reps", "3"), "no other options"),
        (("blecha-4.2", "--resume", "blecha-pc1"), "no CONFIG"),
        (("--resume", "blecha-pc1", "--cpu", "0"), "no other options"),
    ],
)
def test_run_refuses(rtbench, tmp_path, arguments, said):
    assert said in refused(rtbench("run", *arguments))
    assert list((tmp_path / "here").iterdir()) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("densitis = [0.5]", "unknown key 'densitis'; did you mean 'densities'?"),
        ("densities = 0.5", "densities = 0.5 is not allowed (a list of float)"),
        ("{", "is not TOML"),
        ('kernels = ["moller9"]', "unknown kernel 'moller9'"),
        ('experiment = "working_set"', "sizes is empty"),
    ],
)
def test_run_refuses_a_config(rtbench, tmp_path, text, said):
    path = tmp_path / "question.toml"
    path.write_text(text)
    assert said in refused(rtbench("run", path))
    assert list((tmp_path / "here").iterdir()) == []


def test_an_unwritable_folder(rtbench, tmp_path):
    (tmp_path / "here" / "results").write_text("a file in the way")
    for out in ("results", "results/below"):
        refused(rtbench("run", *SMALL, "--out", out))
    assert (tmp_path / "here" / "results").read_text() == "a file in the way"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("rum",), "unknown command 'rum'; did you mean 'run'?"),
        (("--foo",), "No such option"),
        (("kernels", "shwo"), "No such command 'shwo'"),
        (("kernels", "show"), "Missing argument 'NAME'"),
        (("kernels", "show", "chirkof"), "unknown kernel 'chirkof'; did you mean 'chirkov'?"),
        (("kernels", "show", "chirkov", "--asm", "--precision", "double"), "unknown precision"),
        (("kernels", "show", "chirkov", "--asm", "--layout", "packed"), "unknown layout"),
        (("kernels", "--format", "xml"), "'xml' is not one of"),
    ],
)
def test_other_commands_refuse(rtbench, arguments, said):
    assert said in refused(rtbench(*arguments))


def test_a_wrong_kernel_is_exit_code_4(rtbench, tmp_path):
    path = tmp_path / "never.py"
    path.write_text(
        "from rtbench.kernels.contract import NO_T, ZERO, kernel\n"
        "@kernel(title='x', method='x', domain='line', outcomes=('hit', 'miss'), source='x')\n"
        "def never(tri, ray):\n"
        "    return 1, NO_T\n"
    )
    told = refused(rtbench("run", *SMALL, "--kernel", f"{path}:never"), code=4)
    assert "never" in told and "wrong about 20 of 40 pairs; the first is pair" in told
    assert list((tmp_path / "here").iterdir()) == []


class Impatient:
    def say(self, text):
        pass

    plan = say

    def progress(self, fraction):
        if fraction > 0.4:
            raise KeyboardInterrupt


@pytest.fixture
def cut_off(rtbench, tmp_path):
    """Return the name of a run in ./results that was stopped."""
    config = Config(kernels=("moller1",), densities=(0.5,), triangles=40, repetitions=4)
    with pytest.raises(run.Stopped):
        run.start(config, Impatient(), tmp_path / "here" / "results", "cut")
    (path,) = (tmp_path / "here" / "results").iterdir()
    return path


def test_resume_takes_a_folder_name_or_a_path_and_only_once(rtbench, cut_off, tmp_path):
    near = cut_off.name[:-1]
    assert f"did you mean {cut_off.name!r}" in refused(rtbench("run", "--resume", near))
    assert "no other options" in refused(rtbench("run", "--resume", cut_off.name, "--quick"))
    ended = rtbench("run", "--resume", cut_off.name, "--quiet")
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.rstrip().endswith(f"results/{cut_off.name}")
    assert (cut_off / "tables").is_dir() and (cut_off / "plots").is_dir()
    for name in (cut_off.name, cut_off, f"results/{cut_off.name}"):
        assert "is finished" in refused(rtbench("run", "--resume", name))
    # From another folder, by the output folder and the name.
    assert "is finished" in refused(
        rtbench("run", "--resume", cut_off.name, "--out", tmp_path / "here" / "results")
    )


def test_resume_elsewhere_or_later(rtbench, cut_off):
    info = json.loads((cut_off / "run.json").read_text())
    info["software"]["numba"] = "0.1"
    (cut_off / "run.json").write_text(json.dumps(info))
    assert "numba is not the same: 0.1 then" in refused(rtbench("run", "--resume", cut_off))
    info["schema"] = 99
    (cut_off / "run.json").write_text(json.dumps(info))
    assert "schema 99" in refused(rtbench("run", "--resume", cut_off), code=3)
    (cut_off / "run.json").write_text("{")
    assert "damaged" in refused(rtbench("run", "--resume", cut_off), code=3)
