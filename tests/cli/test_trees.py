"""rtbench trees: a model's table and its files; bad input in one line, and nothing half-written."""

import csv
import io
import json
import shlex
import struct

import pytest

from rtbench.cli import trees
from rtbench.workloads.meshes import MODELS

SMALL = ("--width", 32, "--height", 24, "--ending", "both", "--processes", 1, "--samples", 1)
HEAD = """ply
format ascii 1.0
element vertex {vertices}
property float x
property float y
property float z
element face {faces}
property list uchar int vertex_indices
end_header
"""
CORNERS = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
FACES = "3 0 1 2\n3 0 1 3\n3 0 2 3\n3 1 2 3\n"


def ply(corners=CORNERS, faces=FACES):
    count = {"vertices": corners.count("\n"), "faces": faces.count("\n")}
    return HEAD.format(**count) + corners + faces


@pytest.fixture(autouse=True)
def no_models(monkeypatch):
    monkeypatch.delenv(MODELS, raising=False)


def refused(told):
    assert (told.code, told.out) == (2, ""), told
    assert told.err.startswith("rtbench: ") and told.err.count("\n") == 1, told.err
    return told.err


def test_a_model_is_built_traced_and_told(rtbench, tmp_path):
    told = rtbench(
        "trees", "scanned:1000", *SMALL, "--rule", "sah", "--rule", "spatial_median", "--rays", 300
    )
    assert told.code == 0, told.err
    assert told.out.startswith("scanned:1000, ")
    assert "triangles: what each rule builds" in told.out.splitlines()[0]
    assert "SAH, both" in told.out and "spatial median, both" in told.out
    assert "object median, both" not in told.out
    folder = tmp_path / "here" / told.out.rpartition("Records, tables and plots: ")[2].strip()
    assert {path.name for path in (folder / "plots").glob("*.png")} >= {
        "build_and_trace.png",
        "pays.png",
        "heat-scanned-1000.png",
    }
    with (folder / "tables" / "tree-times-scanned-1000.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["rays"] for row in rows} == {"primary", "shadow", "random"}
    assert [r["rule"] for r in rows if r["rays"] == "random"] == ["sah", "spatial_median"]
    assert all(float(row["ns_per_ray"]) > 0 for row in rows)
    with (folder / "samples.csv").open(encoding="utf-8") as file:
        samples = [row for row in csv.DictReader(file) if row["rays"] == "random"]
    passes = {int(row["tests"]) / int(row["repetitions"]) for row in samples}
    assert passes == {300.0}
    again = rtbench("table", folder.name)
    assert again.code == 0 and "SAH, both" in again.out


def test_what_cannot_be_hit_and_what_is_dropped_is_said_on_stderr(rtbench, tmp_path):
    file = tmp_path / "tiny.ply"
    corners = CORNERS.replace("1", "0.0001") + "nan 0 0\n"
    file.write_text(ply(corners, FACES + "3 0 1 4\n"))
    quiet = rtbench(
        *("trees", file, *SMALL, "--rule", "sah", "--kernel", "moller1", "--drop-invalid"),
        *("--quiet", "--format", "json"),
    )
    assert quiet.code == 0, quiet.err
    lines = quiet.err.splitlines()
    assert len(lines) == 2 and all(line.startswith("rtbench: ") for line in lines), lines
    assert "4 of 4 triangles (100 %) are too small ever to be hit" in lines[0]
    assert "1 of 5 triangles dropped" in lines[1]
    found = json.loads(quiet.out)
    assert set(found) == {"run", "path", "tables"}
    assert found["tables"]["trees-tiny"][0]["triangles"] == 4


def test_csv_is_the_table_of_times(rtbench):
    told = rtbench("trees", "even:1000", *SMALL, "--rule", "sah", "--format", "csv")
    rows = list(csv.DictReader(io.StringIO(told.out)))
    assert (rows[0]["rays"], rows[0]["structure"]) == ("primary", "kd")
    assert {row["structure"] for row in rows} == {"kd", "none"}


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("absent.ply", None, "'absent.ply' cannot be read: no such file"),
        ("empty.ply", b"", "is empty"),
        ("words.ply", b"once upon a time\n", "damaged or no ply file"),
        ("words.txt", b"once upon a time\n", "unknown mesh format 'txt'"),
        ("cut.ply", ply().encode()[:-20], "cut off"),
        ("cut.stl", b"\0" * 80 + struct.pack("<I", 9) + b"\0" * 60, "cut.stl'"),
        ("none.ply", ply(faces="").encode(), "has no triangles"),
        ("nan.ply", ply(CORNERS.replace("1 0 0", "nan 0 0")).encode(), "1 of 4 vertices are not"),
        ("inf.ply", ply(CORNERS.replace("1 0 0", "inf 0 0")).encode(), "--drop-invalid leaves"),
        ("beyond.ply", ply(faces=FACES.replace("1 2 3", "1 2 7")).encode(), "the first vertex 7"),
        ("below.ply", ply(faces=FACES.replace("1 2 3", "1 2 -7")).encode(), "the first vertex -7"),
        ("vast.ply", ply(CORNERS.replace("1 0 0", "1e300 0 0")).encode(), "vast.ply'"),
    ],
)
def test_bad_files_are_refused_and_nothing_is_written(rtbench, tmp_path, name, content, said):
    here = tmp_path / "here"
    if content is not None:
        (here / name).write_bytes(content)
    before = sorted(here.rglob("*"))
    assert said in refused(rtbench("trees", name, *SMALL, "--quiet"))
    assert sorted(here.rglob("*")) == before


