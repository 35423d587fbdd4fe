"""Tables of adaptive subsampling, and of the shadow cache, first hits by rasterising, threads."""

import math
from typing import TYPE_CHECKING

from rtbench.records.resampling import Estimate
from rtbench.report import machine
from rtbench.report.digits import interval, measured
from rtbench.report.tables import Cell, Table
from rtbench.report.techniques import (
    CACHE,
    FIRST_HIT,
    NONE,
    Group,
    Techniques,
    Ways,
    psnr,
    root_mean_square,
    traced,
)

if TYPE_CHECKING:
    from rtbench.records.run import Run


def _load(run: "Run") -> str:
    """Return how busy the machine was, in words."""
    before = (run.info.get("load") or {}).get("before") or {}
    after = (run.info.get("load") or {}).get("after") or {}
    told = [each.get("loadavg") for each in (before, after)]
    first = [each[0] if isinstance(each, list | tuple) else each for each in told]
    if not all(isinstance(each, int | float) for each in first):
        return ""
    cores = (run.info.get("machine") or {}).get("cores_usable")
    beside = f" on {cores} cores" if isinstance(cores, int) else ""
    return f"load of the machine before and after: {first[0]:.1f}, {first[1]:.1f}{beside}"


def _notes(run: "Run", *notes: str) -> list[str]:
    return [note for note in (*notes, _load(run), machine.provenance(run)) if note]


def _ratio(row: dict, name: str, estimate: Estimate | None) -> None:
    """Put a ratio and its interval into a row."""
    if estimate is None:
        return
    ends = estimate.interval() or (None, None)
    row[name] = measured(estimate.value, *ends, most=2)
    row[f"{name}_low"], row[f"{name}_high"] = ends
    row[f"{name}_interval"] = interval(estimate.value, *ends, most=2)


def _share(value: float, digits: int = 1) -> Cell:
    return Cell(value, f"{100 * value:.{digits}f} %")


def _plain(value: float) -> Cell:
    return Cell(value, f"{value:g}")


def _db(mean_square: float) -> Cell:
    value = psnr(mean_square)
    return Cell(
        value if math.isfinite(value) else None, "equal" if value == math.inf else f"{value:.1f}"
    )


