"""`rtbench kernels`: what people read, and the bare list that programs read."""

import csv
import io
import json

import pytest
from click.testing import CliRunner

import rtbench
from rtbench.cli.kernels import command
from rtbench.kernels.registry import all_kernels

KERNELS = all_kernels()


def run(*arguments):
    done = CliRunner().invoke(command, arguments)
    assert done.exit_code == 0, done.exception
    return done


def rows(*arguments):
    return list(csv.DictReader(io.StringIO(run(*arguments, "--format", "csv").stdout)))


def test_one_line_a_method_and_a_word_about_the_others():
    listed = rows()
    methods = list(dict.fromkeys(kernel.function.__name__ for kernel in KERNELS.values()))
    assert [row["name"] for row in listed] == methods
    endings = {row["name"]: row["endings"] for row in listed}
    assert (endings["wald"], endings["pluecker"], endings["moller1"]) == ("8", "9", "")
    note = run().stdout.splitlines()[-1]
    assert note.startswith(f"{len(methods)} of {len(KERNELS)} kernels") and "--all" in note


def test_all_lists_every_name():
    assert [row["name"] for row in rows("--all")] == list(KERNELS)
    assert "see --all" not in run("--all").stdout


def test_json_is_the_bare_list_of_everything():
    listed = json.loads(run("--format", "json").stdout)
    assert listed == rtbench.list_kernels() and [k["name"] for k in listed] == list(KERNELS)
    by_name = {kernel["name"]: kernel for kernel in listed}
    wald = by_name["wald_last"]
    assert (wald["stored"], wald["ending"]) == ("precomputed", "last_tuv")
    assert (wald["bytes_per_triangle"], wald["bytes_per_triangle_padded"]) == (48, 48)
    assert by_name["moller1"]["ending"] is None and by_name["keidy_inside"]["domain"] is None


@pytest.mark.parametrize("name", ["wald", "wald_last_uv", "keidy", "keidy_inside"])
def test_a_method_is_shown_with_its_endings_and_outputs(name):
    told = " ".join(run("show", name).stdout.split())
    for kernel in KERNELS[name].function.kernels:
        assert f" {kernel.name}, " in f"{told}, " or f" {kernel.name} " in told
    own = KERNELS[name].function.__name__
    assert f"{own}_hit, {own}_point" in told
    assert (f"{own}_normal" in told) == (own == "keidy")


def test_a_listing_has_neither():
    told = run("show", "moller1").stdout
    assert "forms" not in told and "outputs" not in told
    assert "wald_point: Wald" in run("show", "wald_point").stdout
