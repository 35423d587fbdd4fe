"""Operation counts: the thesis's tables, and kernels small enough to be counted by hand."""

import linecache

import pytest

from rtbench.compiled.operations import OPERATIONS, VECTOR_OPERATIONS, operations
from rtbench.kernels.contract import EPSILON, HIT, NO_T, ONE, ZERO, kernel
from rtbench.kernels.registry import all_kernels
from rtbench.records.store import load_run

PUBLISHED = load_run("blecha-operations").operations.set_index("kernel")


def declared(function):
    """Return the t-only kernel that a function makes."""
    made = kernel(
        title="hand-made",
        method="hand-made",
        domain="line",
        outcomes=("hit", "miss"),
        outputs=("t", "u", "v"),
        source="this test",
    )(function)
    return made.kernels


def counts(function, form=0):
    found = operations(declared(function)[form])
    return tuple(found[name] for name in OPERATIONS), tuple(found[n] for n in VECTOR_OPERATIONS)


def test_the_published_record_has_the_three_methods():
    assert set(PUBLISHED.index) == {"moller1", "badouel", "chirkov"}


@pytest.mark.parametrize("name", PUBLISHED.index)
def test_counts_are_those_of_tables_4_4_4_6_and_4_8(name):
    found = operations(all_kernels()[name])
    assert {n: found[n] for n in OPERATIONS} == PUBLISHED.loc[name, list(OPERATIONS)].to_dict()


@pytest.mark.parametrize("name", PUBLISHED.index)
def test_vector_operations_are_those_of_section_4_5(name):
    found = operations(all_kernels()[name])
    published = PUBLISHED.loc[name, list(VECTOR_OPERATIONS)].dropna()
    assert "dots" in published
    assert {n: found[n] for n in published.index} == published.to_dict()


@pytest.mark.parametrize(
    ("name", "mul", "div"),
    [("moller0", 0, 0), ("moller1", 2, 0), ("badouel", 0, 0), ("chirkov", 5, 1)],
)
def test_u_and_v_cost_what_their_formulas_say(name, mul, div):
    """moller1: two products; badouel has them already; chirkov: 1 / (dd area) and two products."""
    without, with_uv = (operations(all_kernels()[name + ending]) for ending in ("", "_uv"))
    assert with_uv["mul"] - without["mul"] == mul
    assert with_uv["div"] - without["div"] == div


def squared(x):
    return x * x


def root_of_sum(a, b):
    if a < b:
        return squared(a) + squared(b)
    return a + b


def test_calls_of_helpers_are_inlined():
    def calls(tri, ray):
        return HIT, root_of_sum(tri.v0[0], ray.dir[0]) - ONE, NO_T, NO_T

    assert counts(calls)[0] == (1, 1, 2, 0, 1)


def test_the_greatest_number_of_each_operation_may_lie_on_different_paths():
    def forks(tri, ray):
        a = ray.dir[0]
        if a > ZERO:
            return HIT, a * a * a, NO_T, NO_T
        return HIT, a / a + a, NO_T, NO_T

    assert counts(forks)[0] == (1, 0, 2, 1, 1)


def test_each_elif_is_one_condition_more():
    def chain(tri, ray):
        a = ray.dir[0]
        if a > ONE:
            t = a
        elif a < -EPSILON:
            t = a + a
        elif a == ZERO:
            t = a + a + a
        else:
            t = -a
        return HIT, t, NO_T, NO_T

    # The minus of -EPSILON counts, as it does in the thesis; the second one stands on that path.
    assert counts(chain)[0] == (2, 2, 0, 0, 3)


def test_code_after_a_return_counts_only_where_it_is_reached():
    def early(tri, ray):
        a = ray.dir[0]
        if a > ZERO:
            a = a * a
            if a > ONE:
                return 1, NO_T, NO_T, NO_T
        a = a - ONE
        return HIT, a, NO_T, NO_T

    assert counts(early)[0] == (0, 1, 1, 0, 2)


