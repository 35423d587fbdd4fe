"""Meshes without files: models of a chosen size that stand for kinds of scenes.

The theses' models are files that not everybody has. In their place: ``scanned`` for a scanned
surface, ``even`` for triangles spread evenly, ``robots`` for dense objects in a scene that is
nearly empty, ``stairs`` for buildings, whose triangles lie in planes of the axes and meet there.
All are made of numbers that float32 can hold, and are the same on every machine up to what sine and
cosine differ by there.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.workloads.meshes import MODELS as MODELS_FOLDER
from rtbench.workloads.meshes import Mesh, load_mesh, models

TRIANGLES = 100_000
LEAST, MOST = 1_000, 20_000_000  # triangles of a model


def even(triangles: int = TRIANGLES, seed: int = 1) -> Mesh:
    """Return triangles of one size spread evenly over a cube, turned at random: one a cell.

    Parameters
    ----------
    triangles : int
        How many, exactly.
    seed : int

    Returns
    -------
    Mesh
        Without shared vertices.
    """
    random = np.random.default_rng(seed)
    side = int(np.ceil(triangles ** (1 / 3)))
    side += side**3 < triangles
    cells = np.sort(random.permutation(side**3)[:triangles])
    cell = np.stack(np.unravel_index(cells, (side,) * 3), axis=1)
    middle = (cell + random.random((triangles, 3))) / side
    first, second = random.normal(size=(2, triangles, 3))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second -= (first * second).sum(axis=1, keepdims=True) * first
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    angle = np.pi * 2 / 3 * np.arange(3)
    round_it = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
    vertices = (middle[:, None] + 0.4 / side * round_it).reshape(-1, 3)
    return _made("even", vertices, np.arange(3 * triangles).reshape(-1, 3), (0.5, 0.5, 0.5))


def scanned(triangles: int = TRIANGLES, seed: int = 1) -> Mesh:
    """Return a closed bumpy surface with noise, of small triangles of similar sizes.

    Parameters
    ----------
    triangles : int
        How many, within a few per cent.
    seed : int

    Returns
    -------
    Mesh
        About 1 from (0, 0, 0), everywhere seen from there.
    """
    unit, faces = _ball(triangles)
    random = np.random.default_rng(seed)
    radius = np.ones(len(unit))
    for size in (1, 1, 1, 2, 2, 3, 4, 5, 8, 13, 21, 34, 55):
        way = random.normal(size=3)
        way *= 2.5 * size / np.linalg.norm(way)
        radius += 0.11 / size * np.sin(unit @ way + random.uniform(0, 2 * np.pi))
    spacing = np.sqrt(4 * np.pi / len(unit))
    radius += 0.05 * spacing * random.normal(size=len(unit))
    return _made("scanned", unit * radius[:, None], faces, (0, 0, 0))


FLOOR = 40.0  # m
# Parts of a robot in m: shape, middle, half its size, share of the triangles; y is up.
PARTS = (
    ("box", (0, 1.10, 0), (0.28, 0.32, 0.17), 0.22),
    ("ball", (0, 1.63, 0), (0.17, 0.17, 0.17), 0.24),
    ("tube", (-0.38, 1.10, 0), (0.07, 0.34, 0.07), 0.10),
    ("tube", (0.38, 1.10, 0), (0.07, 0.34, 0.07), 0.10),
    ("tube", (-0.14, 0.42, 0), (0.09, 0.36, 0.09), 0.10),
    ("tube", (0.14, 0.42, 0), (0.09, 0.36, 0.09), 0.10),
    ("box", (-0.14, 0.05, 0.06), (0.09, 0.05, 0.16), 0.07),
    ("box", (0.14, 0.05, 0.06), (0.09, 0.05, 0.16), 0.07),
)
STANDING = ((-2.6, 0.4), (-1.1, -1.2), (0.3, 0.6), (1.2, -0.7), (7.5, -6.0))  # x, z on the floor


def robots(triangles: int = TRIANGLES, seed: int = 1) -> Mesh:
    """Return five robots on a floor of two triangles: nearly all of the scene is empty.

    Parameters
    ----------
    triangles : int
        How many, within a few per cent.
    seed : int
        Which way each robot is turned.

    Returns
    -------
    Mesh
        A floor of 40 m by 40 m in the plane y = 0, robots 1.8 m tall near its middle, made of
        closed parts: boxes, whose edges are bevelled, balls, and tubes with their ends.

    Source
    ------
    In place of the scene "robots" of Šilhavý 2010, 5.1, of which only a picture is known.
    """
    end = FLOOR / 2
    vertices = [np.array([[-end, 0, -end], [-end, 0, end], [end, 0, end], [end, 0, -end]])]
    faces, count = [np.array([[0, 1, 2], [0, 2, 3]])], 4
    turns = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(STANDING))
    for (x, z), turn in zip(STANDING, turns, strict=True):
        cosine, sine = np.cos(turn), np.sin(turn)
        turned = np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])
        for shape, middle, half, share in PARTS:
            ball, over = _ball(share * (triangles - 2) / len(STANDING))
            part = ball / _SIZES[shape](ball)[:, None] * half + middle
            vertices.append(part @ turned + (x, 0, z))
            faces.append(over + count)
            count += len(ball)
    return _made("robots", np.concatenate(vertices), np.concatenate(faces), (0, 0.9, 0))


# Of a point: 1 on the surface of the shape. What is divided by it lies there.
_SIZES = {
    "ball": lambda p: np.linalg.norm(p, axis=1),
    "tube": lambda p: np.maximum(np.abs(p[:, 1]), np.hypot(p[:, 0], p[:, 2])),
    "box": lambda p: np.abs(p).max(axis=1),
}


def stairs(triangles: int = TRIANGLES) -> Mesh:
    """Return a staircase, each step cut into squares of two triangles in planes of the axes.

    Parameters
    ----------
    triangles : int
        How many, within a few per cent.

    Returns
    -------
    Mesh
        Steps of 1 by 1 that climb towards -x; all coordinates are whole numbers, vertices are
        shared.
    """
    steps = max(1, round(np.sqrt(triangles / 4)))
    wide = max(1, round(triangles / (4 * steps)))
    # The profile goes up, along, up, along ...
    along = np.arange(2 * steps + 1)
    profile = np.stack([steps - along // 2, (along + 1) // 2], axis=1)
    row, column = np.mgrid[: 2 * steps + 1, : wide + 1]
    vertices = np.stack([profile[row, 0], profile[row, 1], column], axis=2).reshape(-1, 3)
    a = (row * (wide + 1) + column)[:-1, :-1].ravel()
    b, c, d = a + 1, a + wide + 2, a + wide + 1
    faces = np.stack([a, c, b, a, d, c], axis=1).reshape(-1, 3)
    return _made("stairs", vertices, faces, (steps / 2, steps / 2, wide / 2))


MODELS: dict[str, Callable[..., Mesh]] = {
    "even": even,
    "scanned": scanned,
    "robots": robots,
    "uneven": robots,
    "stairs": stairs,
}
"""Models of a chosen size, by name."""


def find_model(
    name: str | os.PathLike,
    triangles: int | None = None,
    drop_invalid: bool = False,
    drop_degenerate: bool = False,
) -> Mesh:
    """Return a mesh by the path of its file, its name among the models, or that of a generated one.

    Parameters
    ----------
    name : str or path
        A file; or the stem of a PLY file in the folder that RTBENCH_MODELS names; or one of MODELS,
        with a number of triangles after a colon if wanted: ``scanned:20000``.
    triangles : int, optional
        Of a generated model that has no number in its name; 100,000 if not given.
    drop_invalid, drop_degenerate : bool
        As `load_mesh` takes them.

    Raises
    ------
    RtbenchError
        In one line: unknown names, with the nearest one; numbers that are not allowed; bad files.
    """
    text = os.fspath(name)
    there = models()
    kind, colon, number = text.partition(":")
    if os.path.isfile(text):
        return load_mesh(text, drop_invalid, drop_degenerate)
    if kind in MODELS:
        if colon:
            number = number.replace("_", "").replace(",", "")
            if not number.isdecimal() or len(number) > 12:
                raise RtbenchError(
                    f"model {text!r}: {number!r} is no number of triangles (example: {kind}:20000)"
                )
            triangles = int(number)
        triangles = TRIANGLES if triangles is None else triangles
        if not LEAST <= triangles <= MOST:
            raise RtbenchError(
                f"model {kind!r} of {triangles} triangles is not to be had (allowed: {LEAST} to "
                f"{MOST})"
            )
        return MODELS[kind](triangles)
    path = there.get(text, Path(text))
    if not (os.path.exists(path) or path.suffix or len(path.parts) > 1):
        hint = "" if there else f"; {MODELS_FOLDER} names no folder of mesh files"
        raise RtbenchError(unknown("model", kind, [*there, *MODELS]) + hint)
    return load_mesh(path, drop_invalid, drop_degenerate)


def _ball(triangles: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a sphere of about so many triangles of similar size, in rings from pole to pole."""
    # Equal sides need rings as far apart as sqrt(3) / 2 of the spacing along them.
    rings = max(2, round(np.sqrt(np.pi * np.sqrt(3) * triangles / 16)))
    theta = np.pi * np.arange(1, rings + 1) / (rings + 1)
    # A ring of m is met by m triangles from either side.
    counts = np.sin(theta) * triangles / (2 * np.sin(theta).sum())
    counts = np.maximum(3, np.round(counts)).astype(np.int64)
    starts = 1 + np.concatenate([[0], np.cumsum(counts)])
    phi = 2 * np.pi * (np.arange(starts[-1] - 1) - np.repeat(starts[:-1] - 1, counts))
    phi /= np.repeat(counts, counts)
    sine, cosine = (np.repeat(f(theta), counts) for f in (np.sin, np.cos))
    unit = np.stack([sine * np.sin(phi), cosine, sine * np.cos(phi)], axis=1)
    unit = np.concatenate([[[0, 1, 0]], unit, [[0, -1, 0]]])
    faces = [_fan(0, starts[0], counts[0]), _fan(len(unit) - 1, starts[-2], counts[-1])[:, ::-1]]
    for k in range(rings - 1):
        faces.append(_strip(starts[k], counts[k], starts[k + 1], counts[k + 1]))
    return unit, np.concatenate(faces)


def _fan(pole: int, start: int, count: int) -> np.ndarray:
    each = np.arange(count)
    return np.stack([np.full(count, pole), start + each, start + (each + 1) % count], axis=1)


def _strip(upper: int, many: int, lower: int, few: int) -> np.ndarray:
    """Return the triangles between two rings: sides in the order in which their middles come."""
    a, b = np.arange(many), np.arange(few)
    # Middles (i + 1/2) / n, multiplied out: ties are ties, and go to the upper ring.
    upper_middle, lower_middle = (2 * a + 1) * few, (2 * b + 1) * many
    across = lower + np.searchsorted(lower_middle, upper_middle, "left") % few
    back = upper + np.searchsorted(upper_middle, lower_middle, "right") % many
    above = np.stack([upper + a, across, upper + (a + 1) % many], axis=1)
    below = np.stack([lower + b, lower + (b + 1) % few, back], axis=1)
    return np.concatenate([above, below])


def _made(name: str, vertices: np.ndarray, faces: np.ndarray, centre: tuple) -> Mesh:
    vertices = np.asarray(vertices, dtype=np.float64)
    mesh = Mesh(name, vertices, faces.astype(np.int64), np.asarray(centre, dtype=np.float64))
    return mesh.rounded(np.float32)