def subsampling_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``subsampling``: two a kernel and precision.

    Parameters
    ----------
    run : Run

    Returns
    -------
    list of Table
        Scene by scene with the first grid, csv and json with all of them; and all grids, means
        over the scenes.
    """
    ways = Ways(run)
    found = []
    for number, group in enumerate(ways.groups):
        suffix = "" if len(ways.groups) == 1 else f"-{number + 1}"
        head = f"{group[0]}, {group[1]}"
        found += [
            _by_scene(ways, group, f"subsampling{suffix}", head),
            _by_grid(ways, group, f"subsampling-grids{suffix}", head),
        ]
    return [table for table in found if table.rows]


def _row(ways: Ways, group: Group, scene: str, way: tuple) -> dict | None:
    told = ways.row(group, scene, way)
    if told is None:
        return None
    row = {"scene": scene, "grid": way[0], "tolerance": _plain(way[1]), "interpolation": way[2]}
    _ratio(row, "faster", ways.faster(group, scene, way))
    _ratio(row, "cpu", ways.faster(group, scene, way, cpu=True))
    rms = root_mean_square(told["mean_square"])
    row |= {
        "traced": _share(traced(told)),
        "rays": _share(told["rays"] / told["rays_full"]),
        "rms": Cell(rms, f"{rms:.2f}"),
        "psnr": _db(told["mean_square"]),
        "ssim": Cell(told["ssim"], f"{told['ssim']:.4f}"),
        "greatest": Cell(255 * told["greatest"], f"{255 * told['greatest']:.0f}"),
        "seen": _share(told["above_two_steps"], 2),
    }
    return row


_ERRORS = ("rms", "psnr", "ssim", "greatest", "seen")
_HEADERS = {
    "faster": "times as fast",
    "faster_interval": "95 %",
    "cpu": "CPU time",
    "cpu_interval": "95 %",
    "traced": "pixels traced",
    "rms": "RMS error",
    "psnr": "PSNR (dB)",
    "ssim": "SSIM",
    "seen": "above 2 steps",
}
_MEANING = (
    "one ray a pixel; times as fast: time of the full picture over the subsampled one's, paired "
    "by rounds; CPU time: the same",
    "of the processor's time; rays: of all kinds, beside the full picture's; above 100 % where "
    "corners on the rims of tiles",
    "are traced twice; RMS error, greatest: steps of 8 bits (1/255) as a display shows them; above "
    "2 steps: share of pixels",
    "tolerance 0 fills cells whose four corners are equal: its error is what lies inside such "
    "cells and was missed",
)


def _by_scene(ways: Ways, group: Group, name: str, head: str) -> Table:
    grid, interpolation = ways.grids[0], ways.interpolations[0]
    every = [
        row
        for each in ways.grids
        for way in ways.interpolations
        for scene in ways.scenes(group)
        for tolerance in ways.tolerances
        if (row := _row(ways, group, scene, (each, tolerance, way)))
    ]
    rows = [r for r in every if (r["grid"], r["interpolation"]) == (grid, interpolation)]
    intervals = any(row.get("faster_interval") for row in rows)
    columns = ["scene", "tolerance", "faster", *(["faster_interval"] if intervals else [])]
    columns += ["cpu", *(["cpu_interval"] if intervals else []), "traced", "rays", *_ERRORS]
    raw = ["scene", "grid", "interpolation", "tolerance"]
    raw += [f"{each}{end}" for each in ("faster", "cpu") for end in ("", "_low", "_high")]
    raw += ["traced", "rays", *_ERRORS]
    sizes = ", ".join(
        f"{scene} {ways.facts[scene]['width']}x{ways.facts[scene]['height']}"
        for scene in ways.scenes(group)
    )
    notes = _notes(ways.run, *_MEANING, f"pixels: {sizes}; all grids: csv and json")
    title = f"Adaptive subsampling, grid {grid}, {interpolation}; {head}"
    return Table(name, rows, columns, title, raw, every, _HEADERS, notes)


def _by_grid(ways: Ways, group: Group, name: str, head: str) -> Table:
    rows = []
    for grid in ways.grids:
        for tolerance in ways.tolerances:
            row = {"grid": grid, "tolerance": _plain(tolerance)}
            for place, interpolation in enumerate(ways.interpolations):
                faster, told = ways.mean(group, (grid, tolerance, interpolation))
                if told is None:
                    continue
                if place == 0:
                    _ratio(row, "faster", faster)
                    way = (grid, tolerance, interpolation)
                    _ratio(row, "cpu", ways.mean(group, way, cpu=True)[0])
                    row |= {"traced": _share(told["traced"]), "rays": _share(told["rays"])}
                rms = root_mean_square(told["mean_square"])
                row[f"rms_{interpolation}"] = Cell(rms, f"{rms:.2f}")
                row[f"seen_{interpolation}"] = _share(told["above_two_steps"], 2)
            rows.append(row)
    if len(rows) < 2:
        rows = []
    intervals = any(row.get("faster_interval") for row in rows)
    errors = [f"{kind}_{each}" for each in ways.interpolations for kind in ("rms", "seen")]
    columns = ["grid", "tolerance", "faster", *(["faster_interval"] if intervals else [])]
    columns += ["cpu", *(["cpu_interval"] if intervals else []), "traced", "rays", *errors]
    raw = ["grid", "tolerance"]
    raw += [f"{each}{end}" for each in ("faster", "cpu") for end in _ENDS]
    raw += ["traced", "rays", *errors]
    headers = _HEADERS | {f"rms_{each}": f"RMS {each}" for each in ways.interpolations}
    headers |= {f"seen_{each}": f"above 2, {each}" for each in ways.interpolations}
    notes = _notes(
        ways.run,
        f"means over the scenes: geometric of times as fast ({ways.interpolations[0]}), of squared "
        "errors, of shares",
    )
    title = f"Adaptive subsampling by grid; {head}"
    return Table(name, rows, columns, title, raw, [], headers, notes)


def techniques_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``techniques``.

    Parameters
    ----------
    run : Run

    Returns
    -------
    list of Table
        One a kernel and precision, and what the thesis states.
    """
    techniques = Techniques(run)
    found = []
    for number, group in enumerate(techniques.groups):
        suffix = "" if len(techniques.groups) == 1 else f"-{number + 1}"
        found.append(_techniques(techniques, group, f"techniques{suffix}"))
    told = run.info.get("statements") or []
    columns = ["section", "statement", "verdict", "number"]
    title = "What Šilhavý 2010 states of these, on this machine"
    found.append(Table("statements", told, columns, title))
    return [table for table in found if table.rows]


