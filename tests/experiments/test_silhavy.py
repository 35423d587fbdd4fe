"""Šilhavý's statements, judged on runs whose numbers are made up so that the verdict is known."""

import itertools
import math

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.experiments import config, reproduce, silhavy
from rtbench.experiments.silhavy_overlap import count, leaf_cells
from rtbench.records import schema, tabular
from rtbench.records.store import load_run
from rtbench.records.writer import RunWriter

CELL = ["kernel", "precision", "model", "structure", "rule", "builder", "ending", "way", "rays"]
FORM = {"kernel": "moller_trumbore", "precision": "float32"}
SAH = {"structure": "kd", "rule": "sah", "builder": "nlogn", "ending": "both"}
OBJECT = SAH | {"rule": "object_median", "builder": "object_median"}
SPATIAL = SAH | {"rule": "spatial_median", "builder": "spatial_median"}
LONGEST = SAH | {"builder": "nlogn longest"}
HALF = SAH | {"builder": "nlogn longest half"}
NAIVE = {"structure": "none", "rule": "", "builder": "", "ending": ""}
THREE = ("scanned", "bunny", "robots")


@pytest.fixture
def make(tmp_path):
    """Return a function that writes a run of trees: of each cell (model, tree, ns, facts)."""
    numbers = itertools.count()

    def write(cells, triangles=None, spread=0.002, processes=3, rays=("primary",), **more):
        random = np.random.default_rng(7)
        models = list(dict.fromkeys(model for model, *_ in cells))
        sizes = dict.fromkeys(models, 50_000) | (triangles or {})
        told = {"models": models, "kernels": ["moller_trumbore"], "builders": ["nlogn"]}
        info = {"experiment": "trees", "cell": CELL, "config": told} | more
        trees, visits = [], []
        name = f"trees{next(numbers)}"
        with RunWriter.create(tmp_path, "x", name, info, schema.sample_columns(CELL)) as writer:
            for process, turn in itertools.product(range(processes), range(3)):
                rows = []
                for (model, tree, ns, facts), which in itertools.product(cells, rays):
                    way = "brute_force" if tree is NAIVE else facts.get("way", "stack")
                    took = round(ns * 1e5 * math.exp(random.normal(0, spread)))
                    rows.append(
                        FORM
                        | tree
                        | {"model": model, "way": way, "rays": which, "process": process}
                        | {"launch": 0, "round": turn, "position": 0, "repetitions": 1}
                        | {"triangles": sizes[model], "tests": 10**5, "ns": took, "cpu_ns": took}
                    )
                writer.append(rows)
            for model, tree, _, facts in cells:
                if tree is NAIVE:
                    continue
                row = tree | {"model": model, "triangles": sizes[model], "overlap": "clipped"}
                row |= {"axes": "longest" if "longest" in tree["builder"] else "all"}
                row |= {"candidates": "half" if "half" in tree["builder"] else "all", "block": 1}
                row |= {"build_seconds": 1.0, "leaves": 1000, "empty_leaves": 0, "nodes": 1999}
                row |= {name: value for name, value in facts.items() if name != "way"}
                row = {name: row[name] for name in schema.TREE_COLUMNS if name in row}
                trees += [row | {"process": process} for process in range(processes)]
                seen = FORM | tree | {"model": model, "block": 1, "rays_counted": 9}
                seen |= {"steps": 1.0, "leaves": 1.0, "leaf_tests": facts.get("tests", 1.0)}
                visits += [seen | {"rays": which} for which in rays]
            for table, rows in ((schema.TREES, trees), (schema.VISITS, visits)):
                tabular.write(writer.path / table, tabular.frame(rows, schema.TABLES[table]))
            writer.finish()
        return load_run(writer.path)

    return write


