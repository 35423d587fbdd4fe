"""Build times over the number of triangles: what is built, compared and kept."""

import dataclasses

import numpy as np
import pytest

from rtbench.errors import RtbenchError, WrongAnswers
from rtbench.experiments import tree_builders
from rtbench.experiments.config import Config
from rtbench.experiments.tree_builders import Task, morton_order, tasks
from rtbench.records import schema, tabular

SMALL = Config(
    experiment="tree_builders",
    models=("scanned",),
    sizes=(1000, 1500),
    builders=("nlog2n", "object_median"),
    axes=("all", "longest"),
    processes=1,
    samples=2,
)


def test_morton_order_is_that_of_interleaved_bits():
    cells = np.array([[x, y, z] for x in range(4) for y in range(4) for z in range(4)])
    shuffled = np.random.default_rng(1).permutation(cells)

    def code(cell):
        bits = [[int(c) >> k & 1 for c in cell] for k in (1, 0)]
        return int("".join(f"{z}{y}{x}" for x, y, z in bits), 2)

    assert shuffled[morton_order(shuffled.astype(float))].tolist() == sorted(
        cells.tolist(), key=code
    )


def test_all_builders_and_variants_of_one():
    config = SMALL.changed(
        builders=("n2", "nlogn", "binned", "bvh"), candidates=("all", "half"), overlaps=("box",)
    )
    found = [tuple(task.key.values())[0:5] for task in tasks(config)]
    assert found == [
        ("n2", "sah", "all", "all", "box"),
        ("nlogn", "sah", "all", "all", "box"),
        ("nlogn", "sah", "all", "half", "box"),
        ("nlogn", "sah", "longest", "all", "box"),
        ("nlogn", "sah", "longest", "half", "box"),
        ("binned", "sah", "all", "all", "box"),
        ("bvh", "sah", "", "", ""),
    ]


def test_builds_are_kept(go, table):
    done = go(SMALL)
    rows = table(done, "builds.csv")
    # 2 sizes in 2 rounds: nlog2n along all axes and along the longest, and the median.
    assert len(rows) == 2 * 2 * 3
    assert {row["model"] for row in rows} == {"scanned"}
    for triangles in {row["triangles"] for row in rows}:
        for builder, axes, number in (("nlog2n", "all", 2), ("object_median", "longest", 2)):
            own = [
                row
                for row in rows
                if (row["triangles"], row["builder"], row["axes"]) == (triangles, builder, axes)
            ]
            assert len(own) == number and len({row["digest"] for row in own}) == 1
            # Said once: the others are the same tree.
            assert sum(bool(row["nodes"]) for row in own) == 1
            assert all(float(row["seconds"]) > 0 for row in own)
    assert done.finished and [m["model"] for m in done.info["models"]] == ["scanned", "scanned"]
    read = tabular.read(done.path / schema.BUILDS, schema.BUILD_COLUMNS)
    assert len(read) == len(rows)


def test_exact_builders_that_differ_are_refused(go, monkeypatch):
    """A builder that cuts elsewhere, called exact, is noticed by its digest."""

    whole = tasks(SMALL)[0].options
    other = dataclasses.replace(whole, traversal_cost=20.0)
    lied = [Task("nlog2n", whole), Task("nlogn", other)]
    monkeypatch.setattr(tree_builders, "tasks", lambda config: lied)
    with pytest.raises(WrongAnswers, match="different trees over") as raised:
        go(SMALL)
    assert raised.value.exit_code == 4


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"builders": ("nlogm",)}, "unknown builder 'nlogm'; did you mean 'nlogn'"),
        ({"sizes": (0,)}, "size 0 is not allowed"),
        ({"models": ("scaned",)}, "unknown model 'scaned'; did you mean 'scanned'"),
    ],
)
def test_bad_values_in_one_line(go, changes, words):
    with pytest.raises(RtbenchError, match=words) as raised:
        go(SMALL.changed(**changes))
    assert "\n" not in str(raised.value)
