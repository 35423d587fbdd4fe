"""What a kernel declares, and that it runs as plain Python."""

import math
from types import SimpleNamespace

import pytest

from rtbench.kernels.contract import DOMAINS, HIT, ONE, STORED, kernel
from rtbench.kernels.registry import all_kernels


def declare(function=None, **more):
    told = {
        "title": "hand-made",
        "method": "hand-made",
        "domain": "line",
        "outcomes": ("hit", "miss"),
        "source": "this test",
    }
    return kernel(**(told | more))(function or small)


def small(tri, ray):
    return HIT, ONE, ONE, ONE


def test_the_function_itself_is_left_as_it_is():
    made = declare(small)
    assert made is small
    assert made(None, None) == (0, 1.0, 1.0, 1.0)


def test_one_function_makes_the_form_without_and_the_form_with_u_and_v():
    without, with_uv = declare(outputs=("t", "u", "v")).kernels
    assert (without.name, with_uv.name) == ("small", "small_uv")
    assert (without.outputs, with_uv.outputs) == (("t",), ("t", "u", "v"))
    assert without.title != with_uv.title
    (alone,) = declare(outputs=("t",)).kernels
    assert (alone.name, alone.outputs) == ("small", ("t",))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"domain": "lines"}, "domain 'lines': allowed are line, ray, segment"),
        ({"outputs": ("t", "u")}, "outputs"),
        ({"outputs": ()}, "outputs"),
        ({"outputs": ["t"]}, "outputs"),
        ({"outcomes": ("hit",)}, "outcomes"),
        ({"outcomes": ("hit",) * 101}, "outcomes"),
    ],
)
def test_what_cannot_be_honoured_is_refused(more, message):
    with pytest.raises(ValueError, match=message):
        declare(**more)


def test_names_of_functions_and_arguments():
    def Large(tri, ray):
        return HIT, ONE

    def three(tri, ray, more):
        return HIT, ONE

    with pytest.raises(ValueError, match="kernel name 'Large'"):
        declare(Large)
    with pytest.raises(ValueError, match="'three' must take"):
        declare(three)


@pytest.mark.parametrize("name", all_kernels())
def test_what_is_declared(name):
    chosen = all_kernels()[name]
    assert chosen.name == name and chosen.outcomes[HIT] == "hit" and chosen.source
    assert chosen.domain in (*DOMAINS, None) and chosen.stored in STORED
    assert (chosen.domain == "ray") == chosen.takes_tmax
    assert (chosen.stored == "none") == (chosen.prepare is None)


@pytest.mark.parametrize("name", [n for n, k in all_kernels().items() if k.ending is None])
def test_a_listing_is_plain_python(name):
    """The line along z through the point u = 0.25, v = 0.5 of a triangle in the plane z = 1."""
    chosen = all_kernels()[name]
    tmax = (5.0,) if chosen.takes_tmax else ()
    tri = SimpleNamespace(
        v0=(0.0, 0.0, 1.0),
        v1=(4.0, 0.0, 1.0),
        v2=(0.0, 4.0, 1.0),
        normal=(0.0, 0.0, 1.0),
        d=-1.0,
        i0=2,
        i1=0,
        i2=1,
    )
    ray = SimpleNamespace(orig=(1.0, 2.0, -1.0), end=(1.0, 2.0, 1.0), dir=(0.0, 0.0, 2.0))
    assert chosen.function(tri, ray, *tmax) in ((HIT, 1.0, 0.25, 0.5), (HIT, 1.0))
    ray = SimpleNamespace(orig=(9.0, 9.0, -1.0), end=(9.0, 9.0, 1.0), dir=(0.0, 0.0, 2.0))
    outcome, _, *weights = chosen.function(tri, ray, *tmax)
    assert 0 < outcome < len(chosen.outcomes)
    assert all(map(math.isnan, weights))
