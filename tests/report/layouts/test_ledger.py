"""The ledger's tables, of a record made by hand."""

import json

import pytest

from rtbench.report.layouts.ledger import ledger_tables


def effect(key, called, why, seconds, change=0.0, **rest):
    return {
        "key": key,
        "title": key.replace("_", " "),
        "called": called,
        "why": why,
        "neutral": "nothing",
        "along": (),
        "rays": {},
        "saved": {},
        "seconds": seconds if called else 0.0,
        "forced_seconds": seconds,
        "low": seconds - 0.001,
        "high": seconds + 0.002,
        "share": seconds / 0.25,
        "rounds": [(0.25 + seconds, 0.25)] * 6,
        "max_difference": change,
        "same_bits": change == 0,
        **rest,
    }


def record():
    mirror = "material 'mirror' of object 2 has reflection (0.5, 0.25, 0.125) " + "and more " * 5
    return {
        "scene": "two balls",
        "width": 640,
        "height": 480,
        "seconds": 0.375,
        "rays": {"primary": 307_200, "shadow": 12_345_678, "reflection": 1_000, "refraction": 0},
        "saved": {"light_behind": 4_000, "depth": 0},
        "effects": [
            effect("shadows", True, "light 1 casts shadows", 0.125, rays={"shadow": 12_345_678}),
            effect(
                "reflection",
                True,
                mirror,
                0.0625,
                change=0.75,
                rays={"shadow": -7, "reflection": 1_000},
                saved={"depth": 3},
            ),
            effect("dispersion", False, "no glass", 0.0004, along=("refraction",)),
            effect("smooth_normals", False, "none", -0.002, change=0.0, same_bits=False),
        ],
    }


def test_the_tables_are_read_in_a_hundred_columns():
    numbers, because = ledger_tables(record())
    text = numbers.render() + "\n" + because.render()
    assert max(map(len, text.splitlines())) <= 100
    assert "two balls, 640x480: 2 of 4 effects called for, 375.0 ms to trace" in text
    assert " ".join(because.render().split()).count("and more") == 5  # wrapped, not cut
    assert "dispersion: comes and goes with refraction" in text
    assert "12,345,678 to lights" in text and "refracted" not in text.split("the scene's rays")[1]
    assert "not shot: 4,000: the light is behind the surface" in text


def test_each_effect_has_its_numbers():
    lines = ledger_tables(record())[0].render().splitlines()
    found = {line.split("  ")[0]: line.split()[1:] for line in lines if "  " in line}
    reflection = ["yes", "993", "3", "62.5", "[61.5,", "64.5]", "25.0", "0.7500"]
    assert found["reflection"] == reflection
    assert found["dispersion"] == ["no", "0", "0", "0.40", "[-0.60,", "2.40]", "0.2", "0"]
    assert found["smooth normals"][-2:] == ["only", "-0"]


def test_without_intervals_there_is_no_column_of_them():
    made = record()
    for each in made["effects"]:
        each |= {"low": None, "high": None}
    assert "95 %" in ledger_tables(record())[0].render()
    assert "95 %" not in ledger_tables(made)[0].render()


@pytest.mark.parametrize("table", [0, 1])
def test_json_has_all_there_is_to_an_effect(table):
    rows = json.loads(ledger_tables(record())[table].render("json"))
    assert [row["key"] for row in rows] == ["shadows", "reflection", "dispersion", "smooth_normals"]
    assert (rows[1]["rays_shadow"], rows[1]["rays_reflection"], rows[1]["saved_depth"]) == (
        -7,
        1000,
        3,
    )
    assert rows[0]["called"] is True and rows[2]["called"] is False
    assert rows[2]["along"] == "refraction" and rows[2]["seconds"] == 0.0
    assert rows[2]["forced_seconds"] == 0.0004


def test_an_endless_difference_is_told():
    made = record()
    made["effects"][0] |= {"max_difference": float("inf"), "same_bits": False}
    numbers, _ = ledger_tables(made)
    assert "not finite" in numbers.render()
    assert json.loads(numbers.render("json"))[0]["max_difference"] is None


@pytest.mark.parametrize("form", ["github", "latex", "csv"])
def test_every_form_has_the_reasons(form):
    assert "light 1 casts shadows" in ledger_tables(record())[1].render(form)
