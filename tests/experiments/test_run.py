"""A run from config to records: what is in it, and what stops it."""

import json
import os
import shutil
import signal
from pathlib import Path

import pytest

from rtbench.errors import NotComparable, RtbenchError, WrongAnswers
from rtbench.experiments import run
from rtbench.experiments.config import Config
from rtbench.records.store import load_run

TINY = Config(
    kernels=("moller1",),
    densities=(0.3,),
    orders=("repeat", "sweep"),
    triangles=200,
    repetitions=203,
    processes=2,
    samples=3,
)


def children() -> list[int]:
    """Return the processes that this one has started and that still run."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            _, _, rest = status.read_text().rpartition(")")
        except OSError:
            continue
        state, parent = rest.split()[:2]
        if int(parent) == os.getpid() and state != "Z":
            found.append(int(status.parent.name))
    return found


@pytest.fixture
def cut_off(nobody, go):
    """Return the path of a run that was stopped when so much of it was done."""

    class Impatient(nobody):
        def __init__(self, enough):
            self.enough = enough

        def progress(self, fraction):
            if fraction >= self.enough:
                raise KeyboardInterrupt

    def stopped(config=TINY, enough=0.5, **changes):
        with pytest.raises(run.Stopped, match="--resume") as raised:
            go(config, watcher=Impatient(enough), **changes)
        assert raised.value.exit_code == 130
        return Path(str(raised.value).rpartition("--resume ")[2])

    return stopped


@pytest.fixture(scope="module")
def halfway(tmp_path_factory):
    """A run of TINY that was stopped in the middle; to be copied."""
    out = tmp_path_factory.mktemp("halfway")

    class Impatient:
        def say(self, text):
            pass

        plan = say

        def progress(self, fraction):
            if fraction >= 0.5:
                raise KeyboardInterrupt

    with pytest.raises(run.Stopped):
        run.start(TINY, Impatient(), out, "test")
    (path,) = out.iterdir()
    return path


@pytest.fixture
def copied(halfway, tmp_path):
    return Path(shutil.copytree(halfway, tmp_path / halfway.name))


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    """A run of TINY from its start to its end."""

    class Nobody:
        def say(self, text):
            pass

        plan = progress = say

    return run.start(TINY, Nobody(), tmp_path_factory.mktemp("unbroken"), "test")


@pytest.fixture
def resume(nobody):
    return lambda path, watcher=None: run.resume(str(path), watcher or nobody())


def edit(path: Path, change) -> None:
    info = json.loads((path / "run.json").read_text())
    change(info)
    (path / "run.json").write_text(json.dumps(info))


def test_a_run_times_exactly_what_was_asked_for(go, table, substance):
    done = go(TINY)
    assert done.finished and done.info["config"]["repetitions"] == 203
    samples = table(done, "samples.csv")
    whole = [row for row in samples if not row["outcome"]]
    cells = {(row["kernel"], row["order"]) for row in whole}
    assert cells == {(k, o) for k in ("moller1", "empty") for o in ("repeat", "sweep")}
    for kernel, order in cells:
        own = [row for row in whole if (row["kernel"], row["order"]) == (kernel, order)]
        places = sorted((int(row["process"]), int(row["round"])) for row in own)
        assert places == [(process, turn) for process in range(2) for turn in range(3)]
        # 203 in six parts: five of 34 and one of 33.
        assert sorted(int(row["repetitions"]) for row in own) == [33] + [34] * 5
        assert {row["triangles"] for row in own} == {"200"}
    for row in table(done, "summary.csv"):
        assert (row["repetitions"], row["tests"]) == ("203", "40600")
        assert row["hits"] == ("" if row["kernel"] == "empty" else "60")
    assert sum(int(row["count"]) for row in table(done, "outcomes.csv")) == 200
    groups = [row for row in samples if row["outcome"]]
    counts = {row["outcome"]: row["count"] for row in table(done, "outcomes.csv")}
    assert {(row["outcome"], row["triangles"]) for row in groups} == {
        (code, count) for code, count in counts.items() if count != "0"
    }
    assert substance(done)["places"]


def test_the_same_seed_gives_the_same_run_and_another_seed_another(go, substance):
    first, again, other = (substance(go(TINY, seed=seed)) for seed in (5, 5, 6))
    assert first == again
    assert first["workloads"][0]["digest"] != other["workloads"][0]["digest"]
    assert first["hits"] == other["hits"]
    assert first["outcomes"] != other["outcomes"]


def test_derived_tables_are_up_to_date_when_a_run_is_finished(go, monkeypatch):
    done = load_run(go(TINY).path)
    monkeypatch.setattr("rtbench.records.derive.summarise", lambda run: pytest.fail("derived anew"))
    assert len(done.summary) == 4


@pytest.mark.parametrize("enough", [0.01, 0.5, 0.99])
def test_a_stopped_run_is_resumed_to_the_same_end(cut_off, resume, unbroken, substance, enough):
    path = cut_off(enough=enough)
    halfway = load_run(path)
    assert not halfway.finished and children() == []
    assert len(halfway.summary) <= 4
    ended = resume(path)
    assert ended.path == path and ended.finished
    assert substance(ended) == substance(unbroken)
    launches = {int(row) for row in ended.samples["launch"]}
    assert launches == ({0, 1} if len(halfway.samples) else {0})


def test_a_working_set_is_resumed(cut_off, resume, go, substance):
    config = Config(
        experiment="working_set",
        kernels=("moller1",),
        densities=(0.5,),
        orders=("sweep",),
        sizes=(8, 32, 128),
        triangles=32,
        repetitions=60,
        processes=2,
        samples=2,
    )
    assert substance(resume(cut_off(config, 0.6))) == substance(go(config))


def test_a_run_killed_while_it_is_summed_up_is_resumed(
    go, resume, unbroken, substance, tmp_path, monkeypatch
):
    def killed(path):
        raise SystemExit

    with monkeypatch.context() as patch:
        patch.setattr("rtbench.records.run.write_derived", killed)
        with pytest.raises(SystemExit):
            go(TINY)
    (path,) = (tmp_path / "results").iterdir()
    assert not load_run(path).finished
    assert substance(resume(path)) == substance(unbroken)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="finds processes in /proc")
def test_a_killed_worker_ends_the_run_in_one_line_and_it_is_resumed(
    go, resume, nobody, unbroken, substance
):
    class Killer(nobody):
        def progress(self, fraction):
            if fraction > 0.4:
                for worker in children():
                    os.kill(worker, signal.SIGKILL)

    with pytest.raises(RtbenchError, match=r"signal 9.*--resume") as raised:
        go(TINY, watcher=Killer())
    assert "\n" not in str(raised.value)
    assert children() == []
    path = Path(str(raised.value).rpartition("--resume ")[2])
    assert substance(resume(path)) == substance(unbroken)


def test_a_finished_run_is_not_resumed(unbroken, resume):
    with pytest.raises(RtbenchError, match="finished"):
        resume(unbroken.path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda i: i["software"].update(numba="0.1"), "numba.*0.1 then"),
        (lambda i: i["software"].update(python="3.99.0"), "python.*3.99.0 then"),
        (lambda i: i["machine"].update(cpu_model="Z80"), "machine.*Z80 then"),
        (lambda i: i["config"].update(seed=2), "workloads"),
        (lambda i: i["config"].update(densities=[0.4]), "workloads"),
        (lambda i: i["config"].update(densities=[0.3, 0.4]), "workloads"),
        (lambda i: i["config"].update(layout="own"), "workloads|kernels"),
        (lambda i: i["config"].update(kernels=["moller2"]), "outcomes|kernels"),
        (lambda i: i["config"].update(repetitions=999), "plan tests"),
        (lambda i: i["config"].update(orders=["sorted", "sweep"]), "holds samples of"),
        (lambda i: i["config"].update(colour="red"), "unknown key 'colour'"),
        (lambda i: i["config"].update(triangles="many"), "triangles = 'many'"),
        (lambda i: i["plan"].update(cpu=9999), "--cpu 9999"),
        (lambda i: i["kernels"]["moller1"]["float32"].update(source_digest="0"), "kernels"),
    ],
)
def test_a_run_is_not_resumed_under_other_circumstances(copied, resume, change, said):
    path = copied
    before = (path / "samples.csv").read_bytes()
    edit(path, change)
    with pytest.raises(RtbenchError, match=said) as raised:
        resume(path)
    assert raised.value.exit_code == 2 and "\n" not in str(raised.value)
    assert (path / "samples.csv").read_bytes() == before


@pytest.mark.parametrize("key", ["config", "plan"])
def test_a_foreign_run_is_not_resumed(copied, resume, key):
    path = copied
    edit(path, lambda info: info.pop(key))
    with pytest.raises(NotComparable, match="does not say"):
        resume(path)


WRONG = """
from rtbench.kernels.contract import HIT, NO_T, ONE, ZERO, kernel


