"""Targets: those that run here are timed, the others named, and some always is."""

from rtbench.compiled import targets
from rtbench.experiments.config import Config

WORK = {
    "experiment": "compilers",
    "kernels": ("wald_last_uv",),
    "densities": (0.5,),
    "triangles": 20,
    "rays": 20,
    "repetitions": 2,
    "processes": 1,
    "samples": 1,
}


def test_a_processor_that_runs_no_target_of_the_config_is_timed_as_it_is(go, monkeypatch):
    monkeypatch.setattr(targets, "missing", lambda name: [] if name == "native" else ["avx9"])
    done = go(Config(targets=("avx2", "avx512-512"), flags=("strict", "contract"), **WORK))
    assert set(done.samples["target"]) == {"native"}
    assert set(done.samples["flags"]) == {"strict", "contract"}
    assert [each for each in done.info["remarks"] if "avx9" in each and "avx2" in each]
    assert {each["other_t"] for each in done.info["variants"] if each["flags"] == "strict"} == {0}
