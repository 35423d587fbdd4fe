import pytest

from rtbench.report import plots


@pytest.mark.parametrize(
    ("experiment", "names"),
    [
        ("density", ["density", "drift"]),
        ("outcomes", ["outcomes", "drift"]),
        ("operations", []),
        ("stages", ["stages", "drift"]),
        ("prediction", ["density", "penalty", "drift"]),
        ("working_set", ["working_set", "drift"]),
        ("latency", ["latency", "drift"]),
        ("soup", ["soup", "drift"]),
        ("break_even", ["break_even_map", "break_even", "drift"]),
        ("compilers", ["compilers", "drift"]),
        ("packets", ["packets", "spread", "packing", "drift"]),
        ("trees", ["build_and_trace", "pays", "tree_peers", "expected", "drift"]),
        ("tree_builders", ["builders"]),
    ],
)
def test_which_charts_an_experiment_has(make, experiment, names):
    assert list(plots.figures(make(experiment, processes=2, rounds=2))) == names


def test_published_tables_are_charts_of_their_own(published):
    assert list(plots.figures(published("blecha-pc1"))) == [
        "density-4.2",
        "density-4.3",
        "density-4.10",
        "outcomes",
    ]


def test_default_is_png_and_svg_in_the_run_s_folder(make):
    run = make("density", processes=2, rounds=2)
    written = plots.write(run)
    assert {path.parent for path in written} == {run.path / "plots"}
    assert sorted(path.suffix for path in written) == [".png", ".png", ".svg", ".svg"]
    assert sorted(written) == sorted((run.path / "plots").iterdir())


def test_a_run_without_samples_has_nothing_to_plot(make):
    run = make("density", rounds=0)
    assert plots.write(run) == []
    assert not (run.path / "plots").exists()


def test_one_sample_a_cell_shows_no_drift(make):
    assert list(plots.figures(make("density", processes=1, rounds=1))) == ["density"]