def difference(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a, b):
    total = ZERO
    for i in range(3):
        total += a[i] * b[i]
    return total


def cross(a, b):
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@kernel(title="own", method="own", domain="line", outcomes=("hit", "miss"), source="{source}")
def own(tri, ray):
    e1 = difference(tri.v1, tri.v0)
    e2 = difference(tri.v2, tri.v0)
    s = difference(ray.orig, tri.v0)
    p = cross(ray.dir, e2)
    inverse = ONE / dot(e1, p)
    u = dot(s, p) * inverse
    q = cross(s, e1)
    v = dot(ray.dir, q) * inverse
    if u < ZERO or v < ZERO or u + v > {limit}:
        return 1, NO_T
    return HIT, dot(e2, q) * inverse
"""


@pytest.fixture
def own(tmp_path):
    """Return a kernel of a user's own, right, or wrong where u + v comes near 1."""

    def written(limit="ONE", name="mine.py"):
        path = tmp_path / name
        path.write_text(WRONG.format(limit=limit, source="a test"))
        return f"{path}:own"

    return written


def test_a_kernel_of_a_users_own_with_loops_and_helpers(go, own, table):
    done = go(TINY, kernels=(own(), "moller1"), orders=("repeat",), precisions=("mixed",))
    hits = {row["kernel"]: row["hits"] for row in table(done, "summary.csv")}
    assert hits == {"own": "60", "moller1": "60", "empty": ""}
    assert done.info["kernels"]["own"]["mixed"]["source_digest"]


