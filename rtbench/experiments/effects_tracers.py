"""Which tracers are compiled for a scene: its own, ones that hold more, and those of the steps."""

from __future__ import annotations

import dataclasses
import math

from rtbench.errors import RtbenchError, unknown
from rtbench.scenes import reading
from rtbench.scenes.model import Scene, Triangles
from rtbench.tracer import effects
from rtbench.tracer.options import KINDS, Options

SPECIALISED, OPTICAL, INNER_LOOP, EVERYTHING = "specialised", "optical", "inner_loop", "everything"
DELETED = "deleted"
PLAIN = "plain"
STEP = "+"  # before the effect that a step adds
TRACERS, STEPS, PROOF = "tracers", "steps", "proof"
PARTS = (TRACERS, STEPS, PROOF)
RAYS_A_PIXEL = 16  # on average; scenes that need more get fewer pixels
SMALLEST = 16  # pixels along a side


def called(scene: Scene) -> tuple[str, ...]:
    """Return the effects that a scene's own tracer holds, in their order."""
    return tuple(name for name, inside in effects.compiled(scene).items() if inside)


def tracers(scene: Scene, parts: tuple[str, ...]) -> list[str]:
    """Return the tracers of a scene that parts of the experiment compare, its own first."""
    found = [SPECIALISED]
    if TRACERS in parts:
        found += [OPTICAL, INNER_LOOP, EVERYTHING]
    if PROOF in parts:
        found.append(DELETED)
    if STEPS in parts:
        found += steps(called(scene))[:-1]  # the last is the scene's own
    return found


def steps(inside: tuple[str, ...]) -> list[str]:
    """Return the names of the steps from rays and Lambert's law alone to all that is inside."""
    return [PLAIN, *(f"{STEP}{name}" for name in inside)]


def options_of(tracer: str, inside: tuple[str, ...], kernel: str, precision: str) -> Options:
    """Return the options by which a tracer is compiled for a scene that calls for ``inside``."""
    given: dict[str, tuple[str, ...]] = {}
    if tracer in (OPTICAL, EVERYTHING):
        given["force"] = tuple(effects.EFFECTS)
    if tracer in (INNER_LOOP, EVERYTHING):
        given["kinds"] = KINDS
    if is_step(tracer):
        reached = steps(inside).index(tracer)
        given["without"] = inside[reached:]
    return Options(kernel=kernel, precision=precision, **given)


def scene_of(name: str, width: int, height: int) -> Scene:
    """Return a scene at a size; one that shoots many rays a pixel has fewer pixels.

    Raises
    ------
    RtbenchError
        For scenes that cannot be read.
    """
    scene = reading.read(name)
    settings, indirect = scene.settings, scene.settings.indirect
    samples = max(settings.samples, indirect.samples if indirect else 1)
    bounces = indirect.depth if indirect else 0
    to_lights = sum(light.grid**2 if light.is_area else 1 for light in scene.lights)
    shrunk = math.sqrt(max(1.0, samples * (1 + to_lights) * (1 + bounces) / RAYS_A_PIXEL))
    width, height = (max(min(side, SMALLEST), int(side / shrunk)) for side in (width, height))
    return dataclasses.replace(
        scene, camera=dataclasses.replace(scene.camera, width=width, height=height)
    )


def code_key(scene: Scene, tracer: str, options: Options) -> str:
    """Return what the code of a tracer depends on: scenes that share it compile once."""
    inside = effects.compiled(scene, options.without, options.force)
    there = [each for each in scene.objects if not isinstance(each, Triangles) or len(each.corners)]
    moves = inside["motion_blur"] and any(any(each.velocity) for each in there)
    kinds = sorted({type(each).__name__ for each in there} | ({"motion"} if moves else set()))
    held = [name for name, yes in inside.items() if yes]
    asked = "all" if options.kinds else kinds
    return repr((tracer == DELETED, held, asked, options.kernel, options.precision))


def is_step(tracer: str) -> bool:
    """Return whether a tracer is a step, with a picture of its own."""
    return tracer == PLAIN or tracer.startswith(STEP)


def check(parts: tuple[str, ...]) -> None:
    """Raise RtbenchError for an unknown part of the experiment, or none."""
    for part in parts:
        if part not in PARTS:
            raise RtbenchError(unknown("part", part, PARTS))
    if not parts:
        raise RtbenchError(f"parts is empty: at least one is needed of {', '.join(PARTS)}")
