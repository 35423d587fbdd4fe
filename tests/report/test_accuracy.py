"""What accuracy costs, from made-up runs: what is right worked out by hand beside each."""

import csv
import itertools
import json
import re

import pytest

from rtbench.errors import RtbenchError
from rtbench.records import schema
from rtbench.records.store import load_run
from rtbench.report import plots
from rtbench.report.accuracy import (
    BEHIND,
    LEVEL,
    MEASURES,
    ON_FRONT,
    PAIRS,
    SCALAR,
    UNSURE,
    Accuracy,
    Point,
)
from rtbench.report.accuracy_claims import CONFIRMED, OPEN, REFUTED, statements
from rtbench.report.accuracy_steps import STEPS, prices
from rtbench.report.advise import Question, advise
from rtbench.report.charts import style
from rtbench.report.layouts.accuracy_words import paragraph
from rtbench.report.layouts.advise import sentence
from rtbench.report.run_tables import tables_of, write_tables
from rtbench.report.standards import Standard

CELL = ["kernel", "precision", "order", "density", "prepared"]
CELL += ["workload", "form", "width", "flags", "reciprocal"]
MT, WHOLE = "moller_trumbore_uv", "moller_trumbore_whole_uv"
STABLE, STABLE_WHOLE = "moller_trumbore_stable_uv", "moller_trumbore_stable_whole_uv"
SAFE, EXACT = "watertight_safe_uv", "adaptive_exact_uv"
# ns one by one and in packets, wrong of 200 hard cases, leaks of 50, p99 of t, criteria that hold.
ALL = set(schema.CRITERIA)
FORMS = {
    (MT, "float32"): (10.0, None, 20, 5, 100.0, {"S3"}),
    (WHOLE, "float32"): (11.0, 1.0, 20, 5, 100.0, {"S3"}),
    (STABLE, "float32"): (12.0, None, 20, 5, 1.0, {"S3", "S5"}),
    (STABLE_WHOLE, "float32"): (13.0, 1.25, 20, 5, 1.0, {"S3", "S5"}),
    (SAFE, "float32"): (15.0, 1.5, 18, 0, 1.0, ALL - {"X1", "X2", "R1"}),
    (EXACT, "float32"): (18.0, 1.6, 0, 0, 1.0, ALL),
    (MT, "float64"): (9.5, None, 8, 3, 5e5, set()),
    (WHOLE, "float64"): (11.5, 2.0, 8, 3, 5e5, set()),
}


