"""What adaptive subsampling saves, and what it costs the picture, over grids and tolerances.

The same picture is traced in full and subsampled, in interleaved rounds. The error is that of the
picture as a display shows it. Nothing of the subsampled picture is right by construction but the
pixels that are traced: these equal the full picture's to the last bit. One ray a pixel, as in the
thesis.

Source: Krupa 2006; Blecha 2007, chapter 5 and appendix A.2 (keys L, X, Y, T, I).
"""

from __future__ import annotations

from rtbench.errors import RtbenchError, unknown
from rtbench.experiments import techniques_rounds, techniques_scenes
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.experiments.techniques_rounds import Cell, Traced
from rtbench.records import schema
from rtbench.records.writer import RunWriter
from rtbench.tracer.options import INTERPOLATIONS, Subsampling

CELL = ("kernel", "precision", "scene", "grid", "tolerance", "interpolation")
PROCESSES, ROUNDS = 3, 2
SAMPLES = 1  # rays a pixel
FULL = {"grid": "full", "tolerance": 0.0, "interpolation": "none"}


def plan(config: Config) -> tuple[int, int]:
    """Return how many processes and rounds there are."""
    return config.processes or PROCESSES, config.samples or ROUNDS


def settings(config: Config) -> list[tuple[Subsampling, bool]]:
    """Return the ways to subsample, and whether each is timed.

    How pixels between are filled hardly takes time, and which are traced does not depend on it:
    the interpolations but the first are timed with the first grid alone.

    Raises
    ------
    RtbenchError
        For grids, tolerances and interpolations that are not allowed, or none.
    """
    for name in ("grids", "tolerances", "interpolations"):
        values = getattr(config, name)
        if not values:
            raise RtbenchError(f"{name} is empty: at least one is needed")
        if len(set(values)) < len(values):
            raise RtbenchError(f"{name} names a value twice: {', '.join(map(str, values))}")
    for each in config.interpolations:
        if each not in INTERPOLATIONS:
            raise RtbenchError(unknown("interpolation", each, INTERPOLATIONS))
    return [
        (
            Subsampling(grid_of(grid), tolerance, interpolation),
            grid == config.grids[0] or interpolation == config.interpolations[0],
        )
        for grid in config.grids
        for interpolation in config.interpolations
        for tolerance in config.tolerances
    ]


def grid_of(text: str) -> tuple[int, int]:
    """Return the pixels along x and y of a grid that is written as 8x4.

    Raises
    ------
    RtbenchError
    """
    across, _, down = text.partition("x")
    if not (across.isdecimal() and down.isdecimal()):
        raise RtbenchError(f"grid {text!r} is not allowed (allowed: as 8x4, of 1, 2, 4, 8, 16)")
    return int(across), int(down)


def cells(config: Config, kernel: str, precision: str) -> list[Cell]:
    """Return the full picture's cell, and those of every way to subsample."""
    form = {"kernel": kernel, "precision": precision}
    found = [Cell(form | FULL, form | {"samples": SAMPLES}, full=True)]
    for way, timed in settings(config):
        told = {
            "grid": "x".join(map(str, way.grid)),
            "tolerance": way.tolerance,
            "interpolation": way.interpolation,
        }
        chosen = told | {"grid": list(way.grid)}
        options = form | {"samples": SAMPLES, "subsampling": chosen}
        found.append(Cell(form | told, options, timed=timed))
    return found


def build(bench: Bench) -> None:
    """Read the scenes, and compile two tracers of each: in full, and subsampling."""
    config = bench.config
    settings(config)
    names = techniques_scenes.names(config.scenes)
    techniques_rounds.prepare(
        bench, names, SAMPLES, lambda scene, kernel, precision: cells(config, kernel, precision)
    )
    bench.tables[schema.SUBSAMPLING] = []


def measure(bench: Bench, writer: RunWriter, watcher) -> None:
    """Trace, compare and time everything; rows and tables are written as they come."""
    full: dict[tuple, int] = {}

    def keep(scene: Traced, cell: Cell, answer: dict) -> None:
        rays = sum(answer["rays"].values())
        form = scene.name, cell.key["kernel"], cell.key["precision"]
        if cell.full:
            full[form] = rays
        row = cell.key | {"scene": scene.name, "picture": answer["digest"]}
        row |= {"width": scene.told["width"], "height": scene.told["height"]}
        row |= {"interpolated": answer["interpolated"], "primary": answer["rays"]["primary"]}
        row |= {"rays": rays, "rays_full": full[form]}
        apart = answer.get("apart")
        bench.tables[schema.SUBSAMPLING].append(row | (apart or {}))

    techniques_rounds.measure(bench, writer, watcher, keep)
