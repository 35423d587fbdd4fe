"""Real time: a camera goes round a scene, and the frames of every variant are timed in turn.

Source: Blecha 2007, chapter 5 and the keys of appendix A.2: C counts objects, D shades, R changes
the ray test, S samples fewer pixels.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.measure.sampler import stopwatch
from rtbench.scenes.model import Camera, Light, Material, Scene, Settings, Sphere, Triangles
from rtbench.tracer.effects import compiled
from rtbench.tracer.options import Options, Subsampling

if TYPE_CHECKING:
    from rtbench.tracer.render import Renderer

KERNELS = ("watertight_safe", "moller1", "badouel", "chirkov")
FRAMES = 60
SEED = 1
DEFAULTS = Options()
MOST_OBJECTS, MOST_FRAMES = 1_000_000, 100_000
SPREAD = (2.5, 97.5)  # percentiles of the frames
# Of the space that a crowd fills, so much is inside its spheres, however many they are.
FILLED = 0.05


@dataclass(frozen=True)
class Variant:
    """One way of tracing one scene.

    Attributes
    ----------
    scene : Scene
    kernel : str
        Of the triangles; empty where there is none: then all kernels are the same.
    subsampling, shading : bool
        Without shading, all effects are left out and primary rays alone are shot.
    options : Options
    """

    scene: Scene
    kernel: str
    subsampling: bool
    shading: bool
    options: Options


def variants(
    scene: Scene, options: Options = DEFAULTS, kernels: Sequence[str] = KERNELS
) -> list[Variant]:
    """Return every combination of kernel, subsampling on and off, and shading on and off.

    Parameters
    ----------
    scene : Scene
    options : Options
        What they share; its subsampling, if any, is the one that is switched on and off.
    kernels : sequence of str

    Returns
    -------
    list of Variant
        The first kernel, every pixel, shaded, comes first.
    """
    has_triangles = any(isinstance(each, Triangles) for each in scene.objects)
    found = []
    for kernel in kernels if has_triangles else kernels[:1]:
        for subsampling in (False, True):
            for shading in (True, False):
                chosen = dataclasses.replace(
                    options,
                    kernel=kernel,
                    subsampling=(options.subsampling or Subsampling()) if subsampling else None,
                )
                chosen = chosen if shading else _unshaded(scene, chosen)
                name = kernel if has_triangles else ""
                found.append(Variant(scene, name, subsampling, shading, chosen))
    return found


def _unshaded(scene: Scene, options: Options) -> Options:
    there = compiled(scene, options.without, options.force)
    left_out = [*options.without, *(effect for effect, is_in in there.items() if is_in)]
    return dataclasses.replace(
        options, depth=0, samples=1, without=tuple(dict.fromkeys(left_out)), force=()
    )


def around(camera: Camera, frames: int) -> list[Camera]:
    """Return the cameras of one full turn round the target, at constant height.

    Parameters
    ----------
    camera : Camera
        The first of them, as it is.
    frames : int
        How many, at equal angles.

    Returns
    -------
    list of Camera
        Turned about the axis through the target along ``up``.
    """
    target = np.asarray(camera.target, np.float64)
    axis = np.asarray(camera.up, np.float64)
    axis = axis / np.linalg.norm(axis)
    arm = np.subtract(camera.position, target)
    along = axis * (arm @ axis)
    out, side = arm - along, np.cross(axis, arm)
    cameras = [camera]
    for frame in range(1, frames):
        angle = 2 * math.pi * frame / frames
        place = target + along + math.cos(angle) * out + math.sin(angle) * side
        cameras.append(dataclasses.replace(camera, position=tuple(map(float, place))))
    return cameras


def crowd(count: int, width: int = 320, height: int = 240) -> Scene:
    """Return a scene of so many objects: spheres and triangles by turns, in a cube.

    Parameters
    ----------
    count : int
        From 1. The objects of a smaller scene are the first of a larger one, but for their size:
        together they always fill the same part of the cube.
    width, height : int
        Of the picture, in pixels.

    Returns
    -------
    Scene
        With a light that casts shadows, highlights, and a third of the objects mirrors.

    Raises
    ------
    RtbenchError
        For a count that is not from 1 to MOST_OBJECTS.
    """
    check_count("objects", count, MOST_OBJECTS)
    random = np.random.Generator(np.random.PCG64(SEED))
    draws = random.random((count, 12))
    radius = (FILLED / count * 3 / (4 * math.pi)) ** (1 / 3)
    objects = []
    for index, draw in enumerate(draws):
        center, material = draw[:3] - 0.5, index // 2 % len(_MATERIALS)
        if index % 2 == 0:
            objects.append(Sphere(material, center=tuple(map(float, center)), radius=radius))
        else:
            corners = center + 2 * radius * (draw[3:] * 2 - 1).reshape(3, 3)
            objects.append(Triangles(material, corners=corners[None], name="triangle"))
    return Scene(
        name=f"crowd of {count:,}",
        camera=Camera(position=(1.1, 0.7, 1.5), angle=38.0, width=width, height=height),
        lights=(Light(position=(3.0, 5.0, 4.0), color=(0.9, 0.9, 0.9)),),
        materials=_MATERIALS,
        objects=tuple(objects),
        background=(0.05, 0.06, 0.09),
        ambient=(0.15, 0.15, 0.15),
        settings=Settings(depth=2),
    )


def _paint(color: tuple[float, float, float], mirror: float = 0.0) -> Material:
    tint = (mirror, mirror, mirror)
    shine = (0.4, 0.4, 0.4)
    return Material(ambient=color, diffuse=color, specular=shine, exponent=40.0, reflection=tint)


_MATERIALS = (_paint((0.8, 0.3, 0.2)), _paint((0.2, 0.4, 0.8)), _paint((0.4, 0.4, 0.4), mirror=0.5))


def check_count(what: str, value: int, most: int) -> None:
    """Raise RtbenchError unless a number is from 1 to the most allowed."""
    if not 1 <= value <= most:
        raise RtbenchError(f"{what} {value} is not allowed (allowed: 1 to {most})")


def orbit(
    scenes: Sequence[Scene],
    options: Options = DEFAULTS,
    kernels: Sequence[str] = KERNELS,
    frames: int = FRAMES,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
    prepared: Callable[[float], None] | None = None,
    make: Callable[[Scene, Options], Renderer] | None = None,
) -> list[dict]:
    """Time the frames of one turn round each scene, in every variant.

    All variants of all scenes take turns frame by frame, and who begins changes from frame to
    frame: what the machine does meanwhile hits all alike. All of a scene see the same views. One
    frame of each goes before, untimed.

    Parameters
    ----------
    scenes : sequence of Scene
    options : Options
        What the variants share.
    kernels : sequence of str
        Of the triangles.
    frames : int
        Of one turn.
    threads : int
    progress, prepared : callable, optional
        Told the fraction done: of the frames, and of the renderers made before them.
    make : callable, optional
        What makes a renderer.

    Returns
    -------
    list of dict
        One a variant: scene, objects, kernel, subsampling, shading, frames; fps (of the median
        frame) with fps_low and fps_high (2.5 and 97.5 % of the frames), fps_least (the slowest
        frame); frame_ms (the median); rays (a frame, mean); speedup: how many times as fast as the
        scene's first variant, view by view, the median.

    Raises
    ------
    RtbenchError
        For a number of frames that is not allowed.
    """
    check_count("frames", frames, MOST_FRAMES)
    if make is None:
        from rtbench.tracer.render import Renderer as make
    chosen = [variant for scene in scenes for variant in variants(scene, options, kernels)]
    renderers = []
    for number, variant in enumerate(chosen):
        renderer = make(variant.scene, variant.options)
        renderer.render(variant.scene.camera, threads=threads)
        renderers.append(renderer)
        if prepared is not None:
            prepared((number + 1) / len(chosen))
    views = {id(scene): around(scene.camera, frames) for scene in scenes}
    seconds = np.zeros((len(chosen), frames))
    rays = np.zeros(len(chosen))
    for frame in range(frames):
        for turn in range(len(chosen)):
            at = (turn + frame) % len(chosen)
            camera = views[id(chosen[at].scene)][frame]
            picture, seconds[at, frame] = stopwatch(
                lambda at=at, camera=camera: renderers[at].render(camera, threads=threads)
            )
            rays[at] += sum(picture.rays.values())
            if progress is not None:
                progress((frame * len(chosen) + turn + 1) / seconds.size)
    return [
        row(variant, seconds[at], rays[at] / frames, seconds[_first(chosen, variant)])
        for at, variant in enumerate(chosen)
    ]


def _first(chosen: list[Variant], variant: Variant) -> int:
    return next(at for at, other in enumerate(chosen) if other.scene is variant.scene)


def row(variant: Variant, seconds: np.ndarray, rays: float, first: np.ndarray) -> dict:
    """Return what the frames of a variant tell; see `orbit`.

    Parameters
    ----------
    variant : Variant
    seconds : (F,) float64 array
        Of each frame.
    rays : float
        A frame, mean.
    first : (F,) float64 array
        Of each frame of the variant that it is compared with.
    """
    low, high = np.percentile(seconds, SPREAD)
    middle = float(np.median(seconds))
    return {
        "scene": variant.scene.name,
        "objects": len(variant.scene.objects),
        "kernel": variant.kernel,
        "subsampling": variant.subsampling,
        "shading": variant.shading,
        "frames": len(seconds),
        "fps": 1 / middle,
        "fps_low": float(1 / high),
        "fps_high": float(1 / low),
        "fps_least": float(1 / seconds.max()),
        "frame_ms": 1e3 * middle,
        "rays": round(rays),
        "speedup": float(np.median(first / seconds)),
    }
