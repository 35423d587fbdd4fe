"""A rendered picture in words: what it took, which rays were shot, what was simulated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rtbench.report.tables import Cell, Table, four_digits

RAYS = ("primary", "shadow", "reflection", "refraction", "indirect")
STAGES = ("compile", "build", "trace")


def stats(
    seconds: Mapping[str, float], rays: Mapping[str, int], effects: Mapping[str, bool]
) -> dict:
    """Return a picture's figures as JSON holds them.

    Parameters
    ----------
    seconds : mapping
        compile, build, trace.
    rays : mapping
        How many were shot, by kind; kinds that are absent count 0.
    effects : mapping
        Whether each effect was simulated.

    Returns
    -------
    dict
        ``seconds``, ``rays`` and ``effects``, each with all its keys.
    """
    return {
        "seconds": {stage: float(seconds[stage]) for stage in STAGES},
        "rays": {kind: int(rays.get(kind, 0)) for kind in RAYS},
        "effects": {effect: bool(simulated) for effect, simulated in effects.items()},
    }


def table(told: Mapping, saved: Mapping[str, int]) -> Table:
    """Return the rays of a picture by kind.

    Parameters
    ----------
    told : mapping
        See `stats`.
    saved : mapping
        Rays that were not shot, by reason.
    """
    total = sum(told["rays"].values())
    trace = told["seconds"]["trace"]
    rows = [
        {"rays": kind, "count": count, "share": _percent(count, total)}
        for kind, count in told["rays"].items()
    ]
    rate = total / trace / 1e6 if trace > 0 else None
    rows.append({"rays": "all", "count": total, "share": _percent(total, total), "rate": rate})
    notes = []
    if any(saved.values()):
        reasons = [f"{why.replace('_', ' ')} {count:,}" for why, count in saved.items() if count]
        notes = ["rays not shot, by reason: " + ", ".join(reasons)]
    headers = {"share": "%", "rate": "Mrays/s"}
    return Table("rays", rows, ["rays", "count", "share", "rate"], headers=headers, notes=notes)


def _percent(count: int, total: int) -> Cell:
    if not total:
        return Cell(None, "")
    return Cell(100 * count / total, f"{100 * count / total:.1f}")


def lines(
    told: Mapping,
    called_for: Mapping[str, str | None],
    without: Iterable[str] = (),
    force: Iterable[str] = (),
) -> list[str]:
    """Return what a person wants to know beside the rays, a line each.

    Parameters
    ----------
    told : mapping
        See `stats`.
    called_for : mapping
        What in the scene calls for each effect; None: nothing does.
    without, force : iterable of str
        Effects left out, and compiled in, on request.
    """
    without, force = set(without), set(force)
    names = list(told["effects"])
    simulated = [name for name in names if told["effects"][name]]
    left_out = [name for name in names if called_for.get(name) and not told["effects"][name]]
    unasked = [n for n in names if not called_for.get(n) and not told["effects"][n]]
    seconds = [f"{stage} {_seconds(told['seconds'][stage])}" for stage in STAGES]
    found = [
        f"seconds: {', '.join(seconds)}",
        "simulated: " + (", ".join(_marked(n, force, called_for) for n in simulated) or "nothing"),
        "not called for: " + (", ".join(unasked) or "nothing"),
    ]
    if left_out:
        found.append("left out though called for: " + ", ".join(left_out))
    return found


def _marked(name: str, force: set[str], called_for: Mapping[str, str | None]) -> str:
    return f"{name} (forced)" if name in force and not called_for.get(name) else name


def _seconds(value: float) -> str:
    return "0" if value == 0 else four_digits(value)
