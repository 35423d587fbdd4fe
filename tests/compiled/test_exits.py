"""Operations by outcome: counted by hand in the thesis's listing."""

import pytest

from rtbench.compiled.exits import exits
from rtbench.compiled.operations import operations
from rtbench.kernels import registry
from rtbench.kernels.contract import HIT

LISTED = registry.all_kernels()
# moller1: edges 6 sub; P 3 sub 6 mul; det 2 add 3 mul; T 3 sub; u 2 add 3 mul; Q 3 sub 6 mul;
# v 2 add 3 mul; u + v 1 add; t 2 add 4 mul 1 div. The epsilon below zero is a subtraction.
U_OUTSIDE = {"add": 4, "sub": 12, "mul": 12, "div": 0}
HITS = {"add": 9, "sub": 16, "mul": 25, "div": 1}


def only(counts):
    return {name: counts[name] for name in ("add", "sub", "mul", "div")}


def test_moller1_leaves_early_with_fewer_operations():
    found = exits(LISTED["moller1"])
    assert only(found[1]) == U_OUTSIDE
    assert only(found[HIT]) == HITS


@pytest.mark.parametrize("name", ["moller0", "moller1", "moller3", "badouel", "chirkov"])
def test_the_greatest_exit_is_the_greatest_path(name):
    found = exits(LISTED[name])
    whole = operations(LISTED[name])
    for kind in ("add", "sub", "mul", "div", "cond"):
        assert max(counts[kind] for counts in found.values()) == whole[kind]


def test_every_outcome_that_is_returned_by_its_number_has_a_count():
    assert set(exits(LISTED["moller1"])) == set(range(6))
    assert set(exits(LISTED["chirkov"])) == {0, 1}
