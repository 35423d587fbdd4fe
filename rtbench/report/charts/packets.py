"""Speed of packets (Havel 2008, illustration 6): lanes beside the same kernel one by one."""

from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from rtbench.report import cells, machine, packed
from rtbench.report.charts import marks, style
from rtbench.report.charts.rates import SPEED, hit_ratio
from rtbench.report.methods import labels, methods_of, variants

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

_SHADES = ("#A6A6A6", "#9ED0EE", "#4A9FD4", "#0B5A8C")  # the scalar form, then ever wider
_PITCH = 0.135  # inches a bar
_BETWEEN = 0.15  # and between kernels
_WIDEST = 1.3  # how far an interval may reach beyond the fastest


@style.styled
def packets_chart(run: "Run") -> Figure:
    """Draw the speed of every kernel one by one and in packets of every width.

    Parameters
    ----------
    run : Run
        A run of the experiment ``packets`` with times.

    Returns
    -------
    Figure
        Horizontal bars from 0 with their intervals, a panel a hit ratio (columns) and precision
        (rows): for each kernel, the fastest in the widest packets at the top, a bar a width and,
        hatched, one of the widest with the any-lane exit. Behind the widest stands how many times
        the scalar form's speed it has.
    """
    frame = cells.times_of(run)
    base, forms = packed.base(run, frame), variants(frame)
    ratios = cells.densities(cells.where(frame, form=base["form"]))
    bars = _bars(frame, base)
    names = fastest_first(frame, base)
    gains = packed.Gains(run)
    most = top(_shown(frame, base, bars) or frame.to_dict("records"))
    row = _PITCH * len(bars) + _BETWEEN
    figure, axes = style.panels(
        len(forms),
        len(ratios),
        1.9 + 2.9 * len(ratios),
        (0.55 + row * len(names)) * len(forms) + 0.3,
        sharex=True,
        sharey=True,
    )
    for (form, words), line in zip(forms, axes, strict=True):
        for panel, ratio in zip(line, ratios, strict=True):
            block = cells.where(frame, density=ratio, **form)
            for place, name in enumerate(names):
                _kernel(panel, place, cells.where(block, kernel=name), base, bars, gains, most)
            panel.set_title(", ".join(filter(None, [hit_ratio(run, ratio), words])))
            panel.grid(axis="x")
        name_kernels(line, run, names)
    axes[0][0].set_xlim(0, most * 1.13)
    for panel in axes[-1]:
        panel.set_xlabel(SPEED)
    keys = [Patch(**_fill(bar, bars), label=_words(bar)) for bar in bars]
    figure.legend(handles=keys, loc="outside lower center", ncols=3 if len(ratios) > 1 else 2)
    kind = f"{base['packet']} packets, {base['angle']:g}° wide" if base["packet"] else ""
    style.head(
        figure, str(run.info.get("title") or "Packets"), subtitle(run, frame, kind, _NUMBERS)
    )
    return figure


_NUMBERS = "8.0x: eight times the speed of one by one"


def top(rows: list[dict]) -> float:
    """Return the end of an axis of speeds: no interval, of too few samples, takes it for itself."""
    speeds = [packed.speed(row) for row in rows]
    ends = [max(one.middle, one.high or 0) for one in speeds]
    return min(max(ends), _WIDEST * max(one.middle for one in speeds))


def fastest_first(frame: "DataFrame", base: dict) -> list[str]:
    """Return the kernels by their speed in the base's packets, summed over hit ratios."""
    times = {}
    for name in cells.kernels(frame):
        rows = cells.where(cells.where(frame, kernel=name), **base)
        times[name] = float(rows["ns_per_test"].sum()) if len(rows) else float("inf")
    return sorted(times, key=times.get)


def name_kernels(axes: list[Axes], run: "Run", names: list[str]) -> None:
    """Put the kernels beside the rows of panels that share them, in the words of their methods."""
    marks.category_axis(axes[0], row_names(run, names))
    axes[0].grid(visible=False, axis="y")
    for panel in axes[1:]:
        panel.tick_params(axis="y", length=0)
        panel.spines["left"].set_visible(False)


def row_names(run: "Run", names: list[str]) -> list[str]:
    """Return a label for each kernel: its method, with the ending where a method has several."""
    methods = methods_of(run, names)
    told = labels(list(methods.values()))
    bases = [method.base for method in methods.values()]
    return [
        told[method.base] if bases.count(method.base) == 1 else f"{told[method.base]}: {ending}"
        for method in methods.values()
        for ending in [method.ending]
    ]


def subtitle(run: "Run", frame: "DataFrame", *more: str) -> str:
    """Return kernels, precision, what else is alike, work and machine."""
    only = cells.precisions(frame)
    words = [style.kernel_list(cells.kernels(frame)), only[0] if len(only) == 1 else "", *more]
    words += [packed.work(run), machine.processor(run)]
    words.append(marks.INTERVAL_NOTE if frame["ci_low"].notna().any() else "no intervals")
    return "; ".join(word for word in words if word)


def _bars(frame: "DataFrame", base: dict) -> list[tuple[int, str]]:
    """Return width and exit of each bar that some kernel has."""
    wanted = [(width, "none") for width in packed.widths(frame)]
    wanted += [(width, "any") for width in packed.widths(frame) if width != packed.SCALAR]
    return [
        (width, way)
        for width, way in wanted
        if packed.cell(frame, base, width=width, exit=way) is not None
    ]


def _kernel(
    panel: Axes,
    place: int,
    block: "DataFrame",
    base: dict,
    bars: list,
    gains: packed.Gains,
    most: float,
) -> None:
    thick = _PITCH / (_PITCH * len(bars) + _BETWEEN)
    scalar = packed.cell(block, base, width=packed.SCALAR)
    for number, (width, way) in enumerate(bars):
        found = packed.cell(block, base, width=width, exit=way)
        if found is None:
            continue
        middle, low, high = packed.speed(found)
        at = place + (number - (len(bars) - 1) / 2) * thick
        panel.barh(
            at,
            middle,
            0.9 * thick,
            **_fill((width, way), bars),
            linewidth=0.7,
            xerr=marks.errors([middle], [low], [high]),
            error_kw={"elinewidth": 0.8, "ecolor": "black", "capsize": 1.5},
            label=f"{found['kernel']} {_words((width, way))}",
        )
        if scalar and width == max(bars)[0]:
            panel.annotate(
                f"{gains.of(scalar, found).middle:.1f}x",
                (min(high or middle, most), at),
                xytext=(3, 0),
                textcoords="offset points",
                va="center",
                fontsize=6.5,
                bbox=marks.ON_PAPER if high and high > most else None,
            )


def _fill(bar: tuple[int, str], bars: list) -> dict:
    width, way = bar
    there = sorted({width for width, _ in bars})
    color = _SHADES[min(there.index(width), len(_SHADES) - 1)]
    if way == "any":
        return {"facecolor": "white", "edgecolor": color, "hatch": "/////"}
    return {"facecolor": color, "edgecolor": color}


def _words(bar: tuple[int, str]) -> str:
    width, way = bar
    if width == packed.SCALAR:
        return "one by one, with early exits"
    return f"packets of {width}" + (", any-lane exit" if way == "any" else "")


def _shown(frame: "DataFrame", base: dict, bars: list) -> list[dict]:
    """Return the rows of the summary that are bars in lanes: the scalar form is no faster."""
    parts = [cells.where(frame, **base | {"width": width, "exit": way}) for width, way in bars]
    return [row for part in parts for row in part.to_dict("records")]
