"""Bounds that were worked out by hand from round peaks, and the plot that shows them."""

import csv
import json
import math
from collections import defaultdict
from statistics import median

import pytest
from matplotlib.container import ErrorbarContainer

from rtbench.errors import RtbenchError
from rtbench.report import cells
from rtbench.report.charts import style
from rtbench.report.charts.roofline import roofline_chart
from rtbench.report.layouts.roofline import roofline_table
from rtbench.report.peaks import Peaks, peaks_table, read_peaks
from rtbench.report.roofline import bounds

# G operations a second; a vector has eight times the scalar's, float64 half of float32's.
SCALAR = {"add": 10.0, "mul": 8.0, "both": 12.0, "div": 1.0, "fma": 16.0}
LEVELS = {"L1": (32 << 10, 400.0), "L2": (1 << 20, 200.0), "memory": (None, 10.0)}
HIT = {"add": 20, "sub": 10, "mul": 30, "div": 2, "cond": 4}
MISS = {"add": 5, "sub": 5, "mul": 10, "div": 0, "cond": 2}
OPERATIONS = {name: {0: HIT, 1: MISS} for name in ("moller1", "badouel", "chirkov")}


def told(**changes):
    rates = []
    for form, lanes in (("scalar", 1), ("vector", 8)):
        for precision, half in (("float32", 1), ("float64", 2)):
            for operation, rate in SCALAR.items():
                one = {"operation": operation, "precision": precision, "form": form}
                one["register_bits"] = 256 if form == "vector" else 0
                rates.append(one | rated(rate * lanes / half))
    levels = [
        {"level": name, "holds_bytes": size, "buffer_bytes": 1024} | rated(rate)
        for name, (size, rate) in LEVELS.items()
    ]
    found = {"machine": {"label": "amd-epyc-9b14", "cpu_model": "AMD EPYC 9B14"}, "rounds": 9}
    return found | {"caches_known": True, "arithmetic": rates, "bandwidth": levels} | changes


def rated(rate):
    return {"per_second": 1e9 * rate, "ci_low": 0.9e9 * rate, "ci_high": 1.25e9 * rate}


@pytest.fixture
def peaks():
    return Peaks(told())


def at(found, **wanted):
    chosen = [one for one in found if wanted.items() <= one.cell.items()]
    assert len(chosen) == 1
    return chosen[0]


def changed(run, change):
    """Change a run's run.json and load it again."""
    from rtbench.records.store import load_run

    record = json.loads((run.path / "run.json").read_text(encoding="utf-8"))
    change(record)
    (run.path / "run.json").write_text(json.dumps(record), encoding="utf-8")
    return load_run(run.path)


