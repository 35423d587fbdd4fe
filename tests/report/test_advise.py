"""Advice from made-up runs, the right answer worked out by hand beside each."""

import json

import pytest

from rtbench.errors import NotComparable, RtbenchError
from rtbench.records.store import load_run
from rtbench.report.advise import Question, advise
from rtbench.report.candidates import measured_runs
from rtbench.report.layouts.advise import advice_tables, sentence

CELL = ["kernel", "precision", "order", "density", "prepared"]
PREPARED = {"none": None, "normal": 40.0, "precomputed": 100.0}  # ns a triangle
# ns a test at the hit ratios 0.1 (exactly 0.12) and 0.5 (0.52), and what is stored.
THREE = {
    "plain": (10.0, 20.0, "none"),
    "light": (9.0, 18.0, "normal"),
    "heavy": (8.0, 16.0, "precomputed"),
}


@pytest.fixture
def made(sample_runs, tmp_path):
    """Return a function that writes a run over soups and loads it."""

    def write_and_load(
        kernels,
        name="a",
        precisions=("float32",),
        experiment="soup",
        cell=CELL,
        further=({"prepared": "own"},),
        scene=64,
        coded=True,
        change=None,
        **more,
    ):
        cells, methods, facts = [], {}, {}
        for kernel, (sparse, dense, stored) in kernels.items():
            outputs = ["t"] if kernel.endswith("only_t") else ["t", "u", "v"]
            methods[kernel] = {"outputs": outputs, "stored": stored}
            for precision in precisions:
                told = {"bytes_per_triangle": 36, "bytes_per_triangle_padded": 48}
                if PREPARED[stored]:
                    told = {"bytes_per_triangle": 50, "bytes_per_triangle_padded": 64}
                    told["prepare_ns_per_triangle"] = PREPARED[stored]
                if coded:
                    told["machine_code_digest"] = f"code of {kernel} {precision}"
                facts.setdefault(kernel, {})[precision] = told
                for density, ns in ((0.1, sparse), (0.5, dense)):
                    for one in further:
                        known = {"kernel": kernel, "precision": precision, "order": "sweep"}
                        factor = one.get("factor", 1)
                        cells.append(known | {"density": density, "ns": ns * factor} | one)
        workloads = [
            {"density": density, "triangles": 4096, "scene": scene, "hit_ratio": exact}
            for density, exact in ((0.1, 0.12), (0.5, 0.52))
        ]
        info = {"workloads": workloads, "methods": methods, "kernels": facts}
        info |= {"config": {"layout": "padded", "name": name, "kernels": list(kernels)}}
        if change is not None:
            change(info)
        options = {"triangles": 4096, "spread": 0.002, "rounds": 3} | info | more
        folder = tmp_path / "results" / name
        return load_run(sample_runs.write_run(folder, experiment, cells, cell, **options))

    return write_and_load


def kernels(advice):
    return [one.candidate.kernel for one in advice.ranking]


def verdicts(advice):
    return {one.candidate.kernel: one.verdict for one in advice.ranking}


def fallen(advice):
    return {one.kernel: reason for one, reason, _ in advice.fell_out}


@pytest.mark.parametrize(
    ("stored", "ranking"),
    [
        ("none", ["plain"]),
        ("normal", ["light", "plain"]),
        ("precomputed", ["heavy", "light", "plain"]),
    ],
)
def test_what_may_be_stored_decides(made, stored, ranking):
    found = advise([made(THREE)], Question(stored=stored))
    assert kernels(found) == ranking
    others = THREE.keys() - set(ranking)
    assert fallen(found) == dict.fromkeys(others, f"stores more than {stored}")


def test_the_ratio_to_the_best_is_that_of_the_times(made):
    found = advise([made(THREE)], Question())
    ratios = [one.ratio.value for one in found.ranking]
    assert ratios == pytest.approx([1, 9 / 8, 10 / 8], rel=0.01)
    assert [one.verdict for one in found.ranking] == ["best", "slower", "slower"]
    low, high = found.ranking[2].ratio.interval()
    assert low < 1.25 < high and high - low < 0.05