@pytest.fixture
def builders(tmp_path):
    """Return a function that writes a run of builders: seconds of N by builder."""

    def write(seconds, sizes=(1000, 3000, 10_000, 30_000), spread=0.002, processes=3):
        random = np.random.default_rng(5)
        told = {"axes": ["all"], "candidates": ["all"], "overlaps": ["clipped"]}
        info = {"experiment": "tree_builders", "cell": ["builder"], "config": told}
        rows = []
        for builder, of_n in seconds.items():
            own = {"builder": builder, "rule": "sah", "axes": "all", "candidates": "all"}
            if "median" in builder:
                own |= {"rule": builder, "axes": "longest", "candidates": ""}
            for size, process, _ in itertools.product(sizes, range(processes), range(2)):
                took = of_n(size) * math.exp(random.normal(0, spread))
                row = own | {"overlap": "clipped", "model": "scanned", "triangles": size}
                row |= {"process": process, "seconds": took, "cpu_seconds": took}
                # A variant, which must not be mixed in.
                other = row | {"overlap": "box", "cpu_seconds": 100 * took}
                rows += [row, other]
        columns = schema.sample_columns(["builder"])
        with RunWriter.create(tmp_path, "x", "builders", info, columns) as writer:
            table = tabular.frame(rows, schema.TABLES[schema.BUILDS])
            tabular.write(writer.path / schema.BUILDS, table)
            writer.finish()
        return load_run(writer.path)

    return write


def verdict(runs, words, **more):
    (row,) = (row for row in silhavy.judged(runs, **more) if words in row["statement"])
    return row["verdict"], row["number"]


def rules(ratios, models=THREE):
    """Return cells in which (object, spatial) medians take so many times as long as the SAH."""
    return [
        (model, tree, 1000.0 * factor, {})
        for model, (one, other) in zip(models, ratios, strict=True)
        for tree, factor in ((SAH, 1.0), (OBJECT, one), (SPATIAL, other))
    ]


@pytest.mark.parametrize(
    ("ratios", "expected"),
    [
        (((1.8, 2.0), (1.9, 2.1), (2.0, 2.2)), "confirmed"),
        (((4.0, 4.2), (4.1, 4.3), (3.9, 4.0)), "refuted"),
        (((1.0, 1.0), (1.05, 1.0), (1.0, 1.02)), "refuted"),
        (((1.1, 1.2), (2.0, 2.1), (5.0, 6.0)), "not resolved"),  # it depends on the model
    ],
)
def test_about_twice(make, ratios, expected):
    assert verdict({"5": make(rules(ratios))}, "almost twice")[0] == expected


@pytest.mark.parametrize(
    ("ratios", "spread", "expected"),
    [
        (((1.5, 2.0), (1.2, 2.1), (2.0, 1.3)), 0.002, "confirmed"),
        (((1.5, 2.0), (1.2, 2.1), (2.0, 0.8)), 0.002, "refuted"),
        (((1.5, 2.0), (1.02, 2.1), (2.0, 1.3)), 0.1, "not resolved"),
    ],
)
def test_ahead_in_every_scene(make, ratios, spread, expected):
    run = make(rules(ratios), spread=spread)
    assert verdict({"5": run}, "in every scene")[0] == expected


@pytest.mark.parametrize(
    ("ratios", "expected"),
    [
        (((1.2, 2.0), (1.2, 2.1), (1.0, 1.8)), "confirmed"),
        (((2.0, 1.2), (2.1, 1.2), (1.8, 1.0)), "refuted"),
        (((2.0, 1.0), (1.2, 2.1), (1.5, 1.5)), "not resolved"),
    ],
)
def test_object_median_second(make, ratios, expected):
    assert verdict({"5": make(rules(ratios))}, "faster than through spatial")[0] == expected


def test_the_ending_that_serves_a_rule_best_counts(make):
    cells = rules(((9.0, 9.0),), ("bunny",))
    better = [("bunny", tree | {"ending": "ad_hoc"}, 2000.0, {}) for tree in (OBJECT, SPATIAL)]
    assert verdict({"5": make(cells + better)}, "almost twice")[0] == "confirmed"