def sampled(run):
    """Return the medians of samples.csv by kernel, order and density, without rtbench."""
    times = defaultdict(list)
    with (run.path / "samples.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = row["kernel"], row["order"], float(row["density"])
            times[key].append(int(row["ns"]) / int(row["tests"]))
    return {key: median(values) for key, values in times.items()}


def test_arithmetic_is_that_of_the_outcomes(make, peaks):
    found, left_out = bounds(make("density", triangles=100), peaks, OPERATIONS)
    assert left_out == {}
    # All hit: 60 additions and products at 12 G/s take 5 ns, 2 divisions at 1 G/s take 2.
    hits = at(found, kernel="moller1", order="sweep", density=1.0)
    assert hits.counts == {"add": 20, "sub": 10, "mul": 30, "div": 2} and hits.mixed
    assert (hits.arithmetic, hits.unit, hits.flops) == (pytest.approx(5.0), "arithmetic", 62)
    # None hits: 20 of them take 1.67 ns, 10 products alone at 8 G/s only 1.25.
    assert at(found, kernel="moller1", order="sweep", density=0.0).arithmetic == pytest.approx(
        5 / 3
    )
    half = at(found, kernel="moller1", order="sweep", density=0.5)
    assert half.counts["mul"] == 20 and half.arithmetic == pytest.approx((5 + 5 / 3) / 2)
    assert half.vector == pytest.approx(half.arithmetic / 8)


def test_one_unit_alone_can_be_the_bound(make, peaks):
    run = make("density", densities=(1.0,), triangles=100)
    products = {0: {"add": 0, "sub": 1, "mul": 40, "div": 0}}
    divisions = {0: {"add": 3, "sub": 1, "mul": 4, "div": 3}}
    counted = {"moller1": products, "badouel": divisions}
    found, left_out = bounds(run, peaks, counted)
    assert at(found, kernel="moller1", order="sweep").arithmetic == pytest.approx(40 / 8)
    division = at(found, kernel="badouel", order="sweep")
    assert (division.arithmetic, division.unit) == (pytest.approx(3.0), "division")
    assert left_out == {"chirkov": "nothing counts its operations"}


def test_without_outcomes_the_longest_path_counts(make, peaks):
    run = make("working_set")
    found, _ = bounds(run, peaks, OPERATIONS)
    assert all(one.flops == 62 and not one.mixed for one in found)
    assert "longest path" in roofline_table(run, found, {}, peaks).render()


def test_bytes_lie_in_the_smallest_level_that_holds_them(make, peaks):
    found, _ = bounds(make("working_set"), peaks, OPERATIONS)
    # 100 bytes a pair: 256 pairs in 32 KiB, 8192 in 1 MiB, 16384 in neither.
    levels = {one.cell["triangles"]: one for one in found if one.cell["kernel"] == "moller1"}
    assert {pairs: one.level for pairs, one in levels.items() if pairs in (256, 8192, 16384)} == {
        256: "L1",
        8192: "L2",
        16384: "memory",
    }
    assert levels[256].memory == pytest.approx(100 / 400)
    assert levels[8192].memory == pytest.approx(100 / 200)
    assert levels[16384].memory == pytest.approx(100 / 10)
    assert levels[16384].intensity == pytest.approx(0.62)
    assert levels[16384].reached == pytest.approx(10 / levels[16384].ns)


def test_repeating_a_pair_needs_only_that_pair(make, peaks):
    found, _ = bounds(make("density", triangles=25_000), peaks, OPERATIONS)
    assert at(found, kernel="moller1", order="repeat", density=0.5).level == "L1"
    assert at(found, kernel="moller1", order="sweep", density=0.5).level == "memory"


def test_double_precision_has_its_own_peaks_and_bytes(make, peaks):
    both = ("float32", "float64")
    run = make("density", densities=(1.0,), precisions=both, triangles=100)
    run = changed(run, lambda record: record["config"].update(precisions=list(both)))
    found, _ = bounds(run, peaks, OPERATIONS)
    single, double = (at(found, kernel="moller1", order="sweep", precision=name) for name in both)
    assert double.arithmetic == pytest.approx(2 * single.arithmetic)
    # 8 bytes of index and 4 of outcome do not grow.
    assert (single.bytes, double.bytes) == (100, 2 * 88 + 12)


def test_branches_are_what_a_sorted_order_saves(make, peaks):
    run = make("density", orders=("repeat", "sweep", "sorted"), triangles=100)
    found, _ = bounds(run, peaks, OPERATIONS)
    times = sampled(run)
    for one in found:
        kernel, order, density = (one.cell[name] for name in ("kernel", "order", "density"))
        if order != "sweep":
            assert one.branches is None and one.predicted
            continue
        saved = 1 - times[kernel, "sorted", density] / times[kernel, "sweep", density]
        assert one.branches == pytest.approx(saved)
        assert one.branches_low <= saved <= one.branches_high
        assert not one.predicted


def test_what_was_not_measured_is_not_told(make, peaks):
    run = make("density", triangles=100)
    found, _ = bounds(run, peaks, OPERATIONS)
    assert all(one.branches is None for one in found)
    rows = roofline_table(run, found, {}, peaks).rows
    words = {(row["order"], row["branches_percent"].text) for row in rows}
    assert words == {("repeat", ""), ("sweep", "not measured")}


@pytest.mark.parametrize(
    ("sorted_ns", "sweep_ns", "pairs", "bounded_by"),
    [
        (5.5, 6.0, 100, "arithmetic"),  # 5 of 6 ns
        (6.0, 20.0, 100, "branches"),  # 14 of 20 ns
        (29.0, 30.0, 100, "latency"),  # 24 of 30 ns are neither
        (11.0, 12.0, 25_000, "memory (memory)"),  # 100 bytes at 10 GB/s: 10 of 12 ns
    ],
)
def test_the_largest_part_bounds(
    sample_runs, tmp_path, peaks, sorted_ns, sweep_ns, pairs, bounded_by
):
    from rtbench.records.store import load_run

    rows = [
        {"kernel": "moller1", "precision": "float32", "order": order, "density": 1.0, "ns": ns}
        for order, ns in (("sorted", sorted_ns), ("sweep", sweep_ns))
    ]
    sample_runs.write_run(tmp_path / "a", "density", rows, triangles=pairs, spread=0.001)
    found, _ = bounds(load_run(tmp_path / "a"), peaks, OPERATIONS)
    assert at(found, order="sweep").bounded_by == bounded_by


def test_what_is_neither_may_be_branches_where_nobody_looked(make, peaks):
    found, _ = bounds(make("density", triangles=100), peaks, {"badouel": {None: MISS}})
    assert (
        at(found, kernel="badouel", order="sweep", density=0.5).bounded_by == "latency or branches"
    )
    assert at(found, kernel="badouel", order="repeat", density=0.5).bounded_by == "latency"


def test_intervals_hold_those_of_the_times_and_of_the_peaks(make, peaks):
    found, _ = bounds(make("density", densities=(1.0,), triangles=100), peaks, OPERATIONS)
    one = at(found, kernel="moller1", order="sweep")
    assert one.reached == pytest.approx(5.0 / one.ns)
    assert one.reached_low == pytest.approx(5.0 / 1.25 / one.high)
    assert one.reached_high == pytest.approx(5.0 / 0.9 / one.low)


def packets(sample_runs, folder):
    rows = [
        {"kernel": "moller1", "precision": "float32", "width": width, "ns": ns}
        for width, ns in ((1, 8.0), (8, 1.5))
    ]
    facts = {"moller1": {"float32": {"bytes_per_triangle": 48}}}
    workloads = [{"triangles": 64_000, "scene": 1000, "rays": 64, "distance_share": 0.75}]
    return sample_runs.write_run(
        folder, "packets", rows, ["kernel", "precision", "width"],
        triangles=1000, kernels=facts, workloads=workloads,
    )  # fmt: skip


def test_packets_are_measured_by_vector_peaks(sample_runs, tmp_path, peaks):
    from rtbench.records.store import load_run

    found, _ = bounds(load_run(packets(sample_runs, tmp_path / "p")), peaks, OPERATIONS)
    one, eight = at(found, width=1), at(found, width=8)
    assert (one.form, eight.form) == ("scalar", "vector")
    assert (one.arithmetic, eight.arithmetic) == (pytest.approx(5.0), pytest.approx(5.0 / 8))
    # The triangles stream past the rays: 48,000 bytes lie in L2, one for all lanes.
    assert (one.bytes, eight.bytes, eight.working_set, eight.level) == (48, 6, 48_000, "L2")


def test_a_soup_says_how_many_tests_end_at_the_distance(sample_runs, tmp_path, peaks):
    from rtbench.records.store import load_run

    run = load_run(packets(sample_runs, tmp_path / "p"))
    longest = at(bounds(run, peaks, OPERATIONS)[0], width=1)
    assert (longest.counts["mul"], longest.mixed) == (30, False)  # not a generated ending
    run = changed(run, lambda record: record.update(methods={"moller1": {"ending": "last_tuv"}}))
    first = at(bounds(run, peaks, OPERATIONS)[0], width=1)
    assert (first.counts["mul"], first.mixed) == (0.75 * 10 + 0.25 * 30, True)
    # Lanes leave together or not at all: each test does what the longest path does.
    lanes = at(bounds(run, peaks, OPERATIONS)[0], width=8)
    assert (lanes.counts["mul"], lanes.mixed) == (30, True)
    # Where the distance is tested last, the share says nothing of who leaves early.
    last = at(bounds(run, peaks, {"moller1": {0: HIT, 1: HIT, 2: MISS}})[0], width=1)
    assert (last.counts["mul"], last.mixed) == (30, False)


def test_where_nothing_is_skipped_the_count_is_exact(make, peaks):
    found, _ = bounds(make("working_set"), peaks, {"moller1": {None: HIT}})
    assert all(one.mixed for one in found)


def test_padded_records_take_their_padding(sample_runs, tmp_path, peaks):
    from rtbench.records.store import load_run

    def pad(record):
        record["kernels"]["moller1"]["float32"]["bytes_per_triangle_padded"] = 64
        record["config"]["layout"] = "padded"

    run = changed(load_run(packets(sample_runs, tmp_path / "p")), pad)
    found, _ = bounds(run, peaks, OPERATIONS)
    assert (at(found, width=1).bytes, at(found, width=1).working_set) == (64, 64_000)


def test_what_cannot_be_told_is_left_out_with_its_reason(sample_runs, tmp_path, make, peaks):
    from rtbench.records.store import load_run

    run = changed(make("density"), lambda record: record["config"].pop("bytes_per_pair"))
    found, left_out = bounds(run, peaks, OPERATIONS)
    assert found == []
    assert set(left_out.values()) == {"the run does not say how many bytes a test moves"}
    run = changed(
        load_run(packets(sample_runs, tmp_path / "p")), lambda record: record["kernels"].clear()
    )
    _, left_out = bounds(run, peaks, OPERATIONS)
    assert "bytes it reads of a triangle" in left_out["moller1"]


def test_only_the_whole_kernel_of_its_stages_is_bounded(make, peaks):
    _, left_out = bounds(make("stages"), peaks, OPERATIONS)
    assert left_out == {"moller1": "cut off after a stage", "chirkov": "cut off after a stage"}


def test_runs_that_have_nothing_to_bound(make, published, peaks):
    with pytest.raises(RtbenchError, match="published"):
        bounds(published("blecha-pc1"), peaks, OPERATIONS)
    with pytest.raises(RtbenchError, match="no cell has a time"):
        bounds(make("operations"), peaks, OPERATIONS)


def test_the_empty_loop_is_no_kernel(make, peaks):
    found, left_out = bounds(make("density"), peaks, OPERATIONS | {cells.EMPTY_LOOP: {None: MISS}})
    assert cells.EMPTY_LOOP not in {one.cell["kernel"] for one in found} | set(left_out)


def test_the_table_has_a_row_a_cell_and_is_json(make, peaks):
    run = make("density", orders=("sweep", "sorted"))
    found, _ = bounds(run, peaks, OPERATIONS)
    table = roofline_table(run, found, {"mine": "nothing counts its operations"}, peaks)
    rows = json.loads(table.render("json"))
    assert len(rows) == 3 * 2 * 5
    assert all(row["bytes"] == 100 and row["bounded_by"] for row in rows)
    assert "left out: mine (nothing counts its operations)" in table.render("plain")


def test_peaks_survive_a_file(tmp_path):
    path = tmp_path / "peaks.json"
    path.write_text(json.dumps(told()), encoding="utf-8")
    found = read_peaks(path)
    assert found.arithmetic("vector", "mixed", "div").rate == 4e9  # it computes in float64
    assert [level.name for level in found.levels] == ["L1", "L2", "memory"]
    assert found.levels[-1].holds == math.inf
    text = peaks_table(found).render()
    assert "vector, 256 bit" in text and "reading memory" in text


def test_what_disturbed_the_peaks_stands_below_them():
    text = peaks_table(Peaks(told(remarks=["disturbed: another program"]))).render()
    assert "disturbed: another program (the peaks are higher)" in text


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[]",
        "{}",
        json.dumps(told(bandwidth=[])),
        json.dumps(told(arithmetic=told()["arithmetic"][:-8])),
        json.dumps(told(bandwidth=[{"level": "L1", "holds_bytes": 9} | rated(-1)])),
        json.dumps(told(bandwidth=[{"level": "L1", "holds_bytes": "x"} | rated(1)])),
    ],
)
def test_a_file_without_peaks_is_refused(tmp_path, text):
    path = tmp_path / "peaks.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RtbenchError, match=r"peaks\.json"):
        read_peaks(path)


