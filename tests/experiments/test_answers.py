"""Whether a kernel is right: against answers that are damaged one by one."""

import dataclasses

import numpy as np
import pytest

from rtbench.errors import WrongAnswers
from rtbench.experiments.answers import check
from rtbench.kernels import registry
from rtbench.workloads.pairs import pairs_at_density


@pytest.fixture(scope="module")
def pairs():
    return pairs_at_density(500, 0.5, "pcg64", 11)


@pytest.fixture
def line():
    return registry.find("moller1")


@pytest.mark.parametrize("name", ["moller1", "moller1_uv"])
def test_right_answers_pass(pairs, name):
    kernel = registry.find(name)
    answers = tuple(getattr(pairs, output) for output in kernel.outputs)
    single = tuple(values.astype(np.float32) for values in answers)
    check(kernel, "float32", pairs, pairs.hit, single)
    check(kernel, "float64", pairs, pairs.hit, answers)


@pytest.mark.parametrize("says", [True, False])
def test_one_wrong_answer_is_named(pairs, line, says):
    wrong = np.flatnonzero(pairs.hit != says)[3]
    hit = pairs.hit.copy()
    hit[wrong] = says
    said = f"moller1 in float32 is wrong about 1 of 500 pairs.*pair {wrong}, which it"
    with pytest.raises(WrongAnswers, match=said):
        check(line, "float32", pairs, hit, [np.where(hit, np.nan_to_num(pairs.t), 0)])


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("damage", [lambda t: t * 1.01, lambda t: -t, lambda t: t * np.nan])
def test_a_wrong_t_is_named(pairs, line, precision, damage):
    wrong = np.flatnonzero(pairs.hit & (np.abs(pairs.t) > 0.3))[2]
    t = pairs.t.copy()
    t[wrong] = damage(t[wrong])
    with pytest.raises(WrongAnswers, match=f"t of 1 of 250 hits; the first is pair {wrong}:"):
        check(line, precision, pairs, pairs.hit, [t])


@pytest.mark.parametrize("name", ["u", "v"])
def test_a_wrong_u_or_v_is_named(pairs, name):
    kernel = registry.find("moller1_uv")
    answers = {output: getattr(pairs, output).copy() for output in kernel.outputs}
    wrong = np.flatnonzero(pairs.hit)[7]
    answers[name][wrong] += 0.01
    with pytest.raises(WrongAnswers, match=f"about {name} of 1 of 250 hits; .* pair {wrong}:"):
        check(kernel, "float64", pairs, pairs.hit, tuple(answers.values()))


def test_u_and_v_that_are_exchanged_are_noticed(pairs):
    kernel = registry.find("chirkov_uv")
    with pytest.raises(WrongAnswers, match="about u of 2"):
        check(kernel, "float32", pairs, pairs.hit, (pairs.t, pairs.v, pairs.u))


def test_a_kernel_is_judged_in_its_own_domain(pairs, line):
    length = np.linalg.norm(pairs.end.astype(float) - pairs.orig, axis=1)
    ahead = pairs.hit & (pairs.t > 0)
    between = ahead & (pairs.t < length)
    assert pairs.hit.sum() > ahead.sum() > between.sum() > 0
    ray = dataclasses.replace(line, domain="ray")
    segment = dataclasses.replace(line, domain="segment")
    check(ray, "float32", pairs, ahead, [pairs.t])
    check(segment, "float32", pairs, between, [pairs.t])
    for kernel, hit in ((line, ahead), (ray, pairs.hit), (ray, between), (segment, ahead)):
        with pytest.raises(WrongAnswers):
            check(kernel, "float32", pairs, hit, [pairs.t])


@pytest.mark.parametrize("name", ["moller1_uv", "badouel_uv", "chirkov_uv"])
def test_swapped_u_and_v_are_named(pairs, name):
    kernel = registry.find(name)
    check(kernel, "float32", pairs, pairs.hit, [pairs.t, pairs.u, pairs.v])
    with pytest.raises(WrongAnswers, match=f"{name} in float32 is wrong about u of"):
        check(kernel, "float32", pairs, pairs.hit, [pairs.t, pairs.v, pairs.u])