def test_one_process_resolves_nothing_of_a_single_model(make):
    run = make(rules(((2.0, 2.0),), ("bunny",)), processes=1)
    assert verdict({"5": run}, "almost twice")[0] == "not resolved"
    assert verdict({"5": run}, "in every scene")[0] == "not resolved"


@pytest.mark.parametrize(
    ("times", "triangles", "expected"),
    [(500, 50_000, "confirmed"), (20, 50_000, "refuted"), (500, 2_000, "not resolved")],
)
def test_hundreds_of_times(make, times, triangles, expected):
    cells = rules(((2.0, 2.0),) * 3)
    cells += [(model, NAIVE, 1000.0 * times, {}) for model in THREE]
    run = make(cells, triangles=dict.fromkeys(THREE, triangles))
    assert verdict({"5": run}, "several hundred times")[0] == expected


@pytest.mark.parametrize(
    ("model", "times", "spread", "expected"),
    [
        ("even", 3000, 0.002, "confirmed"),
        ("even", 300, 0.002, "refuted"),
        ("even", 1000, 0.3, "not resolved"),
        ("bunny", 3000, 0.002, "confirmed"),
        ("robots", 3000, 0.002, "not resolved"),  # which are not spread evenly
    ],
)
def test_a_thousand_times(make, model, times, spread, expected):
    cells = [(model, SAH, 1000.0, {}), (model, NAIVE, 1000.0 * times, {})]
    run = make(cells, spread=spread)
    assert verdict({"5": run}, "up to a thousand times")[0] == expected


@pytest.mark.parametrize(
    ("lost", "expected"),
    [
        ((1.0, 1.01, 0.99), "confirmed"),
        ((1.3, 1.2, 1.4), "refuted"),
        ((1.0, 1.2, 1.0), "not resolved"),
    ],
)
@pytest.mark.parametrize(
    ("before", "after", "words"), [(SAH, LONGEST, "6 N"), (LONGEST, HALF, "2 N to N")]
)
def test_fewer_candidates(make, lost, expected, before, after, words):
    cells = []
    for model, factor in zip(THREE, lost, strict=True):
        cells += [(model, SAH | {"ending": "automatic"}, 900.0, {})]  # has no variants
        cells += [(model, before, 1000.0, {"build_seconds": 3.0})]
        cells += [(model, after, 1000.0 * factor, {"build_seconds": 1.5})]
    found = verdict({"5": make(cells)}, words)
    assert found[0] == expected and "building is 2.00 [2.00, 2.00] times as fast" in found[1]


@pytest.mark.parametrize(
    ("spatial", "spread", "expected"),
    [
        (0.9, 0.002, "confirmed"),
        (1.2, 0.002, "refuted"),
        (0.5, 0.002, "refuted"),  # twice as fast is not slightly better
        (0.98, 0.1, "not resolved"),
    ],
)
def test_even_scenes(make, spatial, spread, expected):
    cells = rules(((1.0, spatial), (1.5, 2.0)), ("even", "bunny"))
    assert verdict({"5": make(cells, spread=spread)}, "slightly better")[0] == expected


@pytest.mark.parametrize(
    ("uneven", "others", "expected"),
    [
        ((5.0, 6.0, 5.5), (1.1, 1.2), "confirmed"),
        ((1.1, 1.2, 1.1), (5.0, 5.1), "refuted"),
        ((1.0, 9.0, 2.0), (1.5, 2.5), "not resolved"),
    ],
)
def test_uneven_scenes(make, uneven, others, expected):
    models = ("robots", "sponza", "teapot_in_stadium", "bunny", "scanned")
    run = make(rules([(1.0, each) for each in (*uneven, *others)], models))
    assert verdict({"5": run}, "falls far behind")[0] == expected


@pytest.mark.parametrize(
    ("empty", "expected"),
    [((0, 3, 10), "confirmed"), ((300, 250, 280), "refuted"), ((0, 20, 200), "not resolved")],
)
def test_empty_leaves(make, empty, expected):
    cells = [
        (model, OBJECT, 1.0, {"empty_leaves": number})
        for model, number in zip(THREE, empty, strict=True)
    ]
    assert verdict({"5": make(cells)}, "almost no empty")[0] == expected


