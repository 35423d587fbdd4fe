"""A run of packets: every form beside the single rays, each cell told apart, answers checked."""

import csv
import dataclasses
from contextlib import closing

import numpy as np
import pytest

from rtbench.errors import RtbenchError, WrongAnswers
from rtbench.experiments import config, packets
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config

SMALL = Config(
    name="small",
    experiment="packets",
    kernels=("wald_uv", "moller_trumbore_last_whole"),
    densities=(0.5,),
    triangles=40,
    rays=32,
    repetitions=2,
    processes=1,
    samples=2,
    layout="own",
    widths=(16, 4),
    packets=("general", "common"),
    angles=(10.0, 40.0),
)


@pytest.fixture(scope="module")
def bench():
    with closing(Bench(SMALL, lambda text: None)) as made:
        packets.build(made)
        yield made


def cells(bench, **wanted):
    return [
        cell.key
        for cell in bench.cells
        if all(cell.key[name] == value for name, value in wanted.items())
    ]


def test_no_two_cells_share_their_key_and_all_have_the_same_columns(bench):
    keys = [tuple(cell.key[name] for name in packets.CELL) for cell in bench.cells]
    assert len(set(keys)) == len(keys)
    assert {frozenset(cell.key) for cell in bench.cells} == {frozenset(packets.CELL)}


def test_every_form_and_width_stands_beside_the_single_rays(bench):
    for kernel in SMALL.kernels:
        for form in ("rays", "pairs"):
            assert len(cells(bench, kernel=kernel, form=form, width=1)) == 1
        for form in SMALL.forms:
            for width in SMALL.widths:
                assert cells(bench, kernel=kernel, form=form, width=width, layout="blocks")


def test_every_kind_of_packet_is_spread_and_left_early_where_the_kernel_can(bench):
    for packet in SMALL.packets:
        for angle in SMALL.angles:
            here = {"packet": packet, "angle": angle, "width": 16, "form": "rays"}
            assert cells(bench, kernel="wald_uv", exit="any", **here)
            assert cells(bench, kernel="moller_trumbore_last_whole", exit="none", **here)
    assert not cells(bench, kernel="moller_trumbore_last_whole", exit="any")


def test_axes_are_varied_only_where_a_kernel_projects(bench):
    assert {key["axes"] for key in cells(bench, kernel="wald_uv")} == {"stored", "table", "fixed"}
    told = cells(bench, kernel="moller_trumbore_last_whole")
    assert {key["axes"] for key in told} == {"stored"}


def test_a_cell_stands_for_as_many_tests_as_it_has_rays_and_triangles(bench):
    for cell in bench.cells:
        rays, scene = SMALL.rays, SMALL.triangles
        if cell.key["form"] == "pairs":
            assert cell.tests == cell.key["width"]
            continue
        assert cell.count * cell.tests == rays * scene


def test_what_the_estimate_changes_is_told(bench):
    told = bench.facts["estimates"]
    assert [each["kernel"] for each in told] == list(SMALL.kernels)
    for each in told:
        assert each["rays"] == SMALL.rays and each["differ"] <= 1
        assert 0 < each["most"] < 2.0**-20


def test_pairs_in_blocks_share_the_axis_on_which_their_normal_is_greatest(bench):
    drawn = bench.at_density(0.5, 300).pairs
    order = packets.in_blocks(drawn, 16)
    assert len(order) % 16 == 0 and 300 - 3 * 15 <= len(order) <= 300
    assert len(set(order.tolist())) == len(order)
    for block in order.reshape(-1, 16):
        normals = np.cross(drawn.v1[block] - drawn.v0[block], drawn.v2[block] - drawn.v0[block])
        assert len(set(np.abs(normals).argmax(axis=1).tolist())) == 1


def test_lanes_that_say_something_else_stop_the_run():
    given = [np.array([3, -1], np.int32), np.array([1.5, np.nan])]
    same = tuple(each.reshape(1, 2).copy() for each in given)
    packets.must_be_equal({}, same, given)
    other = same[0], np.array([[1.5 + 2.0**-52, np.nan]])
    with pytest.raises(WrongAnswers, match="ray 0"):
        packets.must_be_equal({"kernel": "wald"}, other, given)


def test_a_run_keeps_every_cell(go):
    done = go(dataclasses.replace(SMALL, forms=("rays",), angles=(5.0,), packets=("parallel",)))
    with open(done.path / "summary.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {"form", "width", "packet", "angle", "exit", "reciprocal"} <= set(rows[0])
    assert all(float(row["ns_per_test"]) > 0 for row in rows)
    assert {row["width"] for row in rows} == {"1", "4", "16"}


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("forms", ("ray",), "rays"),
        ("widths", (5,), "16"),
        ("packets", ("all",), "parallel"),
        ("angles", (91.0,), "0 to 90"),
        ("angles", (), "angles is empty"),
    ],
)
def test_what_the_config_does_not_allow_is_told(key, value, told):
    with pytest.raises(RtbenchError, match=told):
        dataclasses.replace(SMALL, **{key: value})


def test_the_shipped_config_asks_of_packets_of_4_8_and_16():
    asked = config.find("havel-5.1.3")
    assert asked.experiment == "packets"
    assert set(asked.widths) == {4, 8, 16}
    assert len(asked.kernels) == 7
