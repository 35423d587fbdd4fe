"""The tracer of a scene, compiled: the code of what the scene calls for, and nothing else.

Effects and kinds of primitives are constants at the generated module's top; numba drops a block
behind a constant that is False before it looks at what is in it. Everything else is data: another
camera, another colour or another place compiles nothing.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from rtbench.compiled import syntax, vector_memory
from rtbench.compiled.embedded import refused_in_a_line
from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.compiled.layout import REAL_TYPE
from rtbench.compiled.packets import vectors_digest
from rtbench.compiled.sources import dtype_source, named
from rtbench.kernels.contract import HIT, Kernel
from rtbench.shapes import any_shape
from rtbench.shapes.records import KINDS, shape_type
from rtbench.tracer import (
    camera,
    highlights,
    in_leaves,
    leaf_table,
    lighting,
    onward,
    optics,
    records,
    sampling,
    subsampling,
    surface,
    textures,
    tiles,
    tracing,
    waiting,
    walking,
    world,
)
from rtbench.trees import leaves
from rtbench.trees.bvh.nodes import WIDE_SOURCE
from rtbench.trees.leaves import IN_BLOCKS
from rtbench.trees.traversal import entering, leaf_tests, stack

BY_VECTORS = ("any_lane", "choose", "first_lane", "greater", "lane", "least", "lesser", "row")
BY_VECTORS += ("spread",)
BY_MEMORY = ("bits_of", "descending", "how_many", "lowest_bit", "save", "told_apart")
OWN_NUMBERS = (in_leaves, walking, surface, lighting, onward, tracing, camera, subsampling, tiles)
ARRAYS = tiles.FIELDS[:18]
SCRATCH = ("rays", "waiting")


@dataclass(frozen=True)
class Features:
    """What decides the code of a tracer.

    Attributes
    ----------
    effects : frozenset of str
        Those that are compiled in.
    kinds : frozenset of str
        Of primitives: triangles, spheres, cones, discs, planes; motion; and fresnel, where mirrors
        send back by Fresnel's equations.
    structure : str
        kd or bvh.
    form : str
        How triangles lie in leaves.
    shadow_cache, counted, subsampled, first_hit : bool
    """

    effects: frozenset[str]
    kinds: frozenset[str]
    structure: str = "bvh"
    form: str = IN_BLOCKS
    shadow_cache: bool = True
    counted: bool = False
    subsampled: bool = False
    first_hit: bool = False

    def constants(self) -> dict[str, bool]:
        """Return the names that the tracer's sources test, and what they are."""
        from rtbench.tracer.effects import EFFECTS

        told = {effect.upper(): effect in self.effects for effect in EFFECTS}
        shapes = {"spheres", "cones", "discs", "planes"} & self.kinds
        told |= {
            "TRIANGLES": "triangles" in self.kinds,
            "SHAPES": bool(shapes),
            "BOUNDED": bool(shapes - {"planes"}),
            "SPHERES": "spheres" in shapes,
            "CONES": "cones" in shapes,
            "DISCS": "discs" in shapes,
            "PLANES": "planes" in shapes,
            "MOTION": "motion" in self.kinds,
            "BLOCKS": self.form == IN_BLOCKS,
            "BVH": self.structure == "bvh",
            "SHADOW_CACHE": self.shadow_cache and "shadows" in self.effects,
            "COUNTED": self.counted,
            "SUBSAMPLED": self.subsampled,
            "FIRST_HIT": self.first_hit,
        }
        # Light comes through what lets rays through; total reflection needs no mirror.
        told["FILTERED"] = told["REFRACTION"] and told["SHADOWS"]
        told["FRESNEL"] = told["REFRACTION"] or "fresnel" in self.kinds
        told["MIRRORED"] = told["REFLECTION"] or told["REFRACTION"]
        return told


def _modules() -> tuple:
    """Return the tracer's own parts, in an order in which each stands after what it calls."""
    return (
        entering.CALLEES,
        stack.CALLEES,
        any_shape.CALLEES,
        (leaf_tests.ask,),
        in_leaves.CALLEES,
        walking.CALLEES,
        surface.CALLEES,
        sampling.CALLEES,
        optics.CALLEES,
        highlights.CALLEES,
        textures.CALLEES,
        waiting.CALLEES,
        lighting.CALLEES,
        onward.CALLEES,
        tracing.CALLEES,
        camera.CALLEES,
        subsampling.CALLEES,
    )


# Their literals are float32 or float64 by their own words, whatever the arithmetic.
AS_WRITTEN = {*entering.CALLEES, *stack.CALLEES, *walking.IN_DOUBLE}


@functools.cache
def tracer(kernel: Kernel, precision: str, features: Features) -> Instance:
    """Return the compiled tracer.

    Parameters
    ----------
    kernel : Kernel
        What tests triangles.
    precision : str
        float32 or float64.
    features : Features

    Returns
    -------
    Instance
        ``call(*arrays, rays, waiting, counts, image, heat, tiles, begin, end)``: the
        arrays of `rtbench.tracer.world.World` in order, the camera, the settings and what
        `rtbench.tracer.first_hit.first_hits` found, else (1, 1, 2); two rays to
        work with; what is counted, (16,) int64; the picture (H, W, 3), and of counted ones steps
        and tests (H, W, 2) int32; tiles (n, 4) int64, left, upper, right and lower in pixels,
        and which of them, from begin to end.

    Raises
    ------
    RtbenchError
        For a kernel that does not compile.
    """
    return instantiated(kernel, precision, features, None)