@pytest.fixture
def made(sample_runs, tmp_path):
    """Return a function that writes a run of the experiment and loads it."""

    def write(forms=None, name="a", loose=(), rounds=6, processes=5, spread=0.002):
        forms = FORMS if forms is None else forms
        cells, rows = [], []
        for (kernel, precision), (alone, packed, wrong, leaks, p99, holds) in forms.items():
            for (form, ns), workload in itertools.product(
                ((SCALAR, alone), (PAIRS, packed)), ("random", "leaf")
            ):
                if ns is not None:
                    cells.append(cell(kernel, precision, form, workload, ns))
            rows += judged(kernel, precision, "strict", wrong, leaks, p99, holds)
        for kernel, flags, ns, leaks in loose:
            cells.append(cell(kernel, "float32", SCALAR, "random", ns) | {"flags": flags})
            rows += judged(kernel, "float32", flags, 20, leaks, 1.0, set())
        cells.append(cell(MT, "float32", SCALAR, "mesh", 4.0))
        mesh = [{"kernel": MT, "precision": "float32", "form": SCALAR, "wrong": 0, "rays": 1024}]
        methods = {k: {"stored": "none", "outputs": ["t", "u", "v"]} for k, _ in forms}
        folder = sample_runs.write_run(
            tmp_path / "results" / name,
            "accuracy",
            cells,
            CELL,
            spread=spread,
            rounds=rounds,
            processes=processes,
            mesh=[row | {"triangles": 320} for row in mesh],
            methods=methods,
            workloads=[
                {"workload": "random", "density": 0.5, "triangles": 32768, "scene": 32768},
                {"workload": "leaf", "density": 0.047, "triangles": 32752, "scene": 32768},
            ],
        )
        with (folder / "accuracy.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, schema.ACCURACY_COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
        return load_run(folder)

    return write


def cell(kernel, precision, form, workload, ns):
    return {
        "kernel": kernel,
        "precision": precision,
        "order": "sweep",
        "density": 0.047 if workload == "leaf" else 0.5,
        "prepared": "own",
        "workload": workload,
        "form": form,
        "width": 1 if form == SCALAR else 16,
        "flags": "strict",
        "reciprocal": "division",
        "ns": ns,
    }


def judged(kernel, precision, flags, wrong, leaks, p99, holds):
    told = {"kernel": kernel, "precision": precision, "flags": flags, "reciprocal": "division"}
    for workload, ppm in (("random", 3), ("leaf", 1), ("far", 0)):
        counts = {"tests": 1_000_000, "decided": 1_000_000, "hits": 500_000}
        counts |= {"wrong": ppm if wrong else 0, "missed": 0, "extra": ppm if wrong else 0}
        undecided = {"undecided": 600, "undecided64": 2} if kernel == EXACT else {}
        yield told | {"workload": workload} | counts | undecided
    counts = {"tests": 250, "decided": 200, "hits": 100, "wrong": wrong, "leaks": leaks}
    counts |= {"groups": 50, "p99_t": p99, "relative_t": p99 * 1e-7, "wrong_outside_core": 0}
    yield told | {"workload": "corpus"} | counts | {n: int(n in holds) for n in schema.CRITERIA}


def standings(accuracy, form=SCALAR):
    return {one.point.name: one.standing for one in accuracy.front(MEASURES[0], form)}


def test_the_front_is_what_no_other_is_faster_and_as_right_as(made):
    # f64 MT: 9.5 ns and 8 wrong beats all but the exact one.
    found = standings(Accuracy(made()))
    front = {name for name, standing in found.items() if standing == ON_FRONT}
    assert front == {"moller_trumbore f64", "adaptive_exact f32"}
    assert set(found.values()) == {ON_FRONT, BEHIND}
    packed = standings(Accuracy(made(name="b")), PAIRS)
    assert {name for name, standing in packed.items() if standing == ON_FRONT} == {
        "moller_trumbore_whole f32",
        "watertight_safe f32",
        "adaptive_exact f32",
    }


def test_times_that_are_not_resolved_are_said_not_to_be(made):
    forms = {
        (MT, "float32"): (10.0, None, 20, 5, 100.0, set()),
        (STABLE, "float32"): (10.02, None, 20, 5, 1.0, set()),  # as right, no slower that shows
        (SAFE, "float32"): (10.04, None, 18, 0, 1.0, set()),  # more right, no slower that shows
        (EXACT, "float32"): (18.0, None, 0, 0, 1.0, ALL),
    }
    placed = Accuracy(made(forms, spread=0.02)).front(MEASURES[0], SCALAR)
    found = {one.point.kernel: one for one in placed}
    fastest = min((MT, STABLE), key=lambda kernel: found[kernel].time.value)
    other = STABLE if fastest == MT else MT
    if found[SAFE].time.value > found[fastest].time.value:
        assert found[fastest].standing == UNSURE and found[fastest].beside == found[SAFE].point
    else:
        assert found[SAFE].standing == ON_FRONT and found[fastest].standing == BEHIND
    assert found[other].standing in (LEVEL, BEHIND)
    assert found[EXACT].standing == ON_FRONT


def test_the_price_of_a_step_is_that_of_the_times(made):
    found = {
        (price.step.name, price.form): price
        for price in prices(Accuracy(made()))
        if price.workload == "random"
    }
    expected = {
        ("stable t", SCALAR): 20.0,  # 10 > 12
        ("stable t", PAIRS): 25.0,  # 1 > 1.25
        ("float64", SCALAR): -5.0,
        ("float64", PAIRS): 100.0,
        ("watertight_safe", SCALAR): 25.0,  # 12 > 15
        ("watertight_safe", PAIRS): 20.0,  # 1.25 > 1.5
        ("exact", SCALAR): 50.0,
        ("exact", PAIRS): 28.0,
        ("exact from watertight_safe", SCALAR): 20.0,
        ("exact from watertight_safe", PAIRS): 100 * (1.6 / 1.5 - 1),
    }
    assert found.keys() == expected.keys()
    for key, percent in expected.items():
        value, low, high = found[key].percent
        assert value == pytest.approx(percent, abs=1.0)
        assert low <= value <= high and high - low < 5
        assert found[key].verdict == ("faster" if percent < 0 else "slower")


def test_every_step_goes_between_two_forms_that_differ():
    assert len({step.name for step in STEPS}) == len(STEPS)
    for step, form in itertools.product(STEPS, (SCALAR, PAIRS)):
        start, end = step.pair(form)
        assert start != end and {start.form, end.form} == {form}


def test_the_paragraph_says_costs_saves_or_that_nothing_is_resolved(made):
    forms = FORMS | {(STABLE, "float32"): (10.0, None, 20, 5, 1.0, {"S5"})}
    loose = [(STABLE, "contract", 9.0, 5), (SAFE, "contract", 15.0, 7)]
    run = made(forms, loose=loose, spread=0.01)
    words = paragraph(Accuracy(run))
    assert "\n" not in words and words.startswith("On AMD EPYC 9B14, of ray/triangle tests")
    assert "A stable t makes no resolved difference one by one [" in words
    assert "and costs 25 % [" in words or "and costs 24 % [" in words or "and costs 26 % [" in words
    assert "Float64 for data and arithmetic saves " in words
    assert "99 % error of t 100 > 1 roundoffs" in words
    assert "(hard cases wrong 10 > 0 %, leaks 5 > 0, typical tests wrong 1.33 > 0 ppm)" in words
    contraction = words[words.index("Contraction") :]
    assert "saves 10" in contraction or "saves 9" in contraction or "saves 11" in contraction
    assert "watertight_safe 0 > 7 leaks" in contraction


def test_one_process_gives_no_interval_and_the_paragraph_says_so(made):
    words = paragraph(Accuracy(made(processes=1)))
    assert "(no interval)" in words and "resolved" not in words


def test_a_run_without_both_ends_of_a_step_says_so(made):
    run = made({(MT, "float32"): FORMS[MT, "float32"]})
    assert paragraph(Accuracy(run)).endswith(
        "no step of accuracy has both of its ends in this run."
    )


def test_claims_are_judged_by_their_intervals(made):
    told = [each.verdict for each in statements(Accuracy(made()))]
    assert told == [CONFIRMED, CONFIRMED, CONFIRMED]  # 1.25 / 1.6 = 0.78; 2 / 1.6 = 1.25; none
    slow = FORMS | {(EXACT, "float32"): (18.0, 2.5, 1, 0, 1.0, ALL)}
    told = [each.verdict for each in statements(Accuracy(made(slow, "b")))]
    assert told == [REFUTED, REFUTED, REFUTED]  # 0.5; 0.8; one
    level = FORMS | {(EXACT, "float32"): (18.0, 2.0, 0, 0, 1.0, ALL)}
    assert statements(Accuracy(made(level, "c", spread=0.02)))[1].verdict == OPEN


def test_the_tables_hold_the_numbers_of_the_records(made):
    run = made()
    tables = {table.name: table for table in tables_of(run)}
    assert list(tables) == ["accuracy", "steps", "fallback", "mesh", "claims"]
    rows = json.loads(tables["accuracy"].render("json"))
    one = next(r for r in rows if (r["kernel"], r["form"]) == (SAFE, SCALAR))
    assert one["random_ns"] == pytest.approx(15, rel=0.02)
    assert (one["corpus_percent"], one["leaks"], one["random_ppm"]) == (9.0, 0, 3.0)
    fallback = json.loads(tables["fallback"].render("json"))
    assert {(row["workload"], row["ppm"]) for row in fallback} == {
        (name, 600.0) for name in ("random", "leaf", "far")
    }
    (ray,) = json.loads(tables["mesh"].render("json"))
    assert ray["ns"] == pytest.approx(4 * 320, rel=0.02) and ray["wrong"] == 0
    for form in ("plain", "github", "latex", "csv"):
        assert all(table.render(form) for table in tables.values())
    assert len(write_tables(run)) == 15


def test_the_charts_name_the_front_and_nothing_covers_anything(made):
    charts = plots.figures(made())
    assert {"front", "front_typical", "front_t"} <= set(charts)
    assert "density" not in charts
    for figure in (charts["front"], charts["front_typical"]):
        style.settle(figure)
        renderer = figure.canvas.get_renderer()
        for panel in figure.axes:
            assert "(ns)" in panel.get_xlabel()
            inside = panel.get_window_extent(renderer)
            names = [text for text in panel.texts if text.get_text()]
            boxes = [super(type(t), t).get_window_extent(renderer) for t in names]
            for box in boxes:
                assert box.x0 >= inside.x0 - 1 and box.x1 <= inside.x1 + 1
            for one, other in itertools.combinations(boxes, 2):
                assert not one.overlaps(other)
    first = [text.get_text() for text in charts["front"].axes[0].texts]
    assert {"moller_trumbore f64", "adaptive_exact f32"} <= set(first)
    heights = charts["front"].axes[0].yaxis.get_major_formatter()
    assert heights(charts["front"].axes[0].yaxis.get_major_locator().locs[0]) == "0"


@pytest.mark.parametrize(
    ("word", "best", "out"),
    [
        ("stable", SAFE, {MT, STABLE, WHOLE, STABLE_WHOLE}),
        ("watertight", SAFE, {MT, STABLE, WHOLE, STABLE_WHOLE}),
        ("exact", EXACT, {MT, STABLE, WHOLE, STABLE_WHOLE, SAFE}),
    ],
)
def test_advice_keeps_to_what_was_asked_and_says_what_it_costs(made, word, best, out):
    run = made()
    found = advise([run], Question(accuracy=word, hit_ratio=0.5))
    assert found.ranking[0].candidate.kernel == best
    assert {one.kernel for one, reason, _ in found.fell_out if reason == f"not {word}"} == out
    own = next(one for one in found.free if one.candidate.kernel == best)
    cost = 1.8 if best == EXACT else 1.5  # 18 or 15 beside 10
    assert own.ratio.value == pytest.approx(cost, rel=0.01)
    told = re.search(rf"To be {word} costs ([\d.]+) % .* beside {MT}, the f", sentence(found))
    assert float(told[1]) == pytest.approx(100 * (own.ratio.value - 1), abs=0.1)
    assert any(run.name in remark for remark in found.remarks)
    packed = advise([run], Question(accuracy=word, hit_ratio=0.5, packets=True))
    assert packed.ranking[0].candidate.kernel == best
    assert packed.ranking[0].whole.value == pytest.approx(FORMS[best, "float32"][1], rel=0.02)


def test_without_accuracy_the_fastest_is_taken_and_no_price_told(made):
    found = advise([made()], Question(hit_ratio=0.5))
    assert found.ranking[0].candidate.kernel == MT and "To be" not in sentence(found)


def test_where_no_record_tells_the_claims_do(made):
    run = made()
    standard = Standard("exact", (), {EXACT: ("X1", "X2"), SAFE: ("S2",)})
    found = advise([run], Question(accuracy="exact", hit_ratio=0.5), standard)
    assert [one.candidate.kernel for one in found.ranking] == [EXACT]
    assert any("claim" in remark for remark in found.remarks)
    assert standard.misfit(EXACT.removesuffix("_uv"), "float64") is None
    assert "does not claim X1 X2" in standard.misfit(SAFE, "float32")
    assert "nothing is claimed in mixed" in standard.misfit(EXACT, "mixed")


def test_the_newest_record_decides(made):
    broken = made({(EXACT, "float32"): (18.0, 1.6, 3, 0, 1.0, ALL - {"X1"})}, name="new")
    standard = Standard("exact", (broken, made(name="old")), {EXACT: ("X1", "X2")})
    assert standard.misfit(EXACT, "float32") == "fails X1 (new)"


def test_an_unknown_accuracy_is_refused():
    with pytest.raises(RtbenchError, match="unknown accuracy 'exakt'; did you mean 'exact'"):
        Question(accuracy="exakt")


def test_a_point_is_called_by_what_it_differs_in():
    assert Point(MT).name == "moller_trumbore f32"
    assert Point(MT, "mixed", flags="fast").name == "moller_trumbore mixed +fast"
    assert Point(MT, "float32", PAIRS, reciprocal="estimate").name.endswith("f32 1/x estimated")