@pytest.mark.parametrize(("factor", "expected"), [(1000.0, "confirmed"), (3.0, "refuted")])
def test_a_thousandth_is_tested(make, factor, expected):
    cells = [
        (model, tree, 1.0, {"tests": tests})
        for model in THREE
        for tree, tests in ((SAH, 2.0), (OBJECT, 2 * factor), (SPATIAL, 2 * factor))
    ]
    found = verdict({"5": make(cells)}, "a thousandth")
    assert found[0] == expected and f"bunny {factor:.1f}" in found[1]
    assert "bunny 25000" in found[1]  # of 50,000 triangles


@pytest.mark.parametrize(
    ("sign", "expected"),
    [((1, 1, 1), "confirmed"), ((-1, -1, -1), "refuted"), ((1, -1, 1), "not resolved")],
)
def test_the_cost_tells_the_time(make, sign, expected):
    kinds = (SAH, LONGEST, HALF, OBJECT, SPATIAL)
    cells = [
        (model, tree, 100.0 * (place + 1), {"sah_cost": 50 + which * place})
        for model, which in zip(THREE, sign, strict=True)
        for place, tree in enumerate(kinds)
    ]
    assert verdict({"5": make(cells)}, "tells its time")[0] == expected


def test_a_node_that_is_not_built_is_not_judged(make):
    assert verdict({"5": make(rules(((2.0, 2.0),), ("bunny",)))}, "8 bytes") == (
        "not resolved",
        "not measured: there is no fat node in rtbench, only that of 8 bytes",
    )


@pytest.mark.parametrize(("slower", "expected"), [(1.3, "confirmed"), (1.0, "refuted")])
def test_a_node_that_is_built_is_judged(make, slower, expected):
    cells = rules(((2.0, 2.0),) * 3)
    cells += [(model, SAH, 1000.0 * slower, {"way": "fat"}) for model in THREE]
    assert verdict({"5": make(cells)}, "8 bytes")[0] == expected


@pytest.mark.parametrize(
    ("needless", "expected"),
    [((13, 14, 15), "confirmed"), ((30, 35, 40), "refuted"), ((2, 14, 40), "not resolved")],
)
def test_what_the_three_stages_let_in(make, needless, expected):
    overlaps = [
        {"model": model, "rule": rule}
        | {"passed": dict.fromkeys(("three_stage_world", "three_stage", "box"), 100)}
        | {"needless": {"three_stage_world": n, "three_stage": n + 1, "box": n + 20}}
        for model, n in zip(THREE, needless, strict=True)
        for rule in ("sah", "object_median", "spatial_median")
    ]
    run = make(rules(((2.0, 2.0),), ("bunny",)))
    assert verdict({"5": run}, "14 %", overlaps=overlaps)[0] == expected


def sizes(nodes, naive, tree):
    """Return cells of a family in five sizes, and these: numbers of N."""
    of = {f"scanned:{n}": n for n in (1000, 3000, 10_000, 30_000, 100_000)}
    cells = []
    for model, n in of.items():
        cells += [(model, SAH, tree(n), {"nodes": round(nodes(n))}), (model, NAIVE, naive(n), {})]
    return cells, of


@pytest.mark.parametrize(
    ("power", "expected"), [(1.03, "confirmed"), (1.5, "refuted"), (1.101, "not resolved")]
)
def test_cells_are_almost_linear(make, power, expected):
    # A little off the line, as counts are.
    cells, of = sizes(lambda n: n**power * (1 + 0.05 * math.sin(n)), lambda n: n, lambda n: 100.0)
    assert verdict({"sizes": make(cells, of)}, "almost linear")[0] == expected


