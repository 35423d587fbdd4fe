"""A process that traces scenes by tracers of each kind, as its parent tells it.

See `rtbench.experiments.tree_worker` for how it is told.
"""

from __future__ import annotations

import gc
import hashlib
import sys

from rtbench.experiments import effects_tracers
from rtbench.experiments.effects_tracers import DELETED
from rtbench.experiments.tree_worker import serve
from rtbench.kernels import registry
from rtbench.measure.machine import pin
from rtbench.measure.sampler import timed
from rtbench.scenes.model import Scene
from rtbench.tracer.render import Renderer
from rtbench.tracer.specialising import Code, Deleted, code_of

ALL = 2  # threads: the tracing thread is not the one that waits for it


class Place:
    """What the process holds: one scene, and its tracers."""

    def __init__(self) -> None:
        self.seen: Scene | None = None
        self.inside: tuple[str, ...] = ()
        self.renderers: list[Renderer] = []

    def start(self, cpu: int | None, kernels: list[str]) -> dict:
        """Begin; ``cpu``: to be pinned to."""
        if cpu is not None:
            pin(cpu)
        registry.select(tuple(kernels))
        return {}

    def compile(self, scene: dict, tracer: str, kernel: str, precision: str, code: bool) -> dict:
        """Compile a tracer of a scene; with ``code``: keep its intermediate code beside it."""
        self.scene(**scene)
        renderer = self._renderer(tracer, kernel, precision)
        told = {"seconds": renderer.seconds["compile"]}
        if code:
            code_of(renderer.instance)  # kept beside the module, for who asks later
        return told

    def scene(self, name: str, width: int, height: int) -> dict:
        """Take a scene; what was before it is forgotten."""
        self.renderers = []
        gc.unfreeze()
        gc.enable()
        gc.collect()
        self.seen = effects_tracers.scene_of(name, width, height)
        self.inside = effects_tracers.called(self.seen)
        return {}

    def tracer(self, tracer: str, kernel: str, precision: str) -> dict:
        """Add a tracer: trace a picture.

        Returns
        -------
        dict
            ``ns`` it took, ``digest`` of the pixels, ``rays`` by kind.
        """
        renderer = self._renderer(tracer, kernel, precision)
        self.renderers.append(renderer)
        renderer.render()  # memory and code are fetched
        picture, wall, _ = timed(renderer.render)
        return {"ns": wall, "digest": _digest(picture), "rays": picture.rays}

    def code(self, number: int) -> dict:
        """Describe the intermediate code of a tracer."""
        return _described(code_of(self.renderers[number].instance))

    def ready(self) -> dict:
        """Stop collecting garbage."""
        gc.collect()
        gc.freeze()
        gc.disable()
        return {}

    def time(self, number: int, repetitions: int) -> dict:
        """Time a tracer's picture, so many times in a row."""
        render = self.renderers[number].render

        def all_of_them():
            for _ in range(repetitions):
                picture = render()
            return picture

        picture, wall, cpu = timed(all_of_them, ALL)
        return {"ns": wall, "cpu_ns": cpu, "digest": _digest(picture)}

    def _renderer(self, tracer: str, kernel: str, precision: str) -> Renderer:
        chosen = effects_tracers.options_of(tracer, self.inside, kernel, precision)
        return (Deleted if tracer == DELETED else Renderer)(self.seen, chosen)


def _described(code: Code) -> dict:
    return {
        "code": code.digest,
        "instructions": code.instructions,
        "functions": " ".join(code.functions),
    }


def _digest(picture) -> str:
    return hashlib.sha256(picture.pixels.tobytes()).hexdigest()[:16]


if __name__ == "__main__":
    try:
        serve(Place())
    except BrokenPipeError:  # the parent is gone
        sys.stderr.close()
