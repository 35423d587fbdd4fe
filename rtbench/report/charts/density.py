"""Time over density, a line a kernel (Blecha 2007, figures 4.1, 4.2, 4.4); dots at one density."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style

if TYPE_CHECKING:
    from rtbench.records.run import Run

ORDERS = {
    "repeat": "repeat: each pair many times in a row",
    "sweep": "sweep: shuffled pairs, many times over",
    "sorted": "sorted: sweep over pairs by outcome",
    "shuffled": "shuffled: all tests in random order",
}
DENSITY = "density (share of pairs that hit)"
_EMPTY = style.Look(style.GREY, "", (0, (1, 2)), "")
# One axis for all orders only if none of them is squeezed into less than half of it.
_SHARED_UP_TO = 2.0


def density_chart(run: "Run", part: cells.Part) -> Figure:
    """Draw a run's times over density; as dots if there is only one density.

    Parameters
    ----------
    run : Run
        For the title.
    part : Part
        The cells.

    Returns
    -------
    Figure
        A panel an order and precision.
    """
    numbers = [d for d in cells.densities(part.frame) if cells.density_key(d) <= 1]
    return _lines(run, part) if len(numbers) > 1 else _dots(run, part)


@style.styled
def _lines(run: "Run", part: cells.Part) -> Figure:
    frame = part.frame[[cells.density_key(d) <= 1 for d in part.frame["density"]]]
    names = cells.kernels(frame)
    numbers = [float(density) for density in cells.densities(frame)]
    blocks = list(cells.blocks(frame))
    shared = _near([block for _, _, block in blocks])
    columns, rows = _arranged(frame)
    figure, axes = style.panels(
        rows,
        columns,
        1.9 + 2.9 * columns,
        0.4 + max(2.6 * rows, 0.2 * len(names)),
        sharex=True,
        sharey=shared,
    )
    flat = [panel for row in axes for panel in row]
    look = style.looks(names)
    drawn: dict[str, object] = {}
    for panel, (precision, order, block) in zip(flat, blocks, strict=False):
        for name in [*names, cells.EMPTY_LOOP]:
            times = cells.where(block, kernel=name)
            if not len(times):
                continue
            times = times.assign(density=times["density"].astype(float)).sort_values("density")
            empty = name == cells.EMPTY_LOOP
            label = "(empty loop)" if empty else name
            drawn[label] = marks.line(
                panel, times["density"], times, _EMPTY if empty else look[name], label
            )
        seen = frame if shared else block
        marks.from_zero(panel, seen["ns_per_test"].min(), _top(seen))
        panel.set_xlim(-0.04, 1.04)
        panel.grid(axis="y")
        if len(numbers) <= 6:
            panel.set_xticks(numbers)
        _name(panel, flat.index(panel), columns, len(blocks), order, DENSITY)
        if flat.index(panel) % columns == 0:
            several = len(cells.precisions(frame)) > 1
            panel.set_ylabel(f"{precision}: {marks.NS_A_TEST}" if several else marks.NS_A_TEST)
    for unused in flat[len(blocks) :]:
        unused.remove()
    axes[0][-1].legend(
        drawn.values(), drawn.keys(), loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0
    )
    style.head(figure, part.title, subtitle(run, frame))
    return figure


@style.styled
def _dots(run: "Run", part: cells.Part) -> Figure:
    frame = part.frame
    names = cells.kernels(frame)
    shown = names + [name for name in cells.values(frame, "kernel") if name == cells.EMPTY_LOOP]
    blocks = list(cells.blocks(frame))
    columns, rows = _arranged(frame)
    figure, axes = style.panels(
        rows,
        columns,
        2.2 + 3.1 * columns,
        0.2 + (0.65 + 0.29 * len(shown)) * rows,
        sharey=True,
    )
    flat = [panel for row in axes for panel in row]
    look = style.looks(names) | {cells.EMPTY_LOOP: _EMPTY._replace(marker="|")}
    for panel, (precision, order, block) in zip(flat, blocks, strict=False):
        for place, name in enumerate(shown):
            for cell in cells.where(block, kernel=name).to_dict("records"):
                middle, low, high = cell["ns_per_test"], cell["ci_low"], cell["ci_high"]
                marks.dot(panel, middle, low, high, place, look[name])
        marks.category_axis(
            panel, ["(empty loop)" if name == cells.EMPTY_LOOP else name for name in shown]
        )
        marks.from_zero(panel, 0, _top(block), "x")
        _name(panel, flat.index(panel), columns, len(blocks), order, marks.NS_A_TEST)
        if flat.index(panel) % columns == 0 and len(cells.precisions(frame)) > 1:
            panel.set_ylabel(precision)
    for unused in flat[len(blocks) :]:
        unused.remove()
    which = cells.density_words(frame)
    title = f"{part.title}, {which}" if which else part.title
    style.head(figure, title, subtitle(run, frame))
    return figure


def subtitle(run: "Run", frame, amount: bool = True) -> str:
    """Return kernels, precision, amount of work and machine of some cells in one line."""
    only = cells.precisions(frame)
    words = [
        style.kernel_list(cells.kernels(frame)),
        only[0] if len(only) == 1 else "",
        machine.work(run) if amount else "",
        machine.processor(run),
        marks.INTERVAL_NOTE if frame["ci_low"].notna().any() else "no intervals",
    ]
    return "; ".join(word for word in words if word)


def _arranged(frame) -> tuple[int, int]:
    """Return columns and rows: an order a column, two where there are more than three."""
    blocks = len(list(cells.blocks(frame)))
    orders = max(len(cells.orders(frame)), 1)
    columns = orders if orders <= 3 else 2
    return columns, -(-blocks // columns)


def _name(panel, place: int, columns: int, number: int, order, below: str) -> None:
    """Write the order over a panel, unless the panel above says it, and the unit below."""
    if place < columns or columns == 2:
        panel.set_title(ORDERS.get(order, order) or "")
    if place + columns >= number:
        panel.set_xlabel(below)
        panel.tick_params(labelbottom=True)


def _top(frame) -> float:
    return float(frame[["ns_per_test", "ci_high"]].astype(float).max().max())


def _near(blocks) -> bool:
    tops = [_top(block) for block in blocks]
    return max(tops) <= _SHARED_UP_TO * min(tops)
