"""How every chart looks: sizes, a palette for colour-blind eyes and for grey print, and files.

The colours are those of Okabe & Ito 2008 without their yellow, which vanishes on white paper.
Kernels differ in marker and dashes too, so that nothing depends on colour.
"""

import functools
import io
import os
import textwrap
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rtbench.errors import RtbenchError, unknown

FORMATS = ("png", "svg", "pdf")
OKABE_ITO = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
WARNING_COLOR = "#D55E00"
GREY = "#666666"
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p", "h")
DASHES = ("-", (0, (5, 1.6)), (0, (1.2, 1.4)), (0, (6, 1.5, 1.2, 1.5)), (0, (3, 3)))
HATCHES = ("", "///", "...", "\\\\\\", "xxx", "---", "+++", "ooo")

_RC = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same letters on every machine
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "hatch.linewidth": 0.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "errorbar.capsize": 2.2,
    "savefig.dpi": 160,
    "svg.hashsalt": "rtbench",  # without it every file has other ids
    "path.simplify": True,
}
_HEAD_INCHES = 0.36
_LINE_INCHES = 0.165
_POINTS_A_CHARACTER = 4.5  # of the subtitle's 8 points, on average


class Look(NamedTuple):
    """How one kernel is drawn, everywhere in a figure."""

    color: str
    marker: str
    dashes: str | tuple
    hatch: str


def looks(names: Sequence[str]) -> dict[str, Look]:
    """Return a look for each name; the first seven differ in everything, all in something."""
    return {
        name: Look(
            OKABE_ITO[place % len(OKABE_ITO)],
            MARKERS[place % len(MARKERS)],
            DASHES[place % len(DASHES)],
            HATCHES[place % len(HATCHES)],
        )
        for place, name in enumerate(names)
    }


def styled(draw: Callable) -> Callable:
    """Let a function draw with the settings of this module, whatever the user's own are."""

    @functools.wraps(draw)
    def with_settings(*arguments, **options):
        with matplotlib.rc_context():
            matplotlib.rcdefaults()
            matplotlib.rcParams.update(_RC)
            return draw(*arguments, **options)

    return with_settings


def panels(
    rows: int, columns: int, width: float, height: float, **options
) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure with a grid of axes.

    Parameters
    ----------
    rows, columns : int
        The grid.
    width, height : float
        Of the whole figure without its head, in inches.
    **options
        For ``Figure.subplots``.

    Returns
    -------
    Figure
        Without a head; give it one with `head`.
    list of list of Axes
        By row and column.
    """
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    figure.get_layout_engine().set(w_pad=0.06, h_pad=0.06, wspace=0.03, hspace=0.03)
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    return figure, [list(row) for row in axes]


def grid(
    number: int, width: float, height: float, beside: float = 1.9, **options
) -> tuple[Figure, list[Axes]]:
    """Return a figure with a number of like panels, at most three in a row.

    Parameters
    ----------
    number : int
        How many panels.
    width, height : float
        Of one panel, in inches.
    beside : float
        Inches for what stands beside the panels: labels, legend.
    **options
        For ``Figure.subplots``.

    Returns
    -------
    Figure
        As `panels` makes it.
    list of Axes
        One a panel; a legend goes to the last of the first row, ``axes[min(3, number) - 1]``.
    """
    columns = min(number, 3)
    rows = -(-number // columns)
    figure, axes = panels(rows, columns, beside + width * columns, height * rows, **options)
    flat = [panel for row in axes for panel in row]
    for unused in flat[number:]:
        unused.remove()
    return figure, flat[:number]


def head(figure: Figure, title: str, subtitle: str) -> None:
    """Put a title and a smaller subtitle over a figure, which grows by their height.

    Parameters
    ----------
    figure : Figure
        Of `panels`.
    title : str
        What is shown.
    subtitle : str
        Of which kernels, on which machine, between semicolons; wrapped at the figure's width.
    """
    width, height = figure.get_size_inches()
    lines = _wrapped(subtitle, max(int(width * 72 / _POINTS_A_CHARACTER) - 4, 20))
    inches = _HEAD_INCHES + _LINE_INCHES * len(lines)
    total = height + inches
    figure.set_size_inches(width, total)
    figure.get_layout_engine().set(rect=(0, 0, 1, height / total))
    left = 0.1 / width
    figure.text(left, 1 - 0.1 / total, title, size=10.5, weight="bold", va="top")
    figure.text(
        left, 1 - 0.33 / total, "\n".join(lines), size=8, color="#444444", va="top", linespacing=1.3
    )


def _wrapped(text: str, characters: int) -> list[str]:
    """Break a text into lines at its semicolons, within a part only if it is too long alone."""
    lines = [""]
    for part in text.split("; ") if text else []:
        joined = f"{lines[-1]}; {part}" if lines[-1] else part
        if len(joined) <= characters:
            lines[-1] = joined
        else:
            first, *more = textwrap.wrap(part, characters)
            lines += [first, *more] if lines[-1] else []
            lines = lines if lines[-1] else [first, *more]
    return [line for line in lines if line]


def kernel_list(names: Sequence[str]) -> str:
    """Return the kernels in words for a subtitle; more than six are only counted."""
    names = list(names)
    return ", ".join(names) if len(names) <= 6 else f"{len(names)} kernels"


def save(figure: Figure, stem: Path, formats: Iterable[str] = ("png", "svg")) -> list[Path]:
    """Write a figure, the same bytes every time.

    Parameters
    ----------
    figure : Figure
        What to write.
    stem : Path
        The file without suffix; its folder is made if it is not there.
    formats : iterable of str
        Of ``png``, ``svg`` and ``pdf``.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    RtbenchError
        For an unknown format, or if nothing can be written there.
    """
    written = []
    settle(figure)
    for form in formats:
        if form not in FORMATS:
            raise RtbenchError(unknown("plot format", form, FORMATS))
        path = stem.with_name(f"{stem.name}.{form}")
        data = _bytes(figure, form)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            beside = path.with_name(f".{path.name}.{os.getpid()}")
            beside.write_bytes(data)
            beside.replace(path)
        except OSError as error:
            raise RtbenchError(f"cannot write {path}: {error.strerror}") from error
        written.append(path)
    return written


@styled
def settle(figure: Figure) -> None:
    """Lay a figure out until its axes stay: their size decides which ticks fit beside them."""
    for _ in range(2):
        figure.draw_without_rendering()


@styled
def _bytes(figure: Figure, form: str) -> bytes:
    # Dates would make two files of one figure differ.
    dateless = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}
    out = io.BytesIO()
    figure.savefig(out, format=form, metadata=dateless[form])
    return out.getvalue()
