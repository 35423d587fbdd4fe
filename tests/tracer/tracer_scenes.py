"""Scenes that the tests of the tracer share, and tracers that hold more than a scene calls for.

Compiling takes far longer than a small picture: so that many scenes have one tracer, what some of
them lack is compiled in by force.
"""

import dataclasses
import functools

import numpy as np
import pytest

from rtbench.scenes.model import (
    Camera,
    Cone,
    Disc,
    Light,
    Material,
    Plane,
    Scene,
    Settings,
    Sphere,
    Triangles,
)
from rtbench.tracer.options import Options
from rtbench.tracer.render import Renderer
from rtbench.workloads import solids
from rtbench.workloads.generated_models import find_model
from rtbench.workloads.meshes import load_mesh, models

KINDS = ("triangles", "spheres", "cones", "discs", "planes")
FORCED = ("shadows", "reflection", "refraction")
WHITE = Material(ambient=(0, 0, 0), diffuse=(1, 1, 1))
TILTED = np.array([1.0, -0.7, 0.3])


@functools.cache
def corners(name):
    """Return a model's triangles, (M, 3, 3), its box's longest side 1 and its middle in 0."""
    if name.startswith("icosphere"):
        found = solids.icosphere(int(name.removeprefix("icosphere"))).triangles
    elif name == "cube":
        found = solids.cube().triangles
    elif name.split(":")[0] in ("scanned", "robots", "even"):
        found = find_model(name).triangles
    else:
        if name not in models():
            pytest.skip(f"RTBENCH_MODELS has no {name}")
        found = load_mesh(models()[name]).triangles
    found = np.asarray(found, np.float64)
    low, high = found.min(axis=(0, 1)), found.max(axis=(0, 1))
    return (found - (low + high) / 2) / np.max(high - low)


def mesh(name, **more):
    return Triangles(corners=corners(name), closed=True, **more)


def placed(objects, scale=1.0, offset=(0.0, 0.0, 0.0)):
    """Return objects scaled about 0 and then moved."""
    offset = np.asarray(offset, np.float64)

    def point(at):
        return tuple(np.asarray(at, np.float64) * scale + offset)

    made = []
    for each in objects:
        if isinstance(each, Triangles):
            changed = {"corners": each.corners * scale + offset}
        elif isinstance(each, (Sphere, Disc)):
            changed = {"center": point(each.center), "radius": each.radius * scale}
        elif isinstance(each, Plane):
            changed = {"point": point(each.point)}
        else:
            changed = {
                "base": point(each.base),
                "apex": point(each.apex),
                "base_radius": each.base_radius * scale,
                "apex_radius": each.apex_radius * scale,
            }
        changed["velocity"] = tuple(np.asarray(each.velocity) * scale)
        made.append(dataclasses.replace(each, **changed))
    return tuple(made)


def capped(base, apex, radius, **more):
    """Return a closed cylinder: its side and two discs."""
    axis = tuple(np.subtract(apex, base))
    return (
        Cone(base=base, apex=apex, base_radius=radius, apex_radius=radius, **more),
        Disc(center=base, normal=axis, radius=radius, **more),
        Disc(center=apex, normal=axis, radius=radius, **more),
    )


SLANTED = capped((-0.3, -0.2, 0.1), (0.25, 0.3, -0.1), 0.21)
WHOLE_CONE = Cone(base=(0, -0.5, 0), apex=(0.1, 0.5, 0), base_radius=0.5, apex_radius=0.0)
SHAPES = {
    "sphere": (Sphere(radius=0.5),),
    "cylinder": SLANTED,
    "cone": (WHOLE_CONE, Disc(center=(0, -0.5, 0), normal=(0.1, 1, 0), radius=0.5)),
    "open cone": (Cone(base=(0, -0.5, 0), apex=(0, 0.4, 0), base_radius=0.5, apex_radius=0.2),),
    "disc": (Disc(normal=(0.3, 1, 0.2), radius=0.5),),
    "plane": (Plane(point=(0, -0.5, 0)),),
    "sphere resting on a plane": (Plane(point=(0, -0.5, 0)), Sphere(radius=0.5)),
    "sphere cut by a plane": (Plane(point=(0, -0.2, 0)), Sphere(radius=0.5)),
    "spheres that touch": (
        Sphere(center=(-0.25, 0, 0), radius=0.25),
        Sphere(center=(0.25, 0, 0), radius=0.25),
        Sphere(center=(0, 0.3, 0), radius=0.2),
    ),
    "box of planes": tuple(
        Plane(point=tuple(-0.5 * np.array(n)), normal=n) for n in ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    ),
}


@functools.cache
def options(precision="float64", **given):
    given.setdefault("force", FORCED)
    given.setdefault("kinds", KINDS)
    return Options(precision=precision, **given)


def picture(scene, precision="float64", threads=1, **given):
    return Renderer(scene, options(precision, **given)).render(threads=threads)


def lit_at_the_eye(objects, eye, target, size=96, angle=45.0, shadows=True, up=(0, 1, 0)):
    """Return a scene whose only light shines from where the camera stands."""
    return Scene(
        "lit at the eye",
        Camera(tuple(eye), tuple(target), up, angle, size, size),
        (Light(position=tuple(eye), shadows=shadows),),
        (WHITE,),
        (*objects, nothing_at(objects)),
        settings=Settings(depth=0),
    )


def nothing_at(objects):
    """Return a triangle without area somewhere on the objects: it moves no box."""
    for each in objects:
        if isinstance(each, Triangles):
            return Triangles(corners=np.repeat(each.corners[:1, :1], 3, axis=1))
        for name in ("center", "point", "base"):
            if hasattr(each, name):
                return Triangles(corners=np.tile(getattr(each, name), (1, 3, 1)).astype(float))
    raise ValueError(objects)


def many(seed=5, triangles=60, shapes=10, planes=True, moved=(0.0, 0.0, 0.0)):
    """Return a scene of all kinds of primitives, crossing each other, each of a colour of its own.

    Primitive i, in the order of the objects, sends i + 1 by itself; two lights light it.
    """
    random = np.random.default_rng(seed)
    objects = []
    for _ in range(triangles):
        middle = random.uniform(-1, 1, 3)
        objects.append(Triangles(corners=(middle + random.normal(0, 0.3, (3, 3)))[None]))
    for _ in range(shapes):
        place, other = random.uniform(-1, 1, (2, 3))
        wide, narrow = random.uniform(0.05, 0.3, 2)
        objects += [
            Sphere(center=tuple(random.uniform(-1, 1, 3)), radius=random.uniform(0.1, 0.4)),
            Cone(base=tuple(place), apex=tuple(other), base_radius=wide, apex_radius=narrow),
            Disc(center=tuple(random.uniform(-1, 1, 3)), normal=tuple(other), radius=wide),
        ]
    if planes:
        objects += [Plane(point=(0, -1, 0)), Plane(point=(0, 0, -1.5), normal=(0.2, 0.1, 1))]
    materials = tuple(
        Material(emission=(i + 1, 0, 0), diffuse=(0, 0.5, 1)) for i in range(len(objects))
    )
    objects = [dataclasses.replace(each, material=i) for i, each in enumerate(objects)]
    lights = Light(position=(2, 3, 2)), Light(kind="directional", direction=(0.3, -1, -0.4))
    return Scene(
        "many",
        Camera((0.4, 0.9, 4), (0, 0, 0), (0, 1, 0), 45, 70, 50),
        lights,
        materials,
        placed(objects, 1.0, moved),
    )
