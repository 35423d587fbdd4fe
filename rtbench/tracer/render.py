"""From a scene to a picture: tiles by threads, the same to the last bit for any number of them."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rtbench.compiled.elsewhere import compile_ahead
from rtbench.compiled.instantiate import Instance
from rtbench.compiled.layout import REAL_TYPE
from rtbench.errors import RtbenchError
from rtbench.kernels import registry
from rtbench.scenes.model import Camera, Scene
from rtbench.tracer import (
    effects,
    lighting,
    module,
    onward,
    records,
    subsampling,
    tracing,
    view,
    world,
)
from rtbench.tracer.first_hit import first_hits, rasteriser
from rtbench.tracer.options import Options
from rtbench.tracer.turns import in_turns
from rtbench.trees import leaves

TILE = 32  # pixels: a multiple of every grid of adaptive subsampling
RAYS = {
    "primary": tracing.PRIMARY,
    "shadow": tracing.SHADOW,
    "reflection": onward.REFLECTED,
    "refraction": onward.REFRACTED,
    "indirect": onward.INDIRECTED,
}
SAVED = {
    "light_behind": lighting.LIGHT_BEHIND,
    "no_contribution": lighting.NO_CONTRIBUTION,
    "below_threshold": onward.BELOW_THRESHOLD,
    "depth": onward.TOO_DEEP,
    "interpolated": subsampling.INTERPOLATED,
}
COUNTERS = 16


@dataclass
class Picture:
    """What was rendered.

    Attributes
    ----------
    pixels : (H, W, 3) array
        Linear colours in the precision of the tracing, row 0 on top.
    rays : dict of str to int
        Shot, by kind: primary, shadow, reflection, refraction, indirect.
    saved : dict of str to int
        Not shot, by reason.
    seconds : dict of str to float
        compile (0.0 where the code came from the cache), build, trace.
    effects : dict of str to bool
        Which were compiled in.
    heat : dict of str to (H, W) int32 array
        Of counted pictures: steps and tests of each pixel.
    """

    pixels: np.ndarray
    rays: dict[str, int]
    saved: dict[str, int]
    seconds: dict[str, float]
    effects: dict[str, bool]
    heat: dict[str, np.ndarray] = field(default_factory=dict)


class Renderer:
    """A scene, its tree built and its tracer compiled.

    Parameters
    ----------
    scene : Scene
    options : Options, optional
    progress : callable, optional
        Called with the fraction of the tree that is built.
    later : bool
        Compile with the first picture, or by `compile_all`.

    Attributes
    ----------
    seconds : dict of str to float
        compile and build.
    effects : dict of str to bool
        Which are compiled in.
    instance : Instance
        The generated module.

    Raises
    ------
    RtbenchError
        For unknown names, and what trees and kernels refuse.
    """

    def __init__(
        self,
        scene: Scene,
        options: Options | None = None,
        progress: Callable[[float], None] | None = None,
        later: bool = False,
    ) -> None:
        options = options or Options()
        self.scene, self.options = scene, options
        self.kernel = registry.find(options.kernel)
        leaves.must_be_fit(self.kernel)
        seen = effects.with_settings(scene, options.depth, options.samples, options.threshold)
        self.effects = effects.compiled(seen, options.without, options.force)
        begin = time.perf_counter()
        self.world = world.world_of(seen, options, self.kernel, self.effects, progress)
        built = time.perf_counter()
        if options.first_hit:
            self._refuse_first_hit(seen)
        self.seconds = {"compile": 0.0, "build": built - begin}
        self.instance: Instance | None = None
        if not later:
            self.compile()
        self._settings = world.settings_of(seen, options, self.effects, self.world.planes)

    def _refuse_first_hit(self, scene: Scene) -> None:
        """Raise RtbenchError for rays that do not go through the middles of pixels."""
        for effect in ("antialiasing", "depth_of_field", "motion_blur"):
            if self.effects[effect] and scene.settings.samples > 1:
                raise RtbenchError(
                    f"first_hit is for one ray through the middle of each pixel, and {effect} "
                    "sends others; leave one of the two out"
                )

    def compile(self) -> None:
        """Compile the tracer or load it, unless that was done."""
        begin = time.perf_counter()
        if self.instance is None and self._compile():
            self.seconds["compile"] = time.perf_counter() - begin

    def _compile(self) -> bool:
        """Compile what is not compiled yet; return whether anything was."""
        known = module.tracer.cache_info().misses, rasteriser.cache_info().misses
        self.instance = module.tracer(self.kernel, self.options.precision, self._features())
        made = [self.instance] if module.tracer.cache_info().misses > known[0] else []
        if self.options.first_hit:
            made.append(rasteriser(self.kernel, self.options.precision, self.world.kinds))
            if rasteriser.cache_info().misses == known[1]:
                made.pop()
        return any(each.fresh for each in made)

    def _features(self) -> module.Features:
        return module.Features(
            frozenset(name for name, inside in self.effects.items() if inside),
            self.world.kinds,
            self.world.structure,
            self.world.form,
            self.options.shadow_cache,
            self.options.counted,
            self.options.subsampling is not None,
            self.options.first_hit,
        )

    def render(
        self,
        camera: Camera | None = None,
        threads: int = 1,
        progress: Callable[[float], None] | None = None,
    ) -> Picture:
        """Return a picture.

        Parameters
        ----------
        camera : Camera, optional
            In place of the scene's; compiles and builds nothing.
        threads : int
        progress : callable, optional
            Called with the fraction done.
        """
        self.compile()
        camera = camera or self.scene.camera
        real = REAL_TYPE[self.options.precision]
        begin = time.perf_counter()
        height, width = camera.height, camera.width
        image = np.zeros((height, width, 3), real)
        heat = np.zeros((height, width, 2) if self.options.counted else (1, 1, 2), np.int32)
        arrays = tuple(self.world.arrays.values())
        seen = view.camera_of(camera, self.world.base, real)
        tiles, empty = view.tiles_of(self.world, seen, TILE)
        if self.options.subsampling is not None:  # asks for pixels of the next tile
            tiles, empty = np.concatenate([tiles, empty]), empty[:0]
        if len(empty):  # to be traced by itself: all that is empty looks like its first pixel
            tiles = np.concatenate([tiles, [(*empty[0, :2], *(empty[0, :2] + 1))]])
        many = len(tiles) - bool(len(empty))
        threads = max(1, min(threads, os.cpu_count() or 1, many))
        first = np.zeros((1, 1, 2), np.int64)
        if self.options.first_hit:
            first = first_hits(self.kernel, self.options.precision, self.world, seen, threads)
        room = threading.local()
        counted = []

        def trace(begin: int, end: int) -> None:
            if not hasattr(room, "rays"):
                room.rays = np.zeros(2, leaves.ray_type(self.kernel, self.options.precision))
                room.waiting = np.zeros(self.world.waiting, records.waiting_type(real))
                room.counts = np.zeros(COUNTERS, np.int64)
                counted.append(room.counts)
            self.instance.call(
                *arrays,
                seen,
                self._settings,
                first,
                room.rays,
                room.waiting,
                room.counts,
                image,
                heat,
                tiles,
                begin,
                end,
            )

        more = np.zeros(COUNTERS, np.int64)
        if len(empty):
            trace(many, many + 1)
            more = room.counts * (np.prod(empty[:, 2:] - empty[:, :2], axis=1).sum() - 1)
            for left, upper, right, lower in empty:
                image[upper:lower, left:right] = image[empty[0, 1], empty[0, 0]]
        in_turns(many, threads, trace, progress)
        total = np.sum(counted, axis=0) + more
        seconds = self.seconds | {"trace": time.perf_counter() - begin}
        heats = {}
        if self.options.counted:
            heats = {"steps": heat[..., 0], "tests": heat[..., 1]}
        return Picture(
            image,
            {name: int(total[place]) for name, place in RAYS.items()},
            {name: int(total[place]) for name, place in SAVED.items()},
            seconds,
            dict(self.effects),
            heats,
        )


def compile_all(
    renderers: Sequence[Renderer], progress: Callable[[float], None] | None = None
) -> None:
    """Compile the tracers of renderers made to compile later, on all cores side by side.

    Parameters
    ----------
    renderers : sequence of Renderer
    progress : callable, optional
        Called with the fraction done.
    """
    wanted = [
        module.arguments(each.kernel, each.options.precision, each._features())
        for each in renderers
    ]
    compile_ahead(wanted, len(os.sched_getaffinity(0)), progress)
    for each in renderers:
        each.compile()


def render(
    scene: Scene,
    options: Options | None = None,
    threads: int = 1,
    progress: Callable[[float], None] | None = None,
) -> Picture:
    """Return a picture of a scene: see `Renderer`."""
    return Renderer(scene, options).render(threads=threads, progress=progress)
