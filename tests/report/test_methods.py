import pytest

from rtbench.report.methods import Method, labels, methods_of, storage


def method(base, title, ending="tuv"):
    return Method(base, title, base, ending, "none", "first", True, ("t",))


def test_what_tells_a_method_s_bases_apart_stands_behind_its_name():
    found = labels(
        [
            method("wald", "Wald"),
            method("kensler_shirley", "Kensler-Shirley"),
            method("kensler_shirley_stored", "Kensler-Shirley"),
            method("half_spaces_perpendicular", "Half-spaces"),
            method("pluecker_stored", "Plücker"),
            method("moller_trumbore", "Möller-Trumbore"),
        ]
    )
    assert list(found.values()) == [
        "Wald",
        "Kensler-Shirley",
        "Kensler-Shirley (stored)",
        "Half-spaces (perpendicular)",
        "Plücker (stored)",
        "Möller-Trumbore",
    ]


def test_two_of_one_name_are_called_by_their_bases():
    found = labels([method("moller0", "Möller-Trumbore"), method("moller1", "Möller-Trumbore")])
    assert found == {"moller0": "moller0", "moller1": "moller1"}


def test_a_kernel_that_the_records_do_not_describe_keeps_its_name(make):
    (found,) = methods_of(make("density", processes=1, rounds=1), ["moller1"]).values()
    assert found == Method("moller1", "moller1", "moller1", "", "", "", None, ())


def test_what_is_returned_is_told_where_endings_are_alike(make):
    run = make("soup", bases=("wald",), processes=1, rounds=1)
    run.info["methods"]["wald_last_tuv"] = run.info["methods"]["wald_last_tuv_uv"] | {
        "outputs": ["t"]
    }
    found = methods_of(run, ["wald_last_tuv_uv", "wald_last_tuv"])
    assert [one.ending for one in found.values()] == ["last tuv, t u v", "last tuv, t"]


@pytest.mark.parametrize(("precision", "size"), [("float32", 48), ("float64", 96), ("mixed", None)])
def test_storage_is_that_of_the_precision(make, precision, size):
    run = make("soup", precisions=("float32", "float64"), processes=1, rounds=1)
    assert storage(run, "wald_last_tuv_uv", precision)["bytes_per_triangle"] == size