@pytest.mark.parametrize(
    ("rays", "ranking"),
    [
        (1000, ["heavy", "light", "plain"]),  # 8.1, 9.04, 10
        (60, ["light", "heavy", "plain"]),  # 9.67, 9.67 (a draw), 10
        (20, ["plain", "light", "heavy"]),  # 10, 11, 13
        (1, ["plain", "light", "heavy"]),  # 10, 49, 108
    ],
)
def test_preparation_is_shared_by_the_rays(made, rays, ranking):
    found = advise([made(THREE)], Question(rays_per_triangle=rays))
    whole = {one.candidate.kernel: one.whole.value for one in found.ranking}
    wanted = {"plain": 10, "light": 9 + 40 / rays, "heavy": 8 + 100 / rays}
    assert whole == pytest.approx(wanted, rel=0.01)
    bare = {one.candidate.kernel: one.bare.value for one in found.ranking}
    assert bare == pytest.approx({"plain": 10, "light": 9, "heavy": 8}, rel=0.01)
    if rays == 60:
        assert kernels(found)[2] == "plain" and len(found.level) > 1
    else:
        assert kernels(found) == ranking


def test_preparation_without_an_interval_gives_the_benefit_of_doubt(made):
    two = {name: THREE[name] for name in ("plain", "heavy")}
    # 8 + 100/43 = 10.33 beside 10, resolved were it all measured; preparing a fifth quicker: 9.86.
    close = advise([made(two)], Question(rays_per_triangle=43))
    assert kernels(close) == ["plain", "heavy"]
    assert close.ranking[1].ratio.interval()[0] > 1.01
    assert verdicts(close)["heavy"] == "no difference resolved"
    # 8 + 100/30 = 11.33; a fifth quicker 10.67.
    far = advise([made(two, "b")], Question(rays_per_triangle=30))
    assert verdicts(far)["heavy"] == "slower"


def test_a_hit_ratio_between_two_is_their_mixture(made):
    run = made(THREE)
    half = advise([run], Question(stored="none", hit_ratio=0.32))  # half way from 0.12 to 0.52
    assert half.ranking[0].bare.value == pytest.approx(15, rel=0.01)
    assert any("0.12 and 0.52" in remark for remark in half.remarks)
    quarter = advise([run], Question(stored="none", hit_ratio=0.22))
    assert quarter.ranking[0].bare.value == pytest.approx(0.75 * 10 + 0.25 * 20, rel=0.01)


@pytest.mark.parametrize(("asked", "ns"), [(0.1, 10), (0.5, 20), (0.0, 10), (1.0, 20)])
def test_outside_the_measured_ratios_the_nearest_is_taken_and_told(made, asked, ns):
    found = advise([made(THREE)], Question(stored="none", hit_ratio=asked))
    assert found.ranking[0].bare.value == pytest.approx(ns, rel=0.01)
    told = any("was not measured" in remark for remark in found.remarks)
    assert told == (asked in (0.0, 1.0))  # 0.1 is the name of what is exactly 0.12


def test_what_is_not_returned_falls_out(made):
    run = made(THREE | {"quick_only_t": (5.0, 6.0, "none")})
    assert kernels(advise([run], Question(outputs="t")))[0] == "quick_only_t"
    asked = advise([run], Question(outputs="tuv"))
    assert kernels(asked) == ["heavy", "light", "plain"]
    assert asked.fell_out[0][1:] == ("outputs", "does not return u, v")


def test_memory_is_that_of_the_layout_and_all_triangles(made):
    run = made(THREE)
    # 1000 triangles: 48,000 bytes of plain, 64,000 of the others.
    assert kernels(advise([run], Question(triangles=1000, memory=64_000)))[0] == "heavy"
    asked = advise([run], Question(triangles=1000, memory=63_999))
    assert kernels(asked) == ["plain"]
    assert {detail for _, _, detail in asked.fell_out} == {"64 bytes x 1,000 triangles = 64,000"}
    packed = made(THREE, "b", change=lambda info: info["config"].update(layout="own"))
    # 50,000 bytes packed
    assert kernels(advise([packed], Question(triangles=1000, memory=50_000)))[0] == "heavy"


def test_wrong_answers_fall_out_however_fast(made):
    def change(info):
        own = {"precision": "float32", "prepared": "own", "density": 0.5, "differ": 9}
        info["nearest"] = [
            {"kernel": "light", "wrong": 0} | own,
            {"kernel": "heavy", "wrong": 2} | own,
        ]
        info["methods"]["light"]["exact"] = False

    found = advise([made(THREE, change=change)], Question())
    assert kernels(found) == ["plain"]
    assert {one.kernel: detail for one, _, detail in found.fell_out} == {
        "light": "rounding has no bound: roots or arccos decide",
        "heavy": "wrong nearest triangles for 2 rays",
    }


