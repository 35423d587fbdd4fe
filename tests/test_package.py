"""What is shipped, and what the README promises."""

import importlib.metadata
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = ROOT / "README.md"


def tracked(*folders):
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a git checkout: nothing says which files belong to the project")
    command = ["git", "-C", str(ROOT), "ls-files", *folders]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()


def shipped():
    files = importlib.metadata.files("rtbench") or []
    names = {file.as_posix() for file in files}
    if not any(name == "rtbench/__init__.py" for name in names):
        pytest.skip("rtbench is installed in editable mode: it ships no files")
    return names


def test_the_wheel_holds_what_git_does():
    expected = set(tracked("rtbench"))
    expected |= {f"rtbench/_data/{name}" for name in tracked("configs")}
    published = tracked("results/published")
    expected |= {"rtbench/_data" + name.removeprefix("results") for name in published}
    found = {
        name for name in shipped() if name.startswith("rtbench/") and "__pycache__" not in name
    }
    assert found == expected


def test_the_top_level_is_what_it_should_be():
    top = {name.split("/")[0] for name in tracked()}
    visible = {name for name in top if not name.startswith(".")}
    assert visible == {"pyproject.toml", "rtbench", "configs", "results", "tests", "README.md"}


def test_configs_and_published_records_are_found_from_any_folder(tmp_path):
    code = (
        "from rtbench.experiments.config import shipped; "
        "from rtbench.records.store import load_run; "
        "print(len(shipped()), load_run('blecha-pc4').summary['ns_per_test'].min())"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    number, best = done.stdout.split()
    assert int(number) >= 11
    assert float(best) == pytest.approx(18.409 / 5e8 * 1e9)  # table 4.3, Möller on pc4


def test_the_readme_has_its_two_commands():
    text = README.read_text(encoding="utf-8")
    assert (
        "python3 -m venv .venv && .venv/bin/pip install . && "
        ".venv/bin/rtbench run --density 0.3 --tris 2000 --reps 10000\n"
    ) in text
    assert ".venv/bin/pip install '.[test]' && .venv/bin/pytest\n" in text


def test_the_readme_names_only_commands_that_are_there():
    from rtbench.cli import COMMANDS
    from rtbench.experiments.config import shipped as configs

    text = README.read_text(encoding="utf-8")
    named = re.findall(r"(?:^|`|/)rtbench ([a-z-]+)", text, flags=re.MULTILINE)
    assert named and set(named) == set(COMMANDS)
    assert set(re.findall(r"rtbench run ([a-z][a-z0-9.-]*)", text)) <= set(configs())


def python_blocks():
    return re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_the_readme_examples_run(capsys):
    pairs, tree = [block for block in python_blocks() if "hits = " in block]
    names: dict = {}
    exec(pairs, names)
    hits, *t = capsys.readouterr().out.replace("[", " ").replace("]", " ").split()
    assert 0 < int(hits) < 1000
    assert all(float(value) > 0 for value in t)
    exec(tree, names)
    hits, in_shadow, cost = capsys.readouterr().out.split()
    assert 0 < int(in_shadow) <= int(hits) <= 1000 and float(cost) > 0


def test_the_readme_kernel_is_right(tmp_path):
    """The kernel that a reader is told to write agrees with a solution of linear equations."""
    import numpy as np

    import rtbench

    (source,) = [block for block in python_blocks() if "@kernel" in block]
    file = tmp_path / "mine.py"
    file.write_text(source, encoding="utf-8")
    random = np.random.default_rng(4)
    triangles = random.random((500, 3, 3))
    origins, directions = random.random((500, 3)), random.normal(size=(500, 3))
    found = rtbench.intersect(f"{file}:mine", triangles, origins, directions, "float64")
    v0, e1, e2 = (
        triangles[:, 0],
        triangles[:, 1] - triangles[:, 0],
        triangles[:, 2] - triangles[:, 0],
    )
    matrix = np.stack([-directions, e1, e2], axis=2)
    t, u, v = np.linalg.solve(matrix, (origins - v0)[:, :, None])[:, :, 0].T
    hit = (u > 0) & (v > 0) & (u + v < 1) & (t > 0)
    np.testing.assert_array_equal(found.hit, hit)
    np.testing.assert_allclose(found.t[hit], t[hit], rtol=1e-9)


def test_ci_takes_the_commands_from_the_readme():
    """.ci/run finds both lines by pattern; were the README to lose them, it must fail."""
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    patterns = re.findall(r"grep -m1 [\"'](.*?)[\"'] README.md", script)
    lines = README.read_text(encoding="utf-8").splitlines()
    assert len(patterns) == 2
    for pattern in patterns:
        pattern = pattern.replace("\\.", ".").replace("\\[", "[").replace("\\]", "]")
        assert any(line.startswith(pattern.lstrip("^")) for line in lines)
