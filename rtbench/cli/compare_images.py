"""``rtbench compare-images``: by how much two pictures differ."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import click

from rtbench.cli import options
from rtbench.errors import CheckFailed, RtbenchError, unknown

MEASURES = {  # as --fail-above names them: the attribute of a comparison
    "mse": "mean_square",
    "rms": "root_mean_square",
    "greatest": "greatest",
    "structure": "structural_difference",
    "differing": "differing",
    "one-step": "above_one_step",
    "two-steps": "above_two_steps",
}
CHANNELS = ("red", "green", "blue")
EXAMPLES = """\b
Examples:
  rtbench compare-images before.png after.png
  rtbench compare-images before.npy after.npy --difference difference.png
  rtbench compare-images exact.pfm fast.pfm --space linear --fail-above 0.001
  rtbench compare-images a.png b.png --fail-above two-steps=0.1%
"""


class Limit(click.ParamType):
    """``0.01``, ``greatest=0.01`` or ``two-steps=0.1%``: a measure and what it may be."""

    name = "limit"

    def convert(self, value, param, ctx) -> tuple[str, float]:
        if isinstance(value, tuple):
            return value
        measure, _, text = value.rpartition("=")
        measure = measure or "rms"
        if measure not in MEASURES:
            raise RtbenchError(unknown("measure", measure, MEASURES))
        try:
            limit = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
        except ValueError:
            limit = math.nan
        if not 0 <= limit < math.inf:
            raise RtbenchError(f"--fail-above {value!r}: {text!r} is not a number of 0 or more")
        return measure, limit


@click.command("compare-images", epilog=EXAMPLES)
@click.argument("a", metavar="A", type=click.Path(path_type=Path))
@click.argument("b", metavar="B", type=click.Path(path_type=Path))
@click.option(
    "--space",
    type=click.Choice(["display", "linear"]),
    default="display",
    show_default=True,
    help="Compare what people see (sRGB values), or light.",
)
@click.option(
    "--numbers",
    type=click.Choice(["display", "linear"]),
    default="display",
    show_default=True,
    help="What whole numbers in a file mean: sRGB values, or light.",
)
@click.option(
    "--difference",
    "file",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Also draw the difference: white equal, vermilion B brighter, blue B darker.",
)
@click.option("--gain", type=float, help="Amplify the drawn difference by this.  [default: fits]")
@click.option(
    "--fail-above",
    "limits",
    type=Limit(),
    multiple=True,
    metavar="[MEASURE=]X",
    help=f"Exit with 1 if a measure is above X: rms (the default), {', '.join(MEASURES)}.",
)
@options.table_format
def command(a, b, space, numbers, file, gain, limits, form) -> None:
    """Compare two pictures of one size: mean square, greatest and structural difference.

    They may be of different formats: png, npy and pfm as rtbench writes them, and what other
    programs write (ppm, tga, bmp, jpg, tif ...). Values go from 0 to 1. PSNR is in decibels, its
    peak 1; structural similarity (Wang et al. 2004) is 1 for equal pictures; structure, for
    --fail-above, is 1 less that. A pixel differs if any channel does; a step is 1/255. json is one
    object.
    """
    from rtbench.images.comparison import compare
    from rtbench.images.difference import difference
    from rtbench.images.reading import read
    from rtbench.images.writing import require_writable, write

    if gain is not None and file is None:
        raise RtbenchError("--gain is of the picture that --difference writes: say both")
    if file is not None:
        require_writable(file)
    first, second = read(a, numbers), read(b, numbers)
    found = compare(first, second, space)
    drawn = difference(first, second, space, gain) if file is not None else None
    if drawn is not None:
        write(file, drawn.pixels, f"difference of {a} and {b}, gain {drawn.gain:g}")
        click.echo(
            f"rtbench: written to {file}, gain {drawn.gain:g}: a difference of "
            f"{1 / drawn.gain:.3g} has the full colour",
            err=True,
        )
    click.echo(_told(found, a, b, form))
    above = []
    for measure, limit in limits:
        value = getattr(found, MEASURES[measure])
        if not value <= limit:  # a measure that cannot be had does not pass either
            above.append(f"{measure} {value:.6g} is above {limit:g}")
    if above:
        raise CheckFailed(f"{a} and {b}: {', '.join(above)}")


def _told(found, a: Path, b: Path, form: str) -> str:
    if form == "json":
        facts = {"a": str(a), "b": str(b), **dataclasses.asdict(found)}
        facts |= {
            "structural_difference": found.structural_difference,
            "verdict": found.verdict,
        }
        plain = {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in facts.items()
        }
        return json.dumps(plain, indent=1, ensure_ascii=False)
    from rtbench.report.tables import Table

    return Table(
        "comparison",
        _rows(found),
        ["what", "value", "in words"],
        f"{a} and {b}: {found.width} x {found.height} pixels, {found.space} values",
        raw_columns=["measure", "value"],
        notes=[found.verdict],
    ).render(form)


def _rows(found) -> list[dict]:
    from rtbench.report.digits import frequency
    from rtbench.report.tables import Cell, four_digits

    def number(value: float) -> str:
        # Of pictures that differ by rounding alone, twelve decimals would all be 0.
        return f"{value:.3e}" if 0 < value < 1e-8 else four_digits(value)

    def steps(value: float) -> str:
        # Rounded first: a whole step of 8 bits is one only but for the rounding of the curve.
        return f"{number(round(255 * value, 9) or 255 * value)} steps of 8 bits"

    def share(value: float) -> Cell:
        return Cell(value, f"{frequency(value).text} %")

    row, column, channel = found.greatest_at
    rms, most = found.root_mean_square, found.greatest
    where = f"{steps(most)}; row {row}, column {column}, {CHANNELS[channel]}"
    similarity = found.structural_similarity
    flat = math.isnan(similarity)
    decibels = Cell(found.psnr, "infinite" if math.isinf(found.psnr) else f"{found.psnr:.2f} dB")
    lines = [
        ("equal_bits", "equal to the last bit", found.equal_bits, ""),
        (
            "mean_square",
            "mean square difference",
            Cell(found.mean_square, number(found.mean_square)),
            "",
        ),
        ("root_mean_square", "root mean square", Cell(rms, number(rms)), steps(rms)),
        ("psnr", "peak signal to noise", decibels, "peak 1"),
        ("greatest", "greatest difference", Cell(most, number(most)), where if most else ""),
        (
            "structural_similarity",
            "structural similarity",
            Cell(similarity, "" if flat else f"{similarity:.6f}"),
            "needs 11 x 11 pixels" if flat else "SSIM, 1 for equal pictures",
        ),
        ("differing", "pixels that differ", share(found.differing), "at all"),
        (
            "above_one_step",
            "... by more than 1/255",
            share(found.above_one_step),
            "one step of 8 bits",
        ),
        (
            "above_two_steps",
            "... by more than 2/255",
            share(found.above_two_steps),
            "two steps of 8 bits",
        ),
    ]
    return [
        {
            "measure": measure,
            "what": what,
            "value": value,
            "in words": Cell(words, words or " "),
        }
        for measure, what, value, words in lines
    ]