def test_other_precisions_are_told_only_where_the_one_asked_lacks(made):
    both = made({"plain": THREE["plain"]}, "both", ("float32", "float64"))
    single = made({"light": THREE["light"]}, "single", created="2026-01-01")
    found = advise([both, single], Question(precision="float64"))
    assert kernels(found) == ["plain"] and fallen(found) == {"light": "not in float64"}
    none = advise([single], Question(precision="mixed"))
    assert none.ranking == []
    assert sentence(none) == "No measured kernel fits: not in mixed."


def test_what_cannot_be_told_apart_is_named_together(made):
    level = dict.fromkeys(("one", "two"), (10.0, 10.0, "none"))
    level |= {"three": (10.0, 10.0, "normal"), "four": (15.0, 15.0, "none")}
    found = advise([made(level, spread=0.02)], Question())
    assert {one.candidate.kernel for one in found.level} == {"one", "two", "three"}
    assert verdicts(found)["four"] == "slower"
    words = sentence(found)
    assert all(name in words for name in level)
    # 48 bytes and nothing to prepare beside 64 and 40 ns
    assert "ask least: 48 bytes a triangle, nothing to prepare" in words
    assert "The next, four, takes 1." in words


def test_one_process_tells_nothing_apart(made):
    found = advise([made(THREE, processes=1)], Question())
    assert set(verdicts(found).values()) == {"best", "no interval"}
    assert "single process" in sentence(found)


def test_a_time_that_is_hardly_known_is_said_to_be(made):
    def remarked(advice):
        return any("rtbench machine" in remark for remark in advice.remarks)

    assert remarked(advise([made(THREE, "loud", spread=0.3)], Question()))
    assert not remarked(advise([made(THREE, "quiet")], Question()))


def at_another_clock(kernels, factor):
    return {
        name: (sparse * factor, dense * factor, stored)
        for name, (sparse, dense, stored) in kernels.items()
    }


def test_code_that_two_runs_share_tells_of_their_clocks(made):
    shared = {"plain": (10.0, 20.0, "none"), "slow": (13.0, 26.0, "none")}
    first = made(shared, "first", created="2026-01-03")
    # By the clock of the first run quick takes 9.5, and is the best; this one's is 8 % slower.
    later = shared | {"quick": (9.5, 19.0, "none")}
    second = made(at_another_clock(later, 1.08), "second", created="2026-01-02", seed=2)
    found = advise([first, second], Question())
    # slow and plain count as the newest run has them.
    runs = {one.candidate.kernel: one.candidate.run.name for one in found.ranking}
    assert runs == {"quick": "second", "plain": "first", "slow": "first"}
    ratios = {one.candidate.kernel: one.ratio.value for one in found.ranking}
    assert ratios["plain"] / ratios["quick"] == pytest.approx(10 / 9.5, rel=0.01)
    assert ratios["slow"] / ratios["quick"] == pytest.approx(13 / 9.5, rel=0.01)
    assert kernels(found) == ["quick", "plain", "slow"]
    assert verdicts(found)["plain"] == "slower"


def test_runs_without_shared_code_must_differ_by_more_than_their_clocks_may(made):
    first = made({"plain": (10.0, 20.0, "none")}, "first", created="2026-01-03")
    second = {"near": (10.7, 21.4, "none"), "far": (12.0, 24.0, "none")}
    second = made(second, "second", created="2026-01-02", seed=2)
    found = advise([first, second], Question())
    assert verdicts(found) == {
        "plain": "best",
        "near": "no difference resolved",
        "far": "slower",
    }
    assert any("share no code" in remark for remark in found.remarks)
    # In one run 7 % are resolved.
    together = {"plain": (10.0, 20.0, "none"), "near": (10.7, 21.4, "none")}
    assert verdicts(advise([made(together, "c")], Question()))["near"] == "slower"


