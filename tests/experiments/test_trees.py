"""The experiment of trees: what it plans, checks, times and keeps."""

import json

import numpy as np
import pytest

from rtbench.accuracy import oracle
from rtbench.errors import RtbenchError, WrongAnswers
from rtbench.experiments import (
    run,
    tree_cells,
    tree_costs,
    tree_exact,
    tree_models,
    tree_rounds,
    tree_scene,
)
from rtbench.experiments.config import Config, find, shipped
from rtbench.experiments.run import Stopped
from rtbench.experiments.tree_session import Share
from rtbench.kernels import registry
from rtbench.measure.arrays import Arrays
from rtbench.records import schema, tabular
from rtbench.records.store import load_run

SMALL = Config(
    name="small",
    experiment="trees",
    kernels=("moller_trumbore",),
    models=("scanned:1000",),
    rules=("sah", "spatial_median"),
    builders=("nlog2n",),
    ray_sets=("primary", "shadow"),
    width=24,
    height=16,
    rays=100,
    naive=8,
    judged=100,
    processes=2,
    samples=2,
)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    from .conftest import Nobody

    return run.start(SMALL, Nobody(), tmp_path_factory.mktemp("trees"), "test")


def test_a_row_a_cell(done):
    summary = done.summary
    named = summary[["structure", "rule", "way", "rays"]].to_dict("split")["data"]
    told = [[value if value == value else None for value in row] for row in named]
    assert sorted(map(str, told)) == sorted(
        map(
            str,
            [
                ["kd", "sah", "stack", "primary"],
                ["kd", "sah", "stack", "shadow"],
                ["kd", "spatial_median", "stack", "primary"],
                ["kd", "spatial_median", "stack", "shadow"],
                ["none", None, "brute_force", "primary"],
            ],
        )
    )
    assert (summary["samples"] == 4).all() and (summary["processes"] == 2).all()
    assert set(summary["model"]) == {"scanned:1000"}
    samples = done.samples
    naive = samples[samples["way"] == "brute_force"]
    assert (naive["tests"] == 8 * naive["repetitions"]).all()
    primary = samples[(samples["way"] == "stack") & (samples["rays"] == "primary")]
    assert (primary["tests"] == 24 * 16 * primary["repetitions"]).all()


def test_builds_are_samples_too(done):
    trees = tabular.read(done.path / schema.TREES, schema.TREE_COLUMNS)
    assert len(trees) == 2 * 2  # trees, processes
    assert (trees.groupby("rule")["digest"].nunique() == 1).all()
    assert (trees["triangles"] == done.info["models"][0]["triangles"]).all()
    assert (trees["build_seconds"] > 0).all() and (trees["nodes"] % 2 == 1).all()


