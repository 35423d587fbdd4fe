"""What an ending does to a method's speed (Havel 2008, illustrations 7 and 8): a mark an ending."""

from typing import TYPE_CHECKING, NamedTuple

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rtbench.report import cells, machine
from rtbench.report.charts import marks, style
from rtbench.report.charts.rates import (
    SPEED,
    Group,
    groups_of,
    hit_ratio,
    label_rows,
    rates,
    work_of,
)
from rtbench.report.methods import ALL_TESTED, TESTED_FIRST, Method, variants

if TYPE_CHECKING:
    from rtbench.records.run import Run

AS_TESTED = "as tested"
_DIVISIONS = {"first": style.OKABE_ITO[0], "last": style.OKABE_ITO[1]}
_TESTED = {
    AS_TESTED: ("o", style.OKABE_ITO[0]),
    TESTED_FIRST["tuv"]: ("o", style.OKABE_ITO[0]),
    TESTED_FIRST["uvt"]: ("s", style.OKABE_ITO[1]),
    ALL_TESTED: ("D", style.OKABE_ITO[2]),
}
_PITCH = 0.155  # inches a mark
_BAND = "#F4F4F4"


class Kind(NamedTuple):
    """One kind of ending: where the division stands, and what is tested first."""

    division: str
    tested: str

    @property
    def words(self) -> str:
        """The kind as a legend has it."""
        worst = "worst case (nothing skipped)" if self.tested == ALL_TESTED else self.tested
        return f"division {self.division}, {worst}" if self.division else worst


@style.styled
def endings_chart(run: "Run") -> Figure:
    """Draw the speed of every ending of every method.

    Parameters
    ----------
    run : Run
        A run of the experiment ``soup`` in which some method has several endings.

    Returns
    -------
    Figure
        A panel a hit ratio (columns) and precision (rows); a row a method, the fastest at the
        top, and in it a mark an ending. A thin line joins the two that differ in the place of the
        division alone.
    """
    frame = cells.times_of(run)
    groups, forms, ratios = groups_of(run), variants(frame), cells.densities(frame)
    merged = not _orders_differ(groups)
    kinds = _kinds(groups, merged)
    row = _PITCH * len(kinds) + 0.14
    figure, axes = style.panels(
        len(forms),
        len(ratios),
        2.1 + 2.9 * len(ratios),
        (0.6 + row * len(groups)) * len(forms) + 0.2 * -(-len(kinds) // 2),
        sharex=True,
        sharey=True,
    )
    for (form, words), line in zip(forms, axes, strict=True):
        for panel, ratio in zip(line, ratios, strict=True):
            block = cells.where(frame, density=ratio, **form)
            for place, group in enumerate(groups):
                if place % 2 == 0:
                    panel.axhspan(place - 0.5, place + 0.5, color=_BAND, linewidth=0, zorder=0)
                _group(panel, place, group, block, kinds, merged)
            panel.grid(axis="x")
            panel.set_title(", ".join(filter(None, [hit_ratio(run, ratio), words])))
        label_rows(line, groups, [_tag(group, groups, merged) for group in groups])
    speeds = rates(frame)
    top = max(max(cell["middle"], cell["high"]) for cell in speeds)
    marks.from_zero(axes[0][0], min(cell["middle"] for cell in speeds), top, "x")
    for panel in axes[-1]:
        panel.set_xlabel(SPEED)
    handles = [_key(kind, kinds) for kind in kinds]
    figure.legend(handles=handles, loc="outside lower center", ncols=2 if len(kinds) > 3 else 3)
    style.head(figure, str(run.info.get("title") or "Endings"), _subtitle(run, frame, groups))
    return figure


def _orders_differ(groups: list[Group]) -> bool:
    """Whether some method is there both with t first and with u, v first."""
    early = [{m.tested for m in group.methods if m.tested != ALL_TESTED} for group in groups]
    return any(len(orders) > 1 for orders in early)


def _kind(method: Method, merged: bool) -> Kind:
    generated = merged and method.early and method.tested in TESTED_FIRST.values()
    return Kind(method.division, AS_TESTED if generated else method.tested)


def _kinds(groups: list[Group], merged: bool) -> list[Kind]:
    """Return the kinds of endings of a run: as tested before the worst case, first before last."""
    there = {_kind(method, merged) for group in groups for method in group.methods}
    first = list(_TESTED)
    return sorted(
        there,
        key=lambda kind: (
            first.index(kind.tested) if kind.tested in first else -1,
            kind.division,
            kind.tested,
        ),
    )


def _look(kind: Kind, kinds: list[Kind]) -> tuple[str, str, bool]:
    """Return marker, colour and whether the mark is filled."""
    marker, color = _TESTED.get(kind.tested, ("X", style.OKABE_ITO[6]))
    if len({other.division for other in kinds if other.division}) > 1:
        color = _DIVISIONS.get(kind.division, style.GREY)
    return marker, color, kind.tested != ALL_TESTED


def _group(panel, place: int, group: Group, block, kinds: list[Kind], merged: bool) -> None:
    middles = {}
    for method in group.methods:
        kind = _kind(method, merged)
        at = place + (kinds.index(kind) - (len(kinds) - 1) / 2) * 0.84 / len(kinds)
        marker, color, filled = _look(kind, kinds)
        for cell in rates(cells.where(block, kernel=method.kernel)):
            middles[kind] = cell["middle"], at
            bar = panel.errorbar(
                [cell["middle"]],
                [at],
                xerr=marks.errors([cell["middle"]], [cell["low"]], [cell["high"]]),
                color=color,
                marker=marker,
                markerfacecolor=color if filled else "white",
                markersize=5,
                markeredgewidth=1.1,
                elinewidth=1,
                linestyle="none",
                zorder=3,
            )
            bar.set_label(method.kernel)
    for (division, tested), start in middles.items():
        other = middles.get(Kind("last", tested))
        if division == "first" and other:
            ends = zip(start, other, strict=True)
            panel.plot(*ends, color="#8A8A8A", linewidth=0.8, zorder=2)


def _tag(group: Group, groups: list[Group], merged: bool) -> str:
    words = []
    if len({other.stored for other in groups}) > 1 and group.stored:
        words.append(f"stored: {group.stored}")
    if merged:
        orders = {m.tested for m in group.methods if m.tested in TESTED_FIRST.values()}
        all_orders = {m.tested for g in groups for m in g.methods} & set(TESTED_FIRST.values())
        words += sorted(orders) if len(all_orders) > 1 else []
    return "; ".join(words)


def _key(kind: Kind, kinds: list[Kind]) -> Line2D:
    marker, color, filled = _look(kind, kinds)
    return Line2D(
        [],
        [],
        color=color,
        marker=marker,
        markerfacecolor=color if filled else "white",
        markeredgewidth=1.1,
        linestyle="none",
        label=kind.words,
    )


def _subtitle(run: "Run", frame, groups: list[Group]) -> str:
    names = [method.kernel for group in groups for method in group.methods]
    only = cells.precisions(frame)
    words = [style.kernel_list(names), only[0] if len(only) == 1 else ""]
    words += [work_of(run), machine.processor(run)]
    words.append(marks.INTERVAL_NOTE if frame["ci_low"].notna().any() else "no intervals")
    return "; ".join(word for word in words if word)