def test_a_conditional_expression_is_a_condition_and_its_dearer_branch():
    def choice(tri, ray):
        a = ray.dir[0]
        return HIT, (a + a + a if a > ZERO else a + a - a), NO_T, NO_T

    assert counts(choice)[0] == (2, 1, 0, 0, 1)


def test_operations_in_place_count():
    def in_place(tri, ray):
        a = ray.dir[0]
        a += ONE
        a *= a
        return HIT, a, NO_T, NO_T

    assert counts(in_place)[0] == (1, 0, 1, 0, 0)


def test_what_only_u_and_v_need_is_not_in_the_form_without_them():
    def both(tri, ray):
        a = ray.dir[0]
        if a > ZERO:
            scale = ONE / a
        else:
            scale = -ONE
            scale = scale / a
        u = a * a
        u = u * scale
        return HIT, a + ONE, u, u - ONE

    assert counts(both)[0] == (1, 0, 0, 0, 0)
    assert counts(both, form=1)[0] == (1, 2, 2, 1, 1)


def test_a_loop_has_no_greatest_number():
    def loops(tri, ray):
        t = ZERO
        for axis in range(3):
            t = t + ray.dir[axis]
        return HIT, t, NO_T, NO_T

    def comprehends(tri, ray):
        return HIT, sum([ray.dir[axis] for axis in range(3)]), NO_T, NO_T

    assert operations(declared(loops)[0]) is None
    assert operations(declared(comprehends)[0]) is None


def test_a_loop_in_a_helper_counts_as_one():
    def calls(tri, ray):
        return HIT, summed(ray), NO_T, NO_T

    assert operations(declared(calls)[0]) is None


def summed(ray):
    t = ZERO
    for axis in range(3):
        t = t + ray.dir[axis]
    return t


def test_vectors_are_counted_once_however_they_stand_together():
    def two_of_each(tri, ray):
        ax = tri.v1[0] - tri.v0[0]
        ay = tri.v1[1] - tri.v0[1]
        az = tri.v1[2] - tri.v0[2]
        bx = tri.v2[0] - tri.v0[0]
        by = tri.v2[1] - tri.v0[1]
        bz = tri.v2[2] - tri.v0[2]
        px = ay * bz - az * by
        py = az * bx - ax * bz
        pz = ax * by - ay * bx
        qx = py * bz - pz * by
        qy = pz * bx - px * bz
        qz = px * by - py * bx
        return HIT, qx * ax + qy * ay + qz * az, NO_T, NO_T

    assert counts(two_of_each)[1] == (2, 2, 1)


def test_a_sum_of_two_products_is_no_dot_product_and_five_differences_are_one_vector():
    def flat(tri, ray):
        ax = tri.v1[0] - tri.v0[0]
        ay = tri.v1[1] - tri.v0[1]
        az = tri.v1[2] - tri.v0[2]
        bx = tri.v2[0] - tri.v0[0]
        by = tri.v2[1] - tri.v0[1]
        return HIT, ax * bx + ay * by - az, NO_T, NO_T

    assert counts(flat)[1] == (1, 0, 0)


def test_counts_do_not_hang_on_the_number_of_paths():
    """Twenty conditions one after the other are a million paths, and a second is enough."""
    lines = ["def many(tri, ray):", "    a = ray.dir[0]"]
    for _ in range(20):
        lines += ["    if a > ZERO:", "        a = a + ONE", "    else:", "        a = a * a"]
    lines.append("    return HIT, a, NO_T, NO_T")
    assert counts(written("\n".join(lines), "many"))[0] == (20, 0, 20, 0, 20)


def written(source, name):
    """Return a function whose source exists nowhere but in linecache, where inspect looks."""
    filename = f"<{name}>"
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    names = {"HIT": HIT, "NO_T": NO_T, "ONE": ONE, "ZERO": ZERO, "__name__": __name__}
    exec(compile(source, filename, "exec"), names)
    return names[name]