def test_a_third_run_stands_between_two_that_share_no_code(made):
    first = {"plain": (10.0, 20.0, "none"), "slow": (13.0, 26.0, "none")}
    second = {"light": (9.5, 19.0, "normal"), "heavy": (15.0, 30.0, "precomputed")}
    ours = made(first, "first", created="2026-01-03")
    theirs = made(at_another_clock(second, 1.08), "second", created="2026-01-02", seed=2)
    apart = advise([ours, theirs], Question())
    assert verdicts(apart)["light"] in ("best", "no difference resolved")
    assert len(apart.level) == 2
    between = at_another_clock(first | second, 1.3)
    third = made(between, "third", created="2026-01-01", seed=3)
    found = advise([ours, theirs, third], Question())
    assert kernels(found) == ["light", "plain", "slow", "heavy"]
    ratios = {one.candidate.kernel: one.ratio.value for one in found.ranking}
    assert ratios["plain"] == pytest.approx(10 / 9.5, rel=0.01)
    assert verdicts(found)["plain"] == "slower"
    assert not any("share no code" in remark for remark in found.remarks)


def test_a_disturbed_run_does_not_hide_what_a_quiet_one_tells(made):
    quiet = {"plain": (10.0, 20.0, "none"), "slow": (13.0, 26.0, "none")}
    first = made(quiet, "first")
    loud = quiet | {"shaky": (9.8, 19.6, "none")}
    second = made(loud, "second", spread=0.3, created="2026-01-01", seed=4)
    found = advise([first, second], Question())
    assert found.ranking[0].candidate.kernel == "plain"
    assert verdicts(found) == {
        "plain": "best",
        "shaky": "no difference resolved",
        "slow": "slower",
    }


def test_runs_of_two_machines_are_not_mixed(made):
    first = made(THREE, "first")
    second = made(THREE, "second", machine={"cpu_model": "another"})
    with pytest.raises(NotComparable, match="different machines"):
        advise([first, second], Question())


def test_the_nearest_number_of_triangles_is_asked(made):
    cell = [*CELL, "scene"]
    own = {"prepared": "own"}

    def change(info):
        rows = info["workloads"]
        info["workloads"] = [row | {"scene": scene} for row in rows for scene in (64, 4096)]
        told = {"kernel": "heavy", "precision": "float32"}
        info["preparation"] = [
            told | {"scene": 64, "ns_per_triangle": 30.0},
            told | {"scene": 4096, "ns_per_triangle": 70.0},
        ]

    # Thrice as long over 4096 triangles.
    sizes = [own | {"scene": 64}, own | {"scene": 4096, "factor": 3}]
    run = made(THREE, "e", experiment="break_even", cell=cell, further=sizes, change=change)
    # On a logarithmic scale 1000 is nearer to 4096 than to 64.
    found = advise([run], Question(triangles=1000, rays_per_triangle=10))
    whole = {one.candidate.kernel: one.whole.value for one in found.ranking}
    assert whole["heavy"] == pytest.approx(3 * 8 + 70 / 10, rel=0.01)
    assert any("4,096 triangles" in remark for remark in found.remarks)
    small = advise([run], Question(triangles=64, rays_per_triangle=10))
    whole = {one.candidate.kernel: one.whole.value for one in small.ranking}
    assert whole["heavy"] == pytest.approx(8 + 30 / 10, rel=0.01)
    # Kernels that were not measured with so many fall out.
    other = made({"extra": (1.0, 1.0, "none")}, "soup", created="2027-01-01")
    found = advise([run, other], Question(triangles=4096))
    assert fallen(found) == {"extra": "other number of triangles"}