def test_visits_are_those_of_brute_force(done):
    visits = tabular.read(done.path / schema.VISITS, schema.VISIT_COLUMNS)
    counted = visits[visits["rule"].notna()]
    judged = visits[visits["rule"].isna()]
    assert len(counted) == 4 and (counted["rays_counted"] > 0).all()
    assert list(judged["rays_judged"]) == [100, 100] and (judged["wrong"] == 0).all()
    # What is hit is hit in every tree.
    hits = counted.groupby("rays")["hits"].unique()
    assert all(len(each) == 1 for each in hits)
    # A shadow ray starts where a primary ray has hit.
    shadows = done.samples[done.samples["rays"] == "shadow"]
    each = (shadows["tests"] // shadows["repetitions"]).unique().tolist()
    assert each == [int(hits["primary"][0])]


def test_heat_maps_add_up(done):
    visits = tabular.read(done.path / schema.VISITS, schema.VISIT_COLUMNS)
    for rule in ("sah", "spatial_median"):
        image = np.load(done.path / "images" / f"scanned-1000-{rule}.npz")
        assert image["steps"].shape == image["tests"].shape == image["depth"].shape == (16, 24)
        row = visits[(visits["rule"] == rule) & (visits["rays"] == "primary")].iloc[0]
        assert image["steps"].sum() == pytest.approx(row["steps"] * row["rays_counted"])
        assert np.isfinite(image["depth"]).sum() == row["hits"]


def test_facts_of_models(done):
    (model,) = done.info["models"]
    assert model["source"] == "generated" and model["closed"] is True
    assert np.array(model["bounds"]).shape == (2, 3)
    assert model["camera"]["position"] != model["camera"]["target"]


def test_a_run_of_trees_is_not_resumed(go, tmp_path):
    class Impatient:
        def say(self, text):
            if "round 2" in text:
                raise KeyboardInterrupt

        def plan(self, text):
            self.planned = text

        def progress(self, fraction):
            pass

    with pytest.raises(Stopped, match="stopped; what was measured is kept in"):
        go(SMALL, tmp_path / "cut", Impatient())
    (path,) = (tmp_path / "cut").iterdir()
    cut = load_run(path)
    assert not cut.finished and len(cut.samples) == 5 and len(cut.summary) == 5
    with pytest.raises(RtbenchError, match="cannot be resumed: its trees are gone; run it again"):
        run.resume(str(path), Impatient(), tmp_path / "cut")


def test_a_wrong_answer_is_noticed(go, monkeypatch):
    """The tree's answers are those of brute force, or the run ends."""
    asked = tree_rounds.OverModel._must_agree

    def wrong(self, walk, found):
        if walk.key(self.trees)["rule"] == "spatial_median":
            found["differ"] = {"rays": 3, "first": 17}
        asked(self, walk, found)

    monkeypatch.setattr(tree_rounds.OverModel, "_must_agree", wrong)
    with pytest.raises(WrongAnswers, match=r"3 rays over scanned:1000 get other .* ray 17"):
        go(SMALL)


@pytest.fixture
def scene():
    """Return a scene with a tree in which a triangle is missing."""
    config, arrays = SMALL.changed(ray_sets=("primary",)), Arrays()
    try:
        model = tree_models.load("scanned:1000", config, arrays)
        yield tree_scene.Scene(json.loads(json.dumps(model.message)))
    finally:
        arrays.close()


def test_comparing_finds_what_a_damaged_tree_misses(scene):
    from rtbench.trees.building import build
    from rtbench.trees.options import Options

    whole = build(scene.geometry("float32"), Options(builder="nlog2n"))
    nodes = whole.nodes.copy()
    full = np.flatnonzero(whole.is_leaf & (nodes["split"] > 0))
    nodes["split"][full[::2]] = 0  # half of the leaves are empty now
    damaged = type(whole)(nodes, whole.refs, whole.box, whole.depth, whole.options)
    scene.built += [whole, damaged]
    told = {"kernel": "moller_trumbore", "precision": "float32", "way": "stack", "rays": "primary"}
    cells = [scene.cell(**told, tree=tree, threads=1, most=None) for tree in (0, 1)]
    for cell in cells:
        cell.forget()
        cell.trace()
        cell.told = cell.compared()
    assert cells[0].told["differ"] is None
    assert cells[1].told["differ"]["rays"] > 0
    group = "moller_trumbore", "float32", "primary"
    assert scene.judged_by_brute_force(*group, 200)["wrong"] == 0
    # The damaged tree's own answers, put to brute force.
    scene.answers.clear()
    cells[1].forget()
    cells[1].trace()
    assert cells[1].compared()["differ"] is None
    assert scene.judged_by_brute_force(*group, 400)["wrong"] > 0
    assert tree_exact.judge(scene, *group, 100)["exact_wrong"] > 0


def test_exact_truths_are_the_oracles(scene):
    """Boxes leave out no triangle that the oracle says is hit."""
    rows = np.arange(0, 384, 37)
    truths = tree_exact._truths(scene, "primary", rows)
    origins, directions, _ = scene.sets["primary"]
    corners = scene.triangles.astype(np.float64)
    met = 0
    for row in rows.tolist():
        ray = (np.broadcast_to(a[row], (len(corners), 3)) for a in (origins, directions))
        expect = oracle.expectations(corners, *ray)
        assert len(truths[row]) == np.count_nonzero(expect != 0)
        met += len(truths[row])
    assert met > 0


def test_plans_of_ways_and_kernels():
    kernels = registry.select(["moller_trumbore", "watertight_safe"])
    config = SMALL.changed(
        structures=("kd", "bvh"), rules=("sah",), ways=("stack", "blocks", "wide"), naive=4
    )
    built, walks, _ = tree_cells.plan(config, kernels, 1000)
    assert [(tree.structure, tree.options.block) for tree in built] == [
        *(("kd", 1), ("kd", 8), ("bvh", 8))
    ]
    assert len(walks) == 2 * 3 * 2 + 1 and walks[-1].tree is None
    assert {walks[-1].key(built)[name] for name in ("rule", "builder", "ending")} == {""}
    both = config.changed(threads=(1, 2))
    ways = {walk.key(built)["way"] for walk in tree_cells.plan(both, kernels, 1000)[1]}
    assert ways >= {"stack", "stack, 2 threads", "wide, 2 threads"}
    with pytest.raises(RtbenchError, match="ways wide do not go with structures kd"):
        tree_cells.plan(SMALL.changed(ways=("wide",)), kernels, 1000)


def test_only_small_models_get_every_ending_and_variant():
    kernels = registry.select(["moller_trumbore"])
    config = SMALL.changed(
        rules=("sah",), endings=("both", "ad_hoc"), axes=("all", "longest"), large=5000
    )
    small, *_ = tree_cells.plan(config, kernels, 5000)
    assert [(tree.builder, tree.ending) for tree in small] == [
        *(("nlog2n", "both"), ("nlog2n longest", "both"), ("nlog2n", "ad_hoc"))
    ]
    assert [tree.options.max_leaf for tree in small] == [1, 1, config.max_leaf]
    large, *_ = tree_cells.plan(config, kernels, 5001)
    assert [(tree.builder, tree.ending) for tree in large] == [("nlog2n", "both")]


def test_models_that_are_there(tmp_path, monkeypatch):
    monkeypatch.setenv("RTBENCH_MODELS", str(tmp_path))
    (tmp_path / "bunny.ply").write_text("")
    assert tree_models.names(SMALL.changed(models=("even", "bunny?", "dragon?"))) == [
        *("even", "bunny")
    ]
    assert tree_models.names(Config(experiment="trees")) == ["even", "scanned", "robots", "bunny"]
    with pytest.raises(RtbenchError, match="none of the models dragon"):
        tree_models.names(SMALL.changed(models=("dragon?",)))


def test_quick_leaves_out_what_is_large():
    for name in shipped():
        config = find(name)
        if config.experiment == "trees":
            quick = config.quick()
            assert "dragon?" not in quick.models and "scanned:1000000" not in quick.models
            assert quick.processes == 1 and quick.width * 2 == config.width
    assert "scanned:64000" in find("silhavy-sizes").quick().models


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"ways": ("stak",)}, "unknown way 'stak'; did you mean 'stack'"),
        ({"ray_sets": ("shadow",)}, "name primary too"),
        ({"rules": ("sah", "sah")}, "rules names 'sah' twice"),
        ({"peers": ("embre",)}, "unknown peer 'embre'; did you mean 'embree'"),
        ({"width": 0}, "width 0 is not allowed"),
        ({"threads": (0,)}, "threads 0 is not allowed"),
        ({"traversal_cost": -1.0}, "traversal_cost -1.0 is not allowed"),
        ({"costs": "guessed"}, "unknown costs 'guessed'"),
        ({"endings": ("autmatic",)}, "unknown ending 'autmatic'; did you mean 'automatic'"),
    ],
)
def test_bad_values_in_one_line(changes, words):
    with pytest.raises(RtbenchError, match=words) as raised:
        SMALL.changed(**changes)
    assert "\n" not in str(raised.value)


