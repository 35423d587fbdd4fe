"""What of a kernel's source is needed, and what it reads from elsewhere."""

import ast
import math
import textwrap

import pytest

from rtbench.compiled import syntax
from rtbench.kernels.contract import EPSILON, HIT, ONE, ZERO
from rtbench.kernels.registry import all_kernels


def needed(source, *after):
    kept, live = syntax.needed(ast.parse(textwrap.dedent(source)).body, set(after))
    return "\n".join(map(ast.unparse, kept)), live


def test_assignments_that_nothing_reads_are_left_out_and_so_is_what_only_they_read():
    assert needed("a = x * x\nb = a + y\nc = y", "c") == ("c = y", {"y"})
    assert needed("a = x\na = a + y", "b") == ("", {"b"})
    assert needed("a = x\na += y\nb += 1", "a") == ("a = x\na += y", {"x", "y"})


def test_an_earlier_value_that_is_assigned_anew_is_left_out():
    assert needed("a = x\na = y", "a") == ("a = y", {"y"})


def test_a_condition_goes_with_its_last_assignment():
    source = """
        if x > 0:
            a = x
        else:
            a = y
            b = z
    """
    assert needed(source, "c") == ("", {"c"})
    assert needed(source, "b") == ("if x > 0:\n    pass\nelse:\n    b = z", {"x", "z", "b"})
    assert needed(source, "a")[1] == {"x", "y"}


def test_what_a_return_reads_is_needed_and_nothing_after_it_is():
    assert needed("a = x\nreturn a\nb = y", "b") == ("a = x\nreturn a", {"x"})
    source = "if x:\n    a = y\n    return a\na = z"
    assert needed(source, "b") == ("if x:\n    a = y\n    return a", {"x", "y", "b"})


def test_a_loop_stays_whole_since_its_next_round_may_read_what_this_one_stored():
    source = "for i in range(n):\n    b = a\n    a = x"
    assert needed(source, "b")[0] == source
    assert needed("a = 1\n" + source, "b")[0] == "a = 1\n" + source


def test_two_names_at_once_stay_as_long_as_one_of_them_is_read():
    assert needed("a, b = x, y", "b") == ("a, b = (x, y)", {"x", "y"})
    assert needed("a = b = x", "c") == ("", {"c"})


def test_the_form_without_u_and_v_is_the_printed_listing():
    """moller1's listing knows inv_det and t after its branches, and neither u nor v."""
    source = ast.unparse(syntax.tree(all_kernels()["moller1"]))
    after = source[source.index("return (5") :].splitlines()[1:]
    assert [line.strip() for line in after] == [
        "inv_det = ONE / det",
        "'division'",
        "t = (e2x * qx + e2y * qy + e2z * qz) * inv_det",
        "return (HIT, t)",
    ]
    assert "inv_area" not in ast.unparse(syntax.tree(all_kernels()["chirkov"]))
    assert "inv_area" in ast.unparse(syntax.tree(all_kernels()["chirkov_uv"]))


def test_the_tree_handed_out_is_not_the_one_of_the_other_form():
    for name in ("chirkov", "chirkov_uv", "chirkov"):
        tree = syntax.tree(all_kernels()[name])
        lengths = {len(n.value.elts) for n in ast.walk(tree) if isinstance(n, ast.Return)}
        assert lengths == {1 + len(all_kernels()[name].outputs)}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("moller1", {"EPSILON": EPSILON, "HIT": HIT, "ONE": ONE, "ZERO": ZERO}),
        ("badouel_uv", {"EPSILON": EPSILON, "HIT": HIT, "ONE": ONE, "ZERO": ZERO}),
        ("chirkov", {"HIT": HIT, "ZERO": ZERO}),
    ],
)
def test_names_from_outside(name, expected):
    found = syntax.outside_names(all_kernels()[name])
    assert math.isnan(found.pop("NO_T"))
    assert found == expected


def test_widening_puts_every_number_that_is_read_into_real_but_no_index():
    source = (
        "def f(tri, ray):\n    x = tri.d * tri.v0[tri.i1] + n[k[0]]\n    y[0] = x\n    return x"
    )
    wide = syntax.widened(ast.parse(source).body[0], frozenset({"d"}))
    assert ast.unparse(wide).splitlines()[1:3] == [
        "    x = REAL(tri.d) * REAL(tri.v0[tri.i1]) + REAL(n[k[0]])",
        "    y[0] = x",
    ]