def test_the_plot_shows_every_cell_under_labelled_roofs(make, peaks):
    run = make("density", orders=("sorted", "sweep"), triangles=100)
    found, _ = bounds(run, peaks, OPERATIONS)
    figure = roofline_chart(run, found, peaks)
    style.settle(figure)
    assert [axes.get_title() for axes in figure.axes] == ["float32, sweep", "float32, sorted"]
    for axes in figure.axes:
        assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
        bars = [each for each in axes.containers if isinstance(each, ErrorbarContainer)]
        assert len(bars) == 3 * 5 and all(each.has_yerr for each in bars)
        words = " | ".join(text.get_text() for text in axes.texts)
        for label in ("L1 400.0 GB/s", "L2 200.0 GB/s", "memory 10.00 GB/s"):
            assert label in words
        assert "scalar add + mul: 12.00 G/s" in words
        assert "vector add + mul, 256 bit: 96.00 G/s" in words
        drawn = figure.canvas.get_renderer()
        for text in axes.texts:
            box, frame = text.get_window_extent(drawn), axes.bbox
            assert box.x0 >= frame.x0 and box.x1 <= frame.x1 and box.y1 <= frame.y1
    assert "(G/s)" in figure.axes[0].get_ylabel() and "byte" in figure.axes[0].get_xlabel()
    shown = {text.get_text() for text in figure.axes[-1].get_legend().get_texts()}
    assert shown == {"moller1", "badouel", "chirkov"}


