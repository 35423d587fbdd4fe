"""A process that traces scenes by techniques that are to save rays or time, as its parent tells it.

See `rtbench.experiments.tree_worker` for how it is told.
"""

from __future__ import annotations

import dataclasses
import gc
import sys

import numpy as np

from rtbench.experiments import effects_worker, techniques_scenes
from rtbench.experiments.effects_worker import ALL
from rtbench.experiments.tree_worker import serve
from rtbench.images.comparison import compare
from rtbench.measure.sampler import timed
from rtbench.tracer import world
from rtbench.tracer.options import Options, Subsampling
from rtbench.tracer.render import Picture, Renderer

FEW = 16  # pixels along a side of what is traced only for its compiling


class Resettled(Renderer):
    """A renderer with the tree and the code of another, subsampling by other numbers."""

    def __init__(self, built: Renderer, options: Options) -> None:
        self.__dict__.update(built.__dict__)
        self.options = options
        self._settings = world.settings_of(self.scene, options, self.effects, self.world.planes)


class Place(effects_worker.Place):
    """What the process holds: one scene, its tracers, and a picture that others are beside."""

    def __init__(self) -> None:
        super().__init__()
        self._forget()

    def _forget(self) -> None:
        self.renderers = []
        self.threads: list[int] = []
        self.built: dict[Options, Renderer] = {}
        self.full: np.ndarray | None = None

    def compile(self, scene: dict, options: dict) -> dict:
        """Compile a tracer of a scene, and what it has its first hits from, or find it compiled."""
        self.scene(**scene)
        renderer = self._renderer(options)
        renderer.render(dataclasses.replace(self.seen.camera, width=FEW, height=FEW))
        return {"seconds": renderer.seconds["compile"]}

    def scene(self, name: str, width: int, height: int) -> dict:
        """Take a scene; what was before it is forgotten."""
        self._forget()
        gc.unfreeze()
        gc.enable()
        gc.collect()
        self.seen = techniques_scenes.read(name, width, height)
        return {}

    def add(self, options: dict, threads: int) -> dict:
        """Add a tracer; a first picture fetches memory and code."""
        new = len(self.built)
        self.renderers.append(self._renderer(options))
        self.threads.append(threads)
        if len(self.built) > new:
            self.renderers[-1].render()
        return {}

    def tracer(self, options: dict, threads: int, full: bool) -> dict:
        """Add a tracer and look at its picture; ``full``: compare later ones with it.

        Returns
        -------
        dict
            ``ns`` it took, ``digest`` of the pixels, ``rays`` by kind, ``interpolated`` pixels,
            and how far it is ``apart`` from the full picture, if there was one.
        """
        self.add(options, threads)
        render = self.renderers[-1].render
        picture, wall, _ = timed(lambda: render(threads=threads), ALL)
        told = {"ns": wall, "digest": effects_worker._digest(picture), "rays": picture.rays}
        told["interpolated"] = picture.saved["interpolated"]
        if self.full is not None:
            told["apart"] = _apart(self.full, picture)
        if full:
            self.full = picture.pixels
        return told

    def time(self, number: int, repetitions: int) -> dict:
        """Time a tracer's picture, so many times in a row."""
        render, threads = self.renderers[number].render, self.threads[number]

        def all_of_them():
            for _ in range(repetitions):
                picture = render(threads=threads)
            return picture

        picture, wall, cpu = timed(all_of_them, ALL)
        return {"ns": wall, "cpu_ns": cpu, "digest": effects_worker._digest(picture)}

    def _renderer(self, options: dict) -> Renderer:
        chosen = options_of(options)
        # Its numbers are read when it runs: neither the tree nor the code knows them.
        kind = chosen
        if chosen.subsampling is not None:
            kind = dataclasses.replace(chosen, subsampling=Subsampling())
        if kind not in self.built:
            self.built[kind] = Renderer(self.seen, chosen)
        return Resettled(self.built[kind], chosen)


def options_of(told: dict) -> Options:
    """Return options from what went through JSON."""
    told = dict(told)
    if told.get("subsampling"):
        grid = tuple(told["subsampling"]["grid"])
        told["subsampling"] = Subsampling(**told["subsampling"] | {"grid": grid})
    return Options(**told)


def _apart(full: np.ndarray, picture: Picture) -> dict[str, float]:
    found = compare(full, picture.pixels)
    return {
        "mean_square": found.mean_square,
        "ssim": found.structural_similarity,
        "greatest": found.greatest,
        "differing": found.differing,
        "above_two_steps": found.above_two_steps,
    }


if __name__ == "__main__":
    try:
        serve(Place())
    except BrokenPipeError:  # the parent is gone
        sys.stderr.close()