@pytest.mark.parametrize(
    ("naive", "tree", "expected"),
    [
        (lambda n: 2.0 * n, lambda n: 50 * math.log(n), "confirmed"),
        (lambda n: 2.0 * n, lambda n: 0.5 * n, "refuted"),
        (lambda n: n**0.5, lambda n: 100.0, "refuted"),
    ],
)
def test_the_naive_way_grows_and_trees_do_not(make, naive, tree, expected):
    cells, of = sizes(lambda n: n, naive, tree)
    assert verdict({"sizes": make(cells, of)}, "proportional")[0] == expected


@pytest.mark.parametrize(
    ("nlogn", "spread", "expected"),
    [
        (lambda n: 1e-7 * n * math.log(n), 0.002, "confirmed"),
        (lambda n: 1e-7 * n**1.5, 0.002, "refuted"),
        (lambda n: 1e-7 * n**1.15 * (1.5 if n in (3000, 30_000) else 1), 0.002, "not resolved"),
    ],
)
def test_n_log_n(builders, nlogn, spread, expected):
    run = builders({"nlogn": nlogn}, spread=spread)
    assert verdict({"builders": run}, "built in O(N log N)")[0] == expected


@pytest.mark.parametrize(("power", "expected"), [(1.9, "confirmed"), (1.1, "refuted")])
@pytest.mark.parametrize("count_", [3, 4])  # too few sizes for a line, and enough
def test_quadratic(builders, power, expected, count_):
    run = builders(
        {"nlogn": lambda n: 1e-6 * n, "n2": lambda n: 1e-8 * n**power},
        sizes=(1000, 3000, 10_000, 30_000)[:count_],
    )
    assert verdict({"builders": run}, "O(N^2)")[0] == expected


@pytest.mark.parametrize(
    ("nlog2n", "expected"),
    [
        (lambda n: 2e-7 * n * math.log(n), "confirmed"),
        (lambda n: 0.5e-6 * n, "refuted"),
        (lambda n: 3e-6 * n, "not resolved"),  # slower, by a factor that does not grow
    ],
)
def test_sorted_once(builders, nlog2n, expected):
    run = builders({"nlogn": lambda n: 1e-6 * n, "nlog2n": nlog2n}, spread=0.01)
    assert verdict({"builders": run}, "sorted once")[0] == expected


@pytest.mark.parametrize(
    ("spatial", "spread", "expected"),
    [(1.0, 0.01, "confirmed"), (3.0, 0.01, "refuted"), (1.95, 0.2, "not resolved")],
)
def test_the_fastest_build(builders, spatial, spread, expected):
    run = builders(
        {
            "nlogn": lambda n: 5e-6 * n,
            "object_median": lambda n: 2e-6 * n,
            "spatial_median": lambda n: spatial * 1e-6 * n,
        },
        spread=spread,
    )
    assert verdict({"builders": run}, "fastest to build")[0] == expected


@pytest.mark.parametrize(
    ("empty", "spread", "expected"),
    [(1.5, 0.002, "confirmed"), (0.1, 0.002, "refuted"), (0.5, 0.2, "not resolved")],
)
def test_the_share_of_tests(tmp_path, empty, spread, expected):
    random = np.random.default_rng(3)
    cell = ["kernel", "precision", "order", "density", "triangles"]
    scenes = [{"rays": 10, "triangles": n, "pairs": 10 * n} for n in (100, 1000)]
    info = {"experiment": "naive", "cell": cell, "scenes": scenes}
    info |= {"config": {"precisions": ["float32"]}}
    with RunWriter.create(tmp_path, "x", "n", info, schema.sample_columns(cell)) as writer:
        for process, turn in itertools.product(range(3), range(3)):
            row = {"precision": "float32", "order": "sweep", "process": process, "launch": 0}
            row |= {"round": turn, "position": 0, "repetitions": 1, "tests": 10**6, "ns": 1}
            writer.append(
                [
                    row
                    | {"kernel": kernel, "triangles": scene["pairs"]}
                    | {"cpu_ns": round(ns * 1e6 * math.exp(random.normal(0, spread)))}
                    for scene in scenes
                    for kernel, ns in (("empty", empty), ("moller_trumbore", 10.0))
                ]
            )
        writer.finish()
    run = load_run(writer.path)
    found = verdict({"naive": run}, "75 %")
    assert found[0] == expected and "100 triangles" in found[1]