def test_where_nothing_is_left_nothing_is_measured(rtbench, tmp_path):
    file = tmp_path / "here" / "gone.ply"
    file.write_text(ply(CORNERS.replace("0 0 0", "nan nan nan"), "3 0 1 2\n3 0 1 3\n"))
    said = refused(rtbench("trees", file, "--drop-invalid", *SMALL))
    assert "2 of 2 triangles dropped" in said and said.endswith("none is left\n")
    assert [path.name for path in (tmp_path / "here").iterdir()] == ["gone.ply"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("scaned",), "unknown model 'scaned'; did you mean 'scanned'?"),
        (("scanned:many",), "'many' is no number of triangles"),
        (("scanned:10",), "of 10 triangles is not to be had"),
        (("even", "--rule", "sha"), "unknown rule 'sha'; did you mean 'sah'?"),
        (("even", "--structure", "octree"), "unknown structure 'octree'"),
        (("even", "--builder", "nlog"), "unknown builder 'nlog'; did you mean 'nlogn'?"),
        (("even", "--ending", "never"), "unknown ending 'never'"),
        (("even", "--kernel", "moler1"), "unknown kernel 'moler1'; did you mean 'moller1'?"),
        (("even", "--precision", "float16"), "unknown precision 'float16'"),
        (("even", "--way", "stak"), "unknown way 'stak'; did you mean 'stack'?"),
        (("even", "--rays", "-1"), "rays -1 is not allowed (allowed: 0 or more)"),
        (("even", "--width", "0"), "width 0 is not allowed"),
        (("even", "--threads", "0"), "threads 0 is not allowed"),
        (("even", "--triangles", "3"), "of 3 triangles is not to be had"),
        ((), "Missing argument 'MODEL'"),
    ],
)
def test_what_is_not_there_is_named(rtbench, tmp_path, arguments, said):
    assert said in refused(rtbench("trees", *arguments))
    assert list((tmp_path / "here").iterdir()) == []


def test_examples_ask_for_what_there_is(rtbench, monkeypatch):
    """As typed, but for the measuring: the config that would be run is whole and has its model."""
    from rtbench.errors import RtbenchError
    from rtbench.experiments import run

    asked = []

    def start(config, *others):
        asked.append(config)
        raise RtbenchError("enough")

    monkeypatch.setattr(run, "start", start)
    lines = [line.strip() for line in trees.EXAMPLES.splitlines() if "rtbench" in line]
    for line in lines:
        assert rtbench(*shlex.split(line)[1:]).err.endswith("rtbench: enough\n")
    assert [config.models for config in asked] == [
        ("scanned:20000",),
        ("robots:20000",),
        ("even:20000",),
    ]
    assert asked[1].structures == ("kd", "bvh") and set(asked[1].ways) == {"stack", "wide"}
    assert asked[2].precisions == ("float64",) and asked[2].endings == ("both",)