def test_a_kernel_that_is_wrong_ends_the_run(go, own, tmp_path):
    with pytest.raises(WrongAnswers) as raised:
        go(TINY, kernels=(own("ONE * 0.9", "wrong.py"),))
    assert raised.value.exit_code == 4 and "\n" not in str(raised.value)
    told = str(raised.value).split()
    # How many: the pairs that hit with 0.9 < u + v, by the workload's own u and v.
    from rtbench.workloads.pairs import pairs_at_density

    pairs = pairs_at_density(200, 0.3, "pcg64", 1)
    wrong = (pairs.hit & (pairs.u + pairs.v > 0.9)).nonzero()[0]
    assert len(wrong) > 1
    assert "own" in told and str(len(wrong)) in told and f"{wrong[0]}," in told
    assert not (tmp_path / "results").exists()


def test_a_kernel_that_no_tolerance_makes_right_is_only_remarked_upon(go, own):
    name = own("ONE * 0.9", "tolerant.py")
    path = Path(name.partition(":")[0])
    path.write_text(path.read_text().replace('domain="line"', 'domain="line", exact=False'))
    remarks = [each for each in go(TINY, kernels=(name,)).info["remarks"] if "wrong" in each]
    assert remarks and all(each.startswith("kernel own in float32 is wrong") for each in remarks)


def test_a_kernel_file_is_found_again_from_another_folder(
    cut_off, resume, own, tmp_path, monkeypatch
):
    own()
    monkeypatch.chdir(tmp_path)
    path = cut_off(kernels=("mine.py:own",))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert resume(path).finished


def test_a_kernel_file_that_was_changed_is_not_resumed(cut_off, own, tmp_path, nobody):
    name = own(name="changed.py")
    path = cut_off(kernels=(name,))
    shutil.copy(tmp_path / "changed.py", tmp_path / "other.py")
    (tmp_path / "other.py").write_text(WRONG.format(limit="ONE * ONE", source="a test"))
    edit(path, lambda info: info["config"].update(kernels=[f"{tmp_path / 'other.py'}:own"]))
    with pytest.raises(RtbenchError, match="kernels"):
        run.resume(str(path), nobody())


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return 1, tri.v0 + ray.nothing[0]", "nothing"),
        ("return 1, ray.dir[0] + 'text'", "kernel 'own' does not compile"),
        ("return 1", "must return"),
        ("return 5 if ray.dir[0] > ZERO else 1, NO_T", "declares only 0 to 1"),
        ("return 1, no_such_name", "no_such_name"),
    ],
)
def test_a_kernel_that_cannot_be_made_is_told_in_one_line(go, tmp_path, body, said):
    head, _, _ = WRONG.format(limit="ONE", source="a test").partition("    e1 = ")
    path = tmp_path / f"bad{abs(hash(body))}.py"
    path.write_text(f"{head}    {body}\n")
    with pytest.raises(RtbenchError, match=said) as raised:
        go(TINY, experiment="outcomes", kernels=(f"{path}:own",))
    assert "\n" not in str(raised.value)
    assert children() == []


def test_nothing_is_begun_where_nothing_can_be_written(go, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setattr(run, "Worker", lambda: pytest.fail("began"))
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(RtbenchError, match="cannot be written"):
            go(TINY, out=out)


def test_bad_input_leaves_no_process_behind(go):
    for changes in (
        {"kernels": ("moler1",)},
        {"triangles": 1},
        {"generator": "msvc", "seed": 1 << 99},
    ):
        with pytest.raises(RtbenchError):
            go(TINY, **changes)
        assert children() == []


def test_what_disturbs_is_remarked_with_its_cure(go, monkeypatch):
    from rtbench.measure import machine

    idle = {"heavy_processes": 0, "busy": 0.0, "steal": 0.0, "sibling_busy": 0.0}
    quiet = machine.load() | idle | {"cpu_pressure": 0.0, "memory_available": 1 << 34}
    monkeypatch.setattr(machine, "load", lambda: quiet | {"loadavg": [9.0, 9.0, 9.0]})
    still = machine.fingerprint() | {"governor": "performance", "turbo": "off"}
    monkeypatch.setattr(machine, "fingerprint", lambda: still)
    work = {"densities": (0.5,), "triangles": 20, "repetitions": 2, "kernels": ("moller1",)}
    assert go(**work).info["remarks"] == []
    monkeypatch.setattr(machine, "fingerprint", lambda: still | {"governor": "powersave"})
    (remark,) = go(**work).info["remarks"]
    assert "powersave" in remark and "cure: " in remark