def test_the_naive_way_is_timed_beside_a_loop_without_tests(go, monkeypatch):
    monkeypatch.setattr(config, "EXPERIMENTS", (*config.EXPERIMENTS, "naive"))
    done = go(
        *(config.Config(name="n", experiment="naive", kernels=("moller_trumbore",)),),
        **{"sizes": (100, 1000), "width": 8, "height": 8, "repetitions": 2},
        **{"processes": 1, "samples": 1, "layout": "shared"},
    )
    assert {row["kernel"] for row in done.summary.to_dict("records")} == {
        "empty",
        "moller_trumbore",
    }
    assert [scene["rays"] for scene in done.info["scenes"]] == [64, 64]
    # As many tests of either size, and the same of a kernel and of none.
    assert done.summary["tests"].max() <= 1.1 * done.summary["tests"].min()
    assert verdict({"naive": done}, "75 %")[1].startswith("moller_trumbore: 100 triangles")


def test_leaves_fill_the_box_and_hold_what_meets_them():
    from rtbench.trees import leaves, ways
    from rtbench.trees.building import build
    from rtbench.trees.geometry import Geometry

    random = np.random.default_rng(1)
    triangles = random.random((300, 1, 3)) + 0.1 * random.random((300, 3, 3))
    geometry = Geometry.of(triangles.astype(np.float32), "float32")
    tree = build(geometry, ways.options(leaves.ONE_BY_ONE, overlap="box", rule="object_median"))
    cells, begin, held = leaf_cells(tree)
    sides = cells[:, 3:].astype(float) - cells[:, :3]
    whole = np.prod(geometry.box[3:].astype(float) - geometry.box[:3])
    assert len(cells) > 50 and np.prod(sides, axis=1).sum() == pytest.approx(whole, rel=1e-5)
    assert sorted(zip(begin.tolist(), held.tolist(), strict=True)) == sorted(
        zip(*(part.tolist() for part in tree.leaves), strict=True)
    )
    for cell, first, number in zip(cells, begin, held, strict=True):
        boxes = geometry.boxes[tree.refs[first : first + number]]
        assert (boxes[:, :3] <= cell[3:]).all() and (boxes[:, 3:] >= cell[:3]).all()


@pytest.mark.full  # compiles every overlap test and three builders
def test_what_is_let_in_is_counted_of_models_that_are_there(make):
    models = [{"model": "even", "triangles": 1000, "source": "generated"}]
    models += [{"model": "gone", "triangles": 1000, "source": "file"}]
    run = make(rules(((2.0, 2.0),), ("even",)), models=models)
    run.info["config"]["triangles"] = 1000
    told = []
    found = count(run, told.append)
    assert [one["rule"] for one in found] == ["sah", "object_median", "spatial_median"]
    assert told[-1] == 1.0
    for one in found:
        few, more, most = (
            one["needless"][name] for name in ("separating_axes", "three_stage_world", "box")
        )
        assert 0 <= few <= more <= most < one["passed"]["box"]
        assert (
            one["passed"]["box"] - most
            == one["passed"]["three_stage"] - (one["needless"]["three_stage"])
        )  # what touches is let in by either


def test_every_statement_says_where_it_stands():
    assert all("(p. " in one.text for one in silhavy.STATEMENTS)
    assert len({one.text for one in silhavy.STATEMENTS}) == len(silhavy.STATEMENTS)


def test_the_configs_of_the_thesis():
    whole = reproduce.configs("silhavy")
    assert whole[0].name == "silhavy-5"
    assert {"silhavy-builders", "silhavy-sizes"} <= {each.name for each in whole}
    assert reproduce.configs("silhavy-5") == reproduce.configs("5") == whole[:1]
    with pytest.raises(RtbenchError, match=r"table .silhavi.*silhavy"):
        reproduce.configs("silhavi")