def instantiated(kernel: Kernel, precision: str, features: Features, change) -> Instance:
    """Return the compiled tracer of sources that were changed: see `tracer` and `arguments`."""
    entry, rest = arguments(kernel, precision, features, change)
    with refused_in_a_line(kernel, " in the tracer"):
        return instantiate(entry, **rest)


def arguments(
    kernel: Kernel, precision: str, features: Features, change=None
) -> tuple[str, dict[str, object]]:
    """Return what `rtbench.compiled.instantiate.instantiate` takes to compile a tracer.

    Parameters
    ----------
    kernel, precision, features
        As for `tracer`.
    change : callable, optional
        Takes the syntax of each function and returns what is to be compiled in its place.
    """
    told = features.constants()
    inside = leaves.test_of(kernel, precision, features.form)
    callees = [*inside.callees]
    for functions in _modules():
        for function in functions:
            tree = syntax.parse(function)
            if change is not None:
                tree = change(tree)
            if function in in_leaves.IN_LANES:
                if not told["BLOCKS"]:
                    continue
                callees.append(inside.source(tree, function.__name__))
            elif function is leaf_tests.ask and told["BLOCKS"]:
                continue
            else:
                typed = tree if function in AS_WRITTEN else syntax.typed(tree)
                callees.append(named(typed, function.__name__))
    entry = syntax.parse(tiles.traced)
    if change is not None:
        entry = change(entry)
    real = REAL_TYPE[precision].__name__
    constants = inside.constants | {k: str(v) for k, v in told.items() if k != "TRIANGLE"}
    constants["READS_END"] = str("end" in leaves.ray_type(kernel, precision).names)
    constants |= _constants(precision, features)
    imports = [inside.imports] if "vector_functions" in inside.imports else []
    if not imports:
        imports = [f"from rtbench.compiled.vector_functions import {', '.join(BY_VECTORS)}"]
        imports += [inside.imports] if inside.imports else []
    imports += [vector_memory.imports(BY_MEMORY), "from collections import namedtuple"]
    name = f"{kernel.name}_tracer"
    return named(entry, name), {
        "callees": tuple(callees),
        "constants": constants,
        "signature": _signature(real, features),
        "title": f"A ray tracer in {precision}: {', '.join(sorted(features.effects)) or 'plain'}",
        "forceinline": True,
        "outlined": inside.outlined,
        "imports": "\n".join(imports),
    }


def _constants(precision: str, features: Features) -> dict[str, str]:
    real = REAL_TYPE[precision]
    told = {
        "VECTORS": repr(vectors_digest()),
        "MEMORY": repr(vector_memory.digest()),
        "HIT": str(HIT),
        "NO_INDEX": "np.int32(0x7FFFFFFF)",
        "BEFORE": "np.float32(-1)",
        "START": "np.float32(0)",
        "LESS": "np.float32(1 - 2**-20)",
        "INFINITY": "REAL(np.inf)",
        "OFF": f"REAL({world.MARGIN} * np.finfo(REAL).eps)",
        "FACE": dtype_source(records.face_type(real)),
        "SHAPE": dtype_source(shape_type(real)),
        "MATERIAL": dtype_source(records.material_type(real)),
        "LIGHT": dtype_source(records.light_type(real)),
        "TEXTURED": dtype_source(records.texture_type(real)),
        "CAMERA": dtype_source(records.camera_type(real)),
        "SETTINGS": dtype_source(records.settings_type(real)),
        "WAITING": dtype_source(records.waiting_type(real)),
        "BOTH": dtype_source(leaf_table.BOTH),
        "World": f"namedtuple('World', {' '.join(tiles.FIELDS)!r})",
    }
    for module in OWN_NUMBERS:
        told |= {
            # Not bare ints: each that is passed on would compile the callee once more.
            name: f"np.{np.dtype(type(value)).name}({value})"
            for name, value in module.NUMBERS.items()
        }
    told |= entering.constants(precision)
    told |= any_shape.constants(features.kinds & set(KINDS))
    return told | sampling.constants(precision)


def _signature(real: str, features: Features) -> str:
    node = WIDE_SOURCE if features.structure == "bvh" else leaves.NODE_SOURCE
    kinds = {
        "nodes": f"{node}[::1]",
        "refs": "int32[::1]",
        "triangles": "TRIANGLE[::1]",
        "leaves": "BOTH[::1]",
        "scene": "float64[::1]",
        "faces": "FACE[::1]",
        "normals": f"{real}[:, :, ::1]",
        "coordinates": f"{real}[:, :, ::1]",
        "shapes": "SHAPE[::1]",
        "material_of": "int32[::1]",
        "velocities": f"{real}[:, ::1]",
        "materials": "MATERIAL[::1]",
        "lights": "LIGHT[::1]",
        "textures": "TEXTURED[::1]",
        "texels": "float32[::1]",
        "camera": "CAMERA[::1]",
        "settings": "SETTINGS[::1]",
        "first": "int64[:, :, ::1]",
    }
    arrays = ", ".join(kinds[name] for name in ARRAYS)
    return (
        f"void({arrays}, RAY[::1], WAITING[::1], int64[::1], {real}[:, :, ::1], "
        "int32[:, :, ::1], int64[:, ::1], int64, int64)"
    )
