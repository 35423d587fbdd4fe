"""The folder of generated modules: whose it is, what it keeps, what it never touches."""

import os
import stat
import subprocess
import sys
import time

import pytest

from rtbench.compiled import cache
from rtbench.errors import RtbenchError

DAY = 86400


@pytest.fixture
def root(tmp_path, monkeypatch):
    """Return a cache folder that is not made yet; `cache.folder` looks anew."""
    monkeypatch.setenv("RTBENCH_CACHE_DIR", str(tmp_path / "root"))
    cache.folder.cache_clear()
    yield tmp_path / "root"
    cache.folder.cache_clear()


def anew():
    """Return the folder as another start would find it."""
    cache.folder.cache_clear()
    return cache.folder()


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def test_it_is_made_where_the_variable_says_for_its_owner_alone(root):
    place = cache.folder()
    assert place.parent == root
    assert (mode(root), mode(place)) == (0o700, 0o700)


def test_it_is_made_below_folders_that_are_not_there_either(root, monkeypatch):
    monkeypatch.setenv("RTBENCH_CACHE_DIR", str(root / "not" / "there"))
    assert anew().parent == root / "not" / "there"


def test_without_the_variable_it_is_in_the_user_s_cache(root, monkeypatch):
    monkeypatch.delenv("RTBENCH_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(root))
    monkeypatch.setattr(sys, "platform", "linux")
    assert anew().parent == root / "rtbench"


def test_its_name_tells_what_the_code_is_good_for(root):
    import llvmlite
    import numba
    import numpy

    name = cache.folder().name
    for package in (numba, llvmlite, numpy):
        assert f"{package.__name__}-{package.__version__}" in name
    assert sys.implementation.cache_tag in name


def test_others_lose_their_access_to_a_folder_of_ours(root):
    place = cache.folder()
    place.chmod(0o777)
    assert mode(anew()) == 0o700


def test_a_folder_that_holds_other_things_too_is_left_as_it_is(root):
    """RTBENCH_CACHE_DIR=/tmp, or one's home: neither its mode nor what lies in it is ours."""
    root.mkdir()
    root.chmod(0o755)
    for name in ("documents", "0.1.0", "rtbench", "rtbench-old", "rtbench-results_2026"):
        (root / name).mkdir()
        (root / name / "thesis.txt").write_text("years of work")
    (root / "thesis.py").write_text("print()")
    before = sorted(root.rglob("*"))
    os.utime(root / "thesis.py", (0, 0))
    place = cache.folder()
    assert sorted(path for path in root.rglob("*") if place not in (path, *path.parents)) == before
    assert mode(root) == 0o755


def other_user(monkeypatch):
    real = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: real + 1)


def test_another_user_s_folder_is_refused(root, monkeypatch):
    root.mkdir()
    other_user(monkeypatch)
    with pytest.raises(RtbenchError, match="belongs to another user") as told:
        cache.folder()
    assert str(root) in str(told.value) and "RTBENCH_CACHE_DIR" in str(told.value)
    assert list(root.iterdir()) == []


def test_another_user_s_folder_within_ours_is_refused_too(root, monkeypatch):
    place = cache.folder()
    real = type(place).stat

    def owned_by_another(path, **more):
        status = list(real(path, **more))
        if path == place:
            status[stat.ST_UID] += 1
        return os.stat_result(status)

    monkeypatch.setattr(type(place), "stat", owned_by_another)
    with pytest.raises(RtbenchError, match="belongs to another user"):
        anew()


UNWRITABLE = """
from rtbench.compiled.instantiate import instantiate
for number in (1, 2):
    made = instantiate(f"def entry(x):\\n    return x + {number}\\n", signature="int64(int64)")
    assert made.call(1) == 1 + number and made.fresh
print(made.path.parent, oct(made.path.parent.stat().st_mode & 0o777))
"""


def test_a_folder_that_cannot_be_written_is_replaced_with_one_remark(tmp_path):
    (tmp_path / "file").write_text("no folder")
    blocked = tmp_path / "file" / "cache"
    done = subprocess.run(
        [sys.executable, "-c", UNWRITABLE],
        capture_output=True,
        text=True,
        env=os.environ | {"RTBENCH_CACHE_DIR": str(blocked)},
        check=True,
    )
    place, permissions = done.stdout.split()
    assert permissions == "0o700"
    assert not os.path.exists(place)  # it went with the process
    (remark,) = done.stderr.splitlines()
    assert str(blocked) in remark and place in remark and "RTBENCH_CACHE_DIR" in remark


def old(path, days):
    os.utime(path, (time.time() - days * DAY,) * 2)


def entry(place, name):
    """Write what a compiled entry leaves behind; return its files."""
    found = [place / f"{name}.py", place / f"{name}.s"]
    (place / "__pycache__").mkdir(exist_ok=True)
    for ending in ("f-9.py311.nbi", "f-9.py311.1.nbc", "cpython-311.pyc"):
        found.append(place / "__pycache__" / f"{name}.{ending}")
    for path in found:
        path.write_text("")
    return found


def test_entries_that_nobody_used_for_30_days_go_whole_and_others_stay(root):
    place = cache.folder()
    unused, used, similar = (entry(place, n) for n in ("moller1_ab", "chirkov_cd", "moller1_abc"))
    old(unused[0], 31)
    old(used[0], 29)
    for path in (*used[1:], *similar[1:]):  # when a module was last used is told by its own file
        old(path, 100)
    anew()
    assert not any(path.exists() for path in unused)
    assert all(path.exists() for path in (*used, *similar))


def test_what_is_used_is_not_thrown_away(tmp_path):
    code = """
from rtbench.compiled.instantiate import instantiate
print(instantiate("def entry(x):\\n    return x\\n", signature="int64(int64)").path)
"""
    environment = os.environ | {"RTBENCH_CACHE_DIR": str(tmp_path)}

    def start():
        command = [sys.executable, "-c", code]
        return subprocess.check_output(command, text=True, env=environment).strip()

    module = start()
    old(module, 29)
    assert start() == module
    assert time.time() - os.stat(module).st_mtime < DAY


def test_other_versions_go(root):
    place = cache.folder()
    older = root / place.name.replace("numba-", "numba-0.")
    older.mkdir()
    entry(older, "moller1_ab")
    kept = entry(place, "moller1_ab")
    anew()
    assert not older.exists()
    assert all(path.exists() for path in kept)


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    target = tmp_path / "module.py"
    cache.write_whole(target, "first")
    monkeypatch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        cache.write_whole(target, "second")
    assert target.read_text() == "first"
    assert list(tmp_path.iterdir()) == [target]
