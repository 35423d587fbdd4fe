"""Tables of trees: what stands in them is what numpy makes of the files."""

import csv
import io
import json

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.records.store import load_run
from rtbench.report.layouts.tree_growth import builders_table, expected_table, sizes_tables
from rtbench.report.layouts.tree_kernels import accuracy_table, kernels_table
from rtbench.report.layouts.tree_peers import peers_table
from rtbench.report.layouts.tree_quality import quality_table
from rtbench.report.layouts.tree_threads import threads_table
from rtbench.report.layouts.trees import times_table, trees_tables
from rtbench.report.run_tables import render_all, tables_of
from rtbench.report.tree_growth import exponent, largest
from rtbench.report.tree_pays import NEVER, Total, crossing, totals
from rtbench.report.trees import Trees

NAMES = ("model", "structure", "rule", "ending", "way", "kernel", "precision", "rays")


def raw(table):
    return list(csv.DictReader(io.StringIO(table.render("csv"))))


def taken(run, clock="cpu_ns"):
    """Return what names a cell to ns a ray, one a sample by process and round, as the file has."""
    found = {}
    with (run.path / "samples.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            key = tuple(row[name] for name in NAMES)
            turn = row["process"], row["round"]
            found.setdefault(key, {})[turn] = int(row[clock]) / int(row["tests"])
    return found


def key_of(row):
    return tuple(row[name] for name in NAMES)


def busy(run):
    """Let the clock tell twice the processor's time, as where others run."""
    path = run.path / "samples.csv"
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(row | {"ns": 2 * int(row["ns"])} for row in rows)
    return load_run(run.path)


def test_times_are_the_processor_s_and_ratios_those_of_rounds(make):
    run = busy(make("trees"))
    times = taken(run)
    rows = raw(times_table(Trees(run), "scanned"))
    assert len(rows) == 2 * (6 + 1) + 1
    best = {}
    for row in rows:
        mine = list(times[key_of(row)].values())
        assert float(row["ns_per_ray"]) == pytest.approx(np.median(mine))
        assert float(row["clock_ns"]) == pytest.approx(2 * np.median(mine))
        assert float(row["ns_low"]) < np.median(mine) < float(row["ns_high"])
        if row["way"] == "stack":
            best.setdefault(row["rays"], row)
    assert {row["ending"] for row in best.values()} == {"automatic"}
    for row in rows:
        first = times[key_of(best[row["rays"]])]
        mine = times[key_of(row)]
        logs = [np.log(mine[turn] / first[turn]) for turn in first]
        assert float(row["ratio"]) == pytest.approx(np.exp(np.median(logs)))


def test_how_many_times_faster_than_naive(make):
    run = make("trees")
    times = taken(run)
    table = times_table(Trees(run), "even")
    rows = raw(table)
    naive = next(times[key_of(row)] for row in rows if row["way"] == "brute_force")
    told = [row for row in rows if row["naive"]]
    assert {row["rays"] for row in told} == {"primary"}
    assert len(told) == 6
    for row in told:
        mine = times[key_of(row)]
        logs = [np.log(naive[turn] / mine[turn]) for turn in naive]
        assert float(row["naive"]) == pytest.approx(np.exp(np.median(logs)))
    assert any("primary from 64 rays (all 1,920 would take" in note for note in table.notes)


def test_trees_level_with_the_best_are_marked(make):
    trees = Trees(make("trees", endings=("automatic",), peers=(), spread=0.2))
    table = times_table(trees, "scanned")
    marked = [row["tree"] for row in table.rows if row["ratio"].text.endswith("*")]
    assert marked and "* no difference resolved from the best tree" in table.notes
    sure = times_table(Trees(make("trees", "other", spread=0.001)), "scanned")
    assert not any(row["ratio"].text.endswith("*") for row in sure.rows)


def test_the_expected_order_holds_or_where_it_does_not(make):
    good = times_table(Trees(make("trees", spread=0.002)), "scanned")
    assert (
        "expected order SAH, object median, spatial median: of 8 steps 8 hold, 0 do not, 0 are not "
        "resolved"
    ) in good.notes
    assert not any(note.startswith("the other way round") for note in good.notes)
    options = {"reverse": ("object_median", "spatial_median"), "spread": 0.002}
    other = times_table(Trees(make("trees", "reversed", **options)), "scanned")
    assert any("of 8 steps 4 hold, 4 do not" in note for note in other.notes)
    told = [note for note in other.notes if note.startswith("the other way round: ")]
    assert len(told) == 4
    assert told[0].startswith("the other way round: primary, automatic, stack: spatial median 0.65")
    assert all("of object median's time" in note for note in told)


def test_one_process_resolves_nothing_and_says_so(make):
    run = make("trees", processes=1, rounds=2)
    table = times_table(Trees(run), "scanned")
    assert "interval" not in table.columns and "ratio_interval" not in table.columns
    assert not any(row["ratio"].text.endswith("*") for row in table.rows)
    assert "one process: no interval, nothing is resolved" in table.notes
    assert "build_range" not in quality_table(Trees(run), "scanned").columns


def test_what_is_built_is_that_of_the_records(make):
    run = make("trees")
    rows = raw(quality_table(Trees(run), "even"))
    with (run.path / "trees.csv").open(encoding="utf-8") as file:
        builds = [row for row in csv.DictReader(file) if row["model"] == "even"]
    assert len(rows) == 7
    for row in rows:
        mine = [b for b in builds if all(b[n] == row[n] for n in ("structure", "rule", "ending"))]
        seconds = [float(b["build_seconds"]) for b in mine]
        assert float(row["build_seconds"]) == pytest.approx(np.median(seconds))
        assert float(row["build_least"]) == pytest.approx(min(seconds))
        assert float(row["build_greatest"]) == pytest.approx(max(seconds))
        if row["structure"] == "kd":
            empty = int(mine[0]["empty_leaves"]) / int(mine[0]["leaves"])
            assert float(row["empty_percent"]) == pytest.approx(100 * empty)
            each = int(mine[0]["references"]) / int(mine[0]["triangles"])
            assert float(row["references_per_triangle"]) == pytest.approx(each)
            assert float(row["megabytes"]) == pytest.approx(int(mine[0]["bytes"]) / 1e6)
    assert [row["rule"] for row in rows[:6:2]] == ["sah", "object_median", "spatial_median"]
    assert rows[-1]["structure"] == "embree" and rows[-1]["nodes"] == ""


def test_builds_are_told_by_the_processor_and_those_of_libraries_by_the_clock(make):
    run = make("trees")
    before = raw(quality_table(Trees(run), "even"))
    path = run.path / "trees.csv"
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(r | {"build_seconds": 3 * float(r["build_seconds"])} for r in rows)
    after = raw(quality_table(Trees(load_run(run.path)), "even"))
    for one, other in zip(before, after, strict=True):
        more = 1 if one["structure"] == "kd" else 3
        wanted = more * float(one["build_seconds"])
        assert float(other["build_seconds"]) == pytest.approx(wanted)


KERNELS = {
    "kernels": ("moller_trumbore", "watertight_safe"),
    "precisions": ("float32", "float64"),
    "ways": ("stack", "packets", "wide"),
    "structures": ("kd", "bvh"),
    "rules": ("sah",),
    "endings": ("automatic",),
}


def test_kernels_by_tree_and_way(make):
    run = make("trees", **KERNELS)
    trees = Trees(run)
    table = kernels_table(trees, "scanned")
    assert table.columns[:3] == ["rays", "kernel", "precision"]
    assert table.columns[3:] == ["k-d, stack", "k-d, packets", "BVH, wide"]
    assert len(table.rows) == 2 * 2 * 2
    times = taken(run)
    for row in raw(table):
        mine = list(times[key_of(row)].values())
        assert float(row["ns_per_ray"]) == pytest.approx(np.median(mine))
    names = [found.name for found in trees_tables(run)]
    # Kernels are the question, so no table of rules.
    assert "tree-times-scanned" not in names and "tree-kernels-scanned" in names


def test_accuracy_beside_its_price(make):
    run = make("trees", **KERNELS)
    rows = raw(accuracy_table(Trees(run), "scanned"))
    times = taken(run)
    assert len(rows) == 2 * 2 * 2 * 3
    for row in rows:
        same = row | {"kernel": "moller_trumbore", "precision": "float32"}
        first, mine = times[key_of(same)], times[key_of(row)]
        ratio = np.exp(np.median([np.log(mine[turn] / first[turn]) for turn in first]))
        assert float(row["ratio"]) == pytest.approx(ratio)
        assert (row["wrong"], row["rays_judged"]) == ("0", "1000")
        assert int(row["exact_wrong"]) == len(row["kernel"]) % 5
        assert row["exact_judged"] == "500"


def test_peers_are_paired_by_rounds_and_means_are_geometric(make):
    run = make("trees")
    times = taken(run)
    table = peers_table(Trees(run))
    printed = [row["model"] for row in table.rows]
    assert printed == ["scanned", "even", "geometric mean"] * 2
    rows = raw(table)
    speeds = {}
    for row in rows:
        if row["model"] == "geometric mean":
            continue
        peer = dict.fromkeys(("structure", "rule", "ending"), "") | {"way": "peer"}
        theirs = times[key_of(row | peer | {"kernel": "embree"})]
        mine = times[key_of(row)]
        ratios = [theirs[turn] / mine[turn] for turn in mine]
        assert float(row["speed"]) == pytest.approx(np.exp(np.median(np.log(ratios))))
        assert float(row["least"]) == pytest.approx(min(ratios))
        assert float(row["greatest"]) == pytest.approx(max(ratios))
        if (row["rule"], row["ending"]) == ("sah", "automatic"):
            speeds.setdefault(row["rays"], []).append(float(row["speed"]))
    for row in rows:
        if row["model"] == "geometric mean":
            mean = np.prod(speeds[row["rays"]]) ** 0.5
            assert float(row["speed"]) == pytest.approx(mean)
    # The median rules stand in the records alone.
    assert {row["rule"] for row in rows} >= {"object_median", "spatial_median"}
    assert not any("median" in row["tree"] for row in table.rows)


def test_a_library_with_threads_of_its_own_is_told_by_the_clock(make):
    run = busy(make("trees", peers=("embree", "open3d")))
    rows = [row for row in raw(peers_table(Trees(run))) if row["model"] == "scanned"]
    by_cpu, clock = taken(run), taken(run, "ns")
    for row in rows:
        times = by_cpu if row["peer"] == "embree" else clock
        peer = dict.fromkeys(("structure", "rule", "ending"), "") | {"way": "peer"}
        theirs = times[key_of(row | peer | {"kernel": row["peer"]})]
        assert float(row["peer_ns"]) == pytest.approx(np.median(list(theirs.values())))


def test_more_threads_are_told_by_the_clock(make):
    run = make("trees", ways=("stack",), threads=(2,), rules=("sah",), endings=("automatic",))
    rows = raw(threads_table(Trees(run)))
    assert len(rows) == 2 * 2
    clock, cpu = taken(run, "ns"), taken(run)
    for row in rows:
        one, two = clock[key_of(row)], clock[key_of(row | {"way": "stack, 2 threads"})]
        gains = [one[turn] / two[turn] for turn in one]
        assert float(row["gain"]) == pytest.approx(np.exp(np.median(np.log(gains))))
        busy_cores = [cpu[key_of(row | {"way": "stack, 2 threads"})][t] / two[t] for t in two]
        assert float(row["cpu_wall"]) == pytest.approx(np.median(busy_cores))


SIZES = {f"scanned:{n}": n for n in (1000, 4000, 16_000, 64_000, 256_000)}


def test_sizes_are_columns_and_exponents_slopes(make):
    run = make("trees", models=SIZES, endings=("automatic",))
    (table,) = sizes_tables(Trees(run))
    assert table.name == "tree-sizes-scanned"
    rows = raw(table)
    assert [row["what"] for row in rows[:4]] == ["build s"] * 4
    for row in rows:
        values = [float(row[str(n)]) for n in SIZES.values()]
        slope = np.polyfit(np.log(list(SIZES.values())), np.log(values), 1)[0]
        assert float(row["exponent"]) == pytest.approx(slope, abs=1e-9)
        top = np.polyfit(np.log(list(SIZES.values())[2:]), np.log(values[2:]), 1)[0]
        assert float(row["exponent_largest"]) == pytest.approx(top, abs=1e-9)
    names = [found.name for found in tables_of(run)]
    assert not any(name.startswith("tree-times-") for name in names)


def test_the_interval_of_an_exponent_is_that_of_least_squares():
    from scipy import stats

    random = np.random.default_rng(3)
    sizes = np.array([1e3, 3e3, 1e4, 3e4, 1e5, 1e6])
    seconds = 1e-6 * sizes**1.1 * np.exp(random.normal(0, 0.05, len(sizes)))
    known = stats.linregress(np.log(sizes), np.log(seconds))
    found = exponent(sizes, seconds)
    reach = stats.t.ppf(0.975, len(sizes) - 2) * known.stderr
    assert found.value == pytest.approx(known.slope)
    assert found.low == pytest.approx(known.slope - reach, rel=1e-6)
    assert found.high == pytest.approx(known.slope + reach, rel=1e-6)
    assert exponent([10, 20], [1, 2]).low is None
    assert exponent([10], [1]) is None and exponent([], []) is None
    assert largest([5, 1, 4, 2, 3]) == [0, 2, 4]


def test_builders_with_exponents_bytes_and_digests(make):
    run = make("tree_builders", different=[("n2", 3000)])
    table = builders_table(run)
    rows = {row["builder"]: row for row in table.rows}
    assert list(rows) == ["nlogn", "nlog2n", "n2", "object_median"]
    assert rows["nlogn"]["same_tree"] == "first"
    assert rows["nlog2n"]["same_tree"] == "yes, 6 of 6"
    assert rows["n2"]["same_tree"] == "NO: 2 of 3"
    assert rows["object_median"]["same_tree"] == ""
    assert rows["n2"]["exponent"].value == pytest.approx(2.0, abs=0.03)
    assert rows["nlogn"]["exponent"].value == pytest.approx(1.05, abs=0.03)
    assert rows["nlogn"]["bytes_per_triangle"].value == 300
    with (run.path / "builds.csv").open(encoding="utf-8") as file:
        builds = list(csv.DictReader(file))
    mine = [
        float(b["seconds"]) for b in builds if b["builder"] == "n2" and b["triangles"] == "1000"
    ]
    assert rows["n2"]["1000"].value == pytest.approx(np.median(mine))
    assert len(raw(table)) == len(builds)


def test_correlation_is_that_of_ranks(make):
    run = make("trees", spread=0.3)
    rows = raw(expected_table(Trees(run)))
    assert [row["model"] for row in rows] == ["scanned"] * 2 + ["even"] * 2 + ["all models"] * 2
    times = taken(run)
    with (run.path / "trees.csv").open(encoding="utf-8") as file:
        cost = {
            (b["model"], b["rule"], b["ending"]): float(b["sah_cost"])
            for b in csv.DictReader(file)
            if b["rule"]
        }
    for row in rows[:4]:
        mine = {
            (key[0], key[2], key[3]): np.median(list(values.values()))
            for key, values in times.items()
            if key[0] == row["model"] and key[-1] == row["rays"] and key[4] == "stack"
        }
        a, b = ([one[key] for key in mine] for one in (cost, mine))
        ranks = [np.argsort(np.argsort(values)) for values in (a, b)]
        assert float(row["sah_cost"]) == pytest.approx(np.corrcoef(*ranks)[0, 1])
        assert row["trees"] == "6"


def of(seconds, ns):
    return Total(None, (seconds,) * 3, (ns,) * 3, [(seconds, ns)])


def test_from_how_many_rays_a_build_pays():
    assert crossing(of(1.0, 100), of(0.2, 500)).rays == pytest.approx(0.8 / 400e-9)
    assert crossing(of(0.1, 100), of(0.2, 500)).rays == 0
    assert crossing(of(1.0, 500), of(0.2, 100)).rays == NEVER
    assert crossing(of(1.0, 100), of(0.2, 100)).rays == NEVER
    several = Total(None, (1.0,) * 3, (100,) * 3, [(0.9, 90), (1.1, 110)])
    other = Total(None, (0.2,) * 3, (500,) * 3, [(0.2, 500), (0.2, 500)])
    found = crossing(several, other)
    assert (found.low, found.high) == pytest.approx((0.7 / 410e-9, 0.9 / 390e-9))


def test_totals_are_a_tree_a_rule_and_the_naive_way(make):
    found = totals(
        Trees(make("trees", structures=("kd", "bvh"), ways=("stack", "wide"))), "even", "primary"
    )
    keys = [one.timed.key[:2] for one in found]
    rules = ["sah", "object_median", "spatial_median"]
    assert keys == [*(("kd", rule) for rule in rules), ("bvh", "sah"), ("none", "")]
    assert found[-1].seconds == (0, 0, 0) and found[0].seconds[0] > 0


@pytest.mark.parametrize("form", ["plain", "github", "latex", "csv", "json"])
@pytest.mark.parametrize("experiment", ["trees", "tree_builders"])
def test_every_table_in_every_form(make, form, experiment):
    tables = tables_of(make(experiment, rounds=2))
    assert tables
    text = render_all(tables, form)
    assert text
    if form == "json":
        assert set(json.loads(text)) == {table.name for table in tables}
    if form == "latex":
        assert text.count(r"\begin{table}") == text.count(r"\end{table}") == len(tables)


def test_nothing_measured_yet_is_no_table(make):
    assert (
        tables_of(make("trees", models={"none": 7}, rules=(), peers=(), naive=False, judged=False))
        == []
    )


def test_a_run_that_was_killed_is_told_as_far_as_it_came(make):
    run = make("trees")
    path = run.path / "samples.csv"
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(lines[:40]) + lines[40][:20], encoding="utf-8")
    (run.path / "visits.csv").unlink()
    names = [table.name for table in tables_of(run)]
    assert "trees-scanned" in names and "tree-times-scanned" in names
    with pytest.raises(RtbenchError):
        tables_of(run)[0].render("xml")