def test_a_share_is_corrected_by_what_was_measured():
    told = []
    share = Share({("a", 0): 1e9, ("b", 0): 1e9}, 2, told.append)
    share.done(("a", 0))
    share.done(("b", 0))
    assert told[0] < 1e-6
    # The second pass will take as long as the first did, not what was expected.
    assert share.seconds < 10
    share.done(("a", 0))
    share.done(("b", 0))
    assert told[-1] == 1.0 and told == sorted(told)


def test_costs_are_the_coefficients_of_the_times():
    steps = np.array([28.0, 22.0, 16.0, 12.0, 22.0])
    tests = np.array([3.0, 9.0, 31.0, 84.0, 49.0])
    found = tree_costs._fitted(steps, tests, 95.0 + 17.5 * steps + 6.5 * tests)
    assert found == pytest.approx((95.0, 17.5, 6.5))
    # What would come out below 0 is nearly nothing: a cost must be above it.
    assert tree_costs._fitted(steps, tests, 500.0 + 7.0 * tests)[1] == pytest.approx(0.01)


def test_costs_reach_the_trees():
    kernels = registry.select(["moller_trumbore"])
    told = {"traversal_cost": 17.5, "intersection_cost": 6.5}
    config = SMALL.changed(**told)
    for found in (
        tree_cells.plan(SMALL, kernels, 1000, told | {"unit": "ns"})[0],
        tree_cells.plan(config, kernels, 1000)[0],
    ):
        assert {(t.options.traversal_cost, t.options.intersection_cost) for t in found} == {
            (17.5, 6.5)
        }