def _techniques(techniques: Techniques, group: Group, name: str) -> Table:
    rows = []
    several = techniques.threads if techniques.free_cores else []
    for scene in techniques.scenes(group):
        fact, rays = techniques.facts[scene], techniques.rays(group, scene)
        row = {"scene": scene, "primitives": Cell(fact["primitives"], f"{fact['primitives']:,}")}
        row["area_lights"] = fact["area_lights"]
        row["primary"] = _share(rays["primary"] / max(1, sum(rays.values())))
        row["shadow"] = _share(rays["shadow"] / max(1, sum(rays.values())))
        time = techniques.milliseconds(group, scene, (NONE, 1))
        if time is not None:
            row["ms"] = measured(time.value, *(time.interval() or (None, None)))
        for technique in (CACHE, FIRST_HIT):
            _ratio(row, technique, techniques.faster(group, scene, technique))
            _ratio(row, f"{technique}_cpu", techniques.faster(group, scene, technique, cpu=True))
        for threads in several:
            _ratio(row, f"threads_{threads}", techniques.threaded(group, scene, threads))
            of_cpu = techniques.threaded(group, scene, threads, cpu=True)
            _ratio(row, f"threads_{threads}_cpu", of_cpu)
        row["equal"] = techniques.equal(group, scene)
        row |= {f"rays_{kind}": count for kind, count in rays.items()}
        rows.append(row)
    ratios = [CACHE, FIRST_HIT, *(f"threads_{n}" for n in several)]
    ratios = [each for each in ratios if any(row.get(each) for row in rows)]
    columns = ["scene", "primitives", "area_lights", "primary", "shadow", "ms"]
    for each in ratios:
        there = any(row.get(f"{each}_interval") for row in rows)
        for column in (each, f"{each}_cpu"):
            columns += [column, *([f"{column}_interval"] if there else [])]
    columns.append("equal")
    ends = [f"{each}{cpu}{end}" for each in ratios for cpu in ("", "_cpu") for end in _ENDS]
    raw = ["scene", "primitives", "area_lights", "ms", *ends, "equal"]
    raw += [f"rays_{kind}" for kind in techniques.rays(group, "")]
    headers = {"area_lights": "area lights", "ms": "ms ordinary", "equal": "same bits"}
    headers |= {CACHE: "shadow cache", FIRST_HIT: "first hits"}
    headers |= {f"threads_{n}": f"{n} threads" for n in several}
    headers |= {f"{each}{cpu}_interval": "95 %" for each in ratios for cpu in ("", "_cpu")}
    headers |= {f"{each}_cpu": "CPU" for each in ratios}
    busy = ""
    if techniques.threads and not several:
        busy = (
            f"threads are left out: a lone thread had a core for {techniques.running:.0%} of the "
            "time, so none was free for a second one"
        )
    notes = _notes(
        techniques.run,
        busy,
        "ordinary: one thread, neither shadow cache nor first hits by rasterising; a technique's "
        "column: how many times",
        "as fast it makes the picture, paired by rounds, each alone beside ordinary tracing; "
        "threads: beside one thread,",
        "both with the cache; CPU: the same of the processor's time; primary, shadow: share of all "
        "rays",
    )
    title = f"Shadow cache, first hits by rasterising, threads; {group[0]}, {group[1]}"
    return Table(name, rows, columns, title, raw, [], headers, notes)


_ENDS = ("", "_low", "_high")
