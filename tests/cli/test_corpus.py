"""``rtbench corpus``: a file that anybody can load, a table, and no file is lost."""

import csv
import io
import json
import subprocess
import sys

import numpy as np
import pytest

from rtbench.accuracy.cases import CLASS_NAMES, Cases


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Write the corpus once, in a process of its own."""
    file = tmp_path_factory.mktemp("corpus") / "cases.npz"
    command = [sys.executable, "-m", "rtbench", "corpus", "--out", str(file), "--format", "json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return file, done


def test_the_file_loads_without_pickle_and_has_the_arrays_of_the_format(written):
    arrays = np.load(written[0], allow_pickle=False)
    n = len(arrays["v0"])
    for name in ("v0", "v1", "v2", "org", "dir"):
        assert (arrays[name].shape, arrays[name].dtype) == ((n, 3), np.float64)
    for names, dtype in (
        ("difficulty t u v eta cond_t cond_u cond_v", np.float64),
        ("family", np.int16),
        ("cls expect sos_hit", np.int8),
        ("group", np.int32),
        ("f32_ok", bool),
    ):
        for name in names.split():
            assert (arrays[name].shape, arrays[name].dtype) == ((n,), dtype)
    assert len(arrays["group_rule"]) == len(arrays["family_names"])
    assert arrays["class_names"].tolist() == list(CLASS_NAMES)


def test_the_table_counts_what_is_in_the_file(written):
    file, done = written
    cases = Cases.load(file)
    rows = json.loads(done.stdout)
    assert [row["family"] for row in rows] == list(cases.family_names)
    for number, row in enumerate(rows):
        own = cases.take(cases.family == number)
        assert row["cases"] == len(own) and row["float32"] == own.f32_ok.sum()
        assert row["groups"] == len(set(own.group) - {-1})
        for k, name in enumerate(CLASS_NAMES):
            assert row[name] == (own.cls == k).sum()
    assert done.stderr.splitlines()[-1] == f"rtbench: written to {file}"


def test_a_seed_decides_what_is_written_and_every_format_is_printed(rtbench, written):
    first = Cases.load(written[0])
    told = rtbench("corpus", "--out", "a.npz", "--quiet")
    assert told.code == 0 and "control_random" in told.out and "version 1, seed 1" in told.out
    np.testing.assert_array_equal(Cases.load("a.npz").triangles, first.triangles)
    np.testing.assert_array_equal(Cases.load("a.npz").eta, first.eta)
    told = rtbench("corpus", "--out", "a.npz", "--seed", 2, "--force", "-q", "--format", "csv")
    assert told.code == 0 and len(list(csv.DictReader(io.StringIO(told.out)))) == 40
    assert (Cases.load("a.npz").org[:100] != first.org[:100]).any()


def refused(ended):
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.startswith("rtbench: ") and ended.err.count("\n") == 1
    return ended.err


def test_what_cannot_be_written_is_refused_in_one_line(rtbench, tmp_path):
    file = tmp_path / "mine.npz"
    file.write_text("mine")
    assert "--force" in refused(rtbench("corpus", "--out", file))
    assert file.read_text() == "mine"
    assert "nowhere" in refused(rtbench("corpus", "--out", tmp_path / "nowhere" / "a.npz"))
    assert "it is a folder" in refused(rtbench("corpus", "--out", tmp_path))
    assert "seed -1 is not allowed" in refused(rtbench("corpus", "--out", "a.npz", "--seed", -1))
    assert "--out" in refused(rtbench("corpus"))