def test_packets_are_asked_apart(made):
    cell = [*CELL[:4], "form", "width", "packet", "angle", "reciprocal"]
    usual = {"form": "rays", "packet": "general", "angle": 10.0, "reciprocal": "division"}
    cells = [
        usual | {"width": 1},
        usual | {"width": 4, "factor": 0.5},
        usual | {"width": 16, "factor": 0.2},
        usual | {"width": 16, "factor": 0.15, "reciprocal": "estimate"},
        usual | {"width": 16, "factor": 0.25, "form": "triangles"},
        # Of another kind, hence not asked:
        usual | {"width": 16, "factor": 0.1, "packet": "parallel"},
        usual | {"width": 16, "factor": 0.1, "angle": 0.0},
        {"form": "pairs", "width": 16, "factor": 0.1, "reciprocal": "division"},
    ]

    def change(info):
        told = {"kernel": "plain", "precision": "float32", "density": 0.5, "width": 16}
        info["estimates"] = [told | {"reciprocal": "estimate", "differ": 3}]

    plain = {"plain": THREE["plain"]}
    packets = made(plain, "p", experiment="packets", cell=cell, further=cells, change=change)
    single = made(THREE, "single")
    found = advise([single, packets], Question(packets=True))
    ways = [dict(one.candidate.way) for one in found.ranking]
    assert [(way["form"], way["width"]) for way in ways] == [
        ("rays", 16),
        ("triangles", 16),
        ("rays", 4),
        ("rays", 1),
    ]
    ns = [one.bare.value for one in found.ranking]
    assert ns == pytest.approx([2, 2.5, 5, 10], rel=0.01)
    assert [detail for _, _, detail in found.fell_out] == [
        "other triangles for 3 rays by an estimate"
    ]
    assert sentence(found).startswith("Take plain (16 rays): 2.0")
    assert any("packet general, angle 10" in remark for remark in found.remarks)
    assert kernels(advise([single, packets], Question())) == ["heavy", "light", "plain"]
    with pytest.raises(RtbenchError, match="no times of packets"):
        advise([single], Question(packets=True))


def test_tables_hold_what_the_advice_says(made):
    found = advise([made(THREE)], Question(stored="normal", rays_per_triangle=100))
    ranking, out = advice_tables(found)
    rows = json.loads(ranking.render("json"))
    assert [(row["rank"], row["kernel"], row["bytes"]) for row in rows] == [
        (1, "light", 64),
        (2, "plain", 48),
    ]
    assert rows[0]["whole_ns"] == pytest.approx(9 + 0.4, rel=0.01)
    assert rows[0]["preparation_ns"] == 40 and rows[1]["preparation_ns"] == 0
    assert rows[1]["ratio_low"] < 10 / 9.4 < rows[1]["ratio_high"]
    reasons = [(row["reason"], row["kernel"]) for row in json.loads(out.render("json"))]
    assert reasons == [("stores more than normal", "heavy"), ("slower", "plain")]
    for form in ("plain", "github", "latex"):
        assert "with preparation" in ranking.render(form)
        assert "heavy" in out.render(form)


def test_the_newest_finished_run_of_each_config_of_this_machine(made, sample_runs, tmp_path):
    machine = {"cpu_model": "mine", "caches": []}
    config = {"config": {"layout": "padded", "name": "same", "kernels": list(THREE)}}
    made(THREE, "old", machine=machine, created="2026-01-01", **config)
    made(THREE, "new", machine=machine, created="2026-01-02", **config)
    made(THREE, "unfinished", machine=machine, finished=None)
    made(THREE, "other config", machine=machine, created="2026-01-03")
    made(THREE, "other machine", machine={"cpu_model": "yours", "caches": []})
    results = tmp_path / "results"
    sample_runs.density_run(results / "pairs", machine=machine)
    (results / "damaged").mkdir()
    (results / "damaged" / "run.json").write_text("{", encoding="utf-8")
    found = [run.name for run in measured_runs(results, machine)]
    assert found == ["other config", "new"]
    assert measured_runs(results, machine, packets=True) == []
    assert measured_runs(results, {"cpu_model": "third", "caches": []}) == []
    # Where no run is over soups, those over pairs are asked.
    alone = tmp_path / "alone"
    sample_runs.density_run(alone / "pairs", machine=machine)
    assert [run.name for run in measured_runs(alone, machine)] == ["pairs"]


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"stored": "nothing"}, "unknown stored 'nothing'"),
        ({"outputs": "uv"}, "unknown outputs 'uv'; did you mean 'tuv'?"),
        ({"precision": "float16"}, "unknown precision 'float16'"),
        ({"hit_ratio": 1.5}, "hit ratio 1.5 is not allowed"),
        ({"hit_ratio": float("nan")}, "hit ratio nan is not allowed"),
        ({"rays_per_triangle": 0.0}, "rays per triangle 0 is not allowed"),
        ({"rays_per_triangle": float("inf")}, "rays per triangle inf is not allowed"),
        ({"triangles": -1}, "triangles -1 is not allowed"),
        ({"triangles": 5, "memory": 0}, "memory 0 is not allowed"),
        ({"memory": 100}, "--triangles"),
    ],
)
def test_questions_that_make_no_sense(asked, said):
    with pytest.raises(RtbenchError) as refused:
        Question(**asked)
    assert said in str(refused.value)
