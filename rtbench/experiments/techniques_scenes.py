"""The scenes over which techniques are tried: by name, at a size, with what is known of each."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rtbench.scenes import reading
from rtbench.scenes.model import Scene, Triangles

SPD = ("balls", "gears", "jacks", "teapot", "tetra")  # Haines 1987, as NFF files
FOLDER = "RTBENCH_SCENES"
RAYS = 2_500_000  # of a picture by one ray a pixel: scenes that need more get half the sides
SMALLEST = 64  # pixels along a side that are not halved


def names(wanted: Sequence[str], spd: bool = False) -> tuple[str, ...]:
    """Return the names of scenes: those that are wanted, none: those that come with rtbench.

    Parameters
    ----------
    wanted : sequence of str
    spd : bool
        Whether the Standard Procedural Databases follow, where the environment variable
        RTBENCH_SCENES names their folder.
    """
    found = list(wanted or reading.names())
    folder = os.environ.get(FOLDER)
    if spd and folder:
        paths = [Path(folder) / f"{name}.nff" for name in SPD]
        found += [str(path.resolve()) for path in paths if path.is_file()]
    return tuple(found)


def spoken(name: str) -> str:
    """Return what a scene is called in tables: of a file, its name alone."""
    return Path(name).stem if Path(name).suffix else name


def read(name: str, width: int, height: int) -> Scene:
    """Return a scene at a size.

    Raises
    ------
    RtbenchError
        For scenes that cannot be read.
    """
    scene = reading.read(name)
    return dataclasses.replace(
        scene, camera=dataclasses.replace(scene.camera, width=width, height=height)
    )


def size_of(scene: Scene, width: int, height: int, samples: int) -> tuple[int, int]:
    """Return the size at which a scene's picture is not too slow: halved as often as need be.

    Parameters
    ----------
    scene : Scene
    width, height : int
        As asked for.
    samples : int
        Primary rays a pixel.
    """
    to_lights = sum(light.grid**2 if light.is_area else 1 for light in scene.lights)
    while min(width, height) > SMALLEST and width * height * samples * (1 + to_lights) > RAYS:
        width, height = width // 2, height // 2
    return width, height


def facts(name: str, scene: Scene, width: int, height: int, samples: int) -> dict[str, object]:
    """Return what the records keep of a scene."""
    primitives = sum(
        len(np.asarray(each.corners)) if isinstance(each, Triangles) else 1
        for each in scene.objects
    )
    return {
        "scene": spoken(name),
        "source": name,
        "width": width,
        "height": height,
        "samples": samples,
        "primitives": primitives,
        "lights": len(scene.lights),
        "area_lights": sum(light.is_area for light in scene.lights),
    }