def test_marks_stand_at_their_rate(make, peaks):
    run = make("density", densities=(1.0,), orders=("sweep",), triangles=100)
    found, _ = bounds(run, peaks, OPERATIONS)
    (axes,) = roofline_chart(run, found, peaks).axes
    places = [(*each.lines[0].get_xdata(), *each.lines[0].get_ydata()) for each in axes.containers]
    times = sampled(run)
    for (x, y), name in zip(places, ("moller1", "badouel", "chirkov"), strict=True):
        assert (x, y) == (pytest.approx(0.62), pytest.approx(62 / times[name, "sweep", 1.0]))


def test_the_plot_of_many_kernels_keeps_its_room(sample_runs, tmp_path, peaks):
    from rtbench.records.store import load_run

    names = [f"m{i % 4}_{i}" for i in range(28)]
    rows = [{"kernel": name, "precision": "float32", "width": 1, "ns": 8.0} for name in names]
    path = sample_runs.write_run(
        tmp_path / "m", "soup", rows, ["kernel", "precision", "width"], triangles=1000,
        kernels={name: {"float32": {"bytes_per_triangle": 48}} for name in names},
        workloads=[{"triangles": 64_000, "scene": 1000, "rays": 64}],
    )  # fmt: skip
    methods = {name: {"base": name[:2], "method": name[:2]} for name in names}
    run = changed(load_run(path), lambda record: record.update(methods=methods))
    found, _ = bounds(run, peaks, dict.fromkeys(names, OPERATIONS["moller1"]))
    figure = roofline_chart(run, found, peaks)
    figure.draw_without_rendering()
    (panel,) = (axes for axes in figure.axes if axes.get_xlabel())
    assert panel.get_position().height > 0.5
    labels = [text.get_text() for text in panel.get_legend().get_texts()]
    assert labels == ["m0", "m1", "m2", "m3"]
