"""``rtbench compare-images``: a table, a picture of the difference, and an exit code."""

import csv
import io
import json

import numpy as np
import pytest
from PIL import Image

from rtbench.images.reading import read
from rtbench.images.writing import write

FORMATS = ("plain", "github", "latex", "csv", "json")


@pytest.fixture
def pictures(rtbench):
    """A grey picture, one that is a step brighter in one pixel, and one half as bright; in here."""
    levels = np.full((20, 30, 3), 100, np.uint8)
    Image.fromarray(levels).save("a.png")
    levels[3, 4, 0] = 101
    Image.fromarray(levels).save("step.png")
    Image.fromarray(levels // 2).save("half.png")
    write("a.npy", read("a.png"))
    return rtbench


def refused(ended, code=2):
    assert ended.code == code
    assert ended.err.startswith("rtbench: ") and ended.err.count("\n") == 1
    return ended.err


def test_the_table_in_words(pictures):
    told = pictures("compare-images", "a.png", "step.png")
    assert (told.code, told.err) == (0, "")
    assert "a.png and step.png: 30 x 20 pixels, display values" in told.out
    assert "cannot be told apart" in told.out
    assert "1.000 steps of 8 bits; row 3, column 4, red" in told.out
    assert "equal to the last bit" in pictures("compare-images", "a.png", "a.npy").out


@pytest.mark.parametrize("form", FORMATS)
def test_every_format(pictures, form):
    told = pictures("compare-images", "a.png", "step.png", "--format", form)
    assert told.code == 0 and told.out.strip()
    by_hand = 1 / 255**2 / 1800
    if form == "json":
        found = json.loads(told.out)
        assert found["mean_square"] == pytest.approx(by_hand)
        assert found["greatest_at"] == [3, 4, 0] and found["equal_bits"] is False
        assert found["psnr"] == pytest.approx(10 * np.log10(1 / by_hand))
    if form == "csv":
        rows = {row["measure"]: row["value"] for row in csv.DictReader(io.StringIO(told.out))}
        assert float(rows["mean_square"]) == pytest.approx(by_hand)
        assert float(rows["differing"]) == pytest.approx(1 / 600)
        assert float(rows["above_one_step"]) == 0


def test_json_has_no_infinity(pictures):
    told = pictures("compare-images", "a.png", "a.png", "--format", "json")
    assert json.loads(told.out, parse_constant=pytest.fail)["psnr"] is None


def test_the_picture_of_the_difference(pictures, tmp_path):
    told = pictures("compare-images", "a.png", "step.png", "--difference", "d.png")
    assert told.code == 0 and "written to d.png, gain 128" in told.err  # 1/255, shown as 128/255
    with Image.open("d.png") as image:
        shown = np.asarray(image)
        assert "gain 128" in image.info["Comment"]
    assert (shown.reshape(-1, 3) != 255).any(axis=1).sum() == 1 and shown[3, 4, 0] > shown[3, 4, 2]
    told = pictures("compare-images", "a.png", "step.png", "--difference", "d.pfm", "--gain", 255)
    assert told.code == 0 and "gain 255" in told.err


@pytest.mark.parametrize(
    ("limit", "code"),
    [
        ("0.0001", 0),
        ("0.00009", 1),  # the root mean square is 1/255/sqrt(1800) = 0.0000924
        ("greatest=0.0039", 1),
        ("greatest=0.004", 0),
        ("differing=0.2%", 0),
        ("differing=0.1%", 1),
        ("two-steps=0", 0),
        ("structure=0.1", 0),
        ("structure=0", 1),
    ],
)
def test_limits(pictures, limit, code):
    told = pictures("compare-images", "a.png", "step.png", "--fail-above", limit)
    assert told.code == code and "what" in told.out
    if code:
        assert "is above" in refused(told, 1)


def test_several_limits_are_told_together_and_what_cannot_be_had_does_not_pass(pictures):
    limits = ("--fail-above", "0", "--fail-above", "greatest=0", "--fail-above", "two-steps=1")
    said = refused(pictures("compare-images", "a.png", "half.png", *limits), 1)
    assert "rms" in said and "greatest" in said and "two-steps" not in said
    write("tiny.npy", np.zeros((2, 2, 3)))
    told = pictures("compare-images", "tiny.npy", "tiny.npy", "--fail-above", "structure=1")
    assert "structure nan is above 1" in refused(told, 1)
    assert "needs 11 x 11 pixels" in told.out


def test_spaces_and_numbers(pictures):
    def greatest(*options):
        told = pictures("compare-images", "a.png", "half.png", "--format", "json", *options)
        return json.loads(told.out)["greatest"]

    assert greatest() == pytest.approx(50 / 255)
    assert greatest("--space", "linear", "--numbers", "linear") == pytest.approx(50 / 255)
    assert greatest("--space", "linear") == pytest.approx(0.127438 - 0.031896, abs=1e-5)


def test_bad_input_is_one_line(pictures):
    def said(*arguments):
        told = pictures("compare-images", *arguments)
        assert told.out == ""
        return refused(told)

    write("small.npy", np.zeros((2, 2, 3)))
    write("nan.npy", np.full((20, 30, 3), np.nan))
    assert "30 x 20 pixels and the second 2 x 2" in said("a.png", "small.npy")
    assert "600 pixels of the second picture are not numbers" in said("a.png", "nan.npy")
    assert "cannot read nowhere.png: No such file" in said("a.png", "nowhere.png")
    assert "unknown suffix of a picture '.jpgg'" in said("a.png", "b.jpgg")
    assert "'dispaly' is not one of" in said("a.png", "a.png", "--space", "dispaly")
    assert "unknown measure 'structur'; did you mean" in said(
        "a.png", "a.png", "--fail-above", "structur=1"
    )
    for wrong in ("", "-1", "nan", "inf", "rms=", "much", "rms=1=2"):
        said("a.png", "a.png", "--fail-above", wrong)
    assert "--gain is of the picture" in said("a.png", "a.png", "--gain", "3")
    assert "gain 0" in said("a.png", "step.png", "--gain", "0", "--difference", "d.png")
    assert "suffix" in said("a.png", "a.png", "--difference", "d.jpeg")
    assert "there is no folder" in said("a.png", "a.png", "--difference", "no/d.png")
    assert "Missing argument" in said("a.png")


def test_the_examples_of_the_help_work(pictures):
    for name in ("before.png", "after.png", "before.npy", "after.npy", "exact.pfm", "fast.pfm"):
        write(name, np.full((12, 12, 3), 0.5))
    write("b.png", np.full((20, 30, 3), 0.5))
    lines = pictures("compare-images", "--help").out.partition("Examples:")[2].strip().splitlines()
    assert len(lines) == 4
    write("a.png", np.full((20, 30, 3), 0.5))
    for line in lines:
        program, *arguments = line.split()
        assert program == "rtbench"
        told = pictures(*arguments)
        assert told.code == 0 and told.out, told.err


def test_no_compiler_is_imported(pictures):
    import subprocess
    import sys

    code = (
        "import sys; sys.argv = ['rtbench', 'compare-images', 'a.png', 'step.png']\n"
        "from rtbench.cli import main\n"
        "try:\n    main()\n"
        "finally:\n    print(sorted({'numba', 'pandas', 'matplotlib'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
