"""Small scenes for checks by hand: single rays, figures, and rulers that tell where a ray lands."""

from __future__ import annotations

import numpy as np

from rtbench.scenes.model import BLACK, WHITE, Camera, Material, Scene, Settings, Texture, Triangles
from rtbench.tracer.options import Options
from rtbench.tracer.render import Renderer

RULED = Texture(
    "image",
    pixels=np.array([[[0, 1, 1], [1, 1, 1]], [[0, 0, 1], [1, 0, 1]]], np.float32),
)
RULER = Material(ambient=WHITE, diffuse=BLACK, texture=RULED, name="ruler")
EXACT = {"float64": 1e-9, "float32": 2e-4}


def glowing(*color: float) -> Material:
    return Material(diffuse=BLACK, emission=color * 3 if len(color) == 1 else color)


def figure(*points, material: int = 0, velocity=BLACK, normals=None, coordinates=None) -> Triangles:
    """Return a convex polygon; counter-clockwise where it is seen from outside."""

    def fan(of):
        if of is None:
            return None
        of = np.asarray(of, np.float64)
        return np.stack([of[[0, k, k + 1]] for k in range(1, len(of) - 1)])

    return Triangles(
        material, velocity, corners=fan(points), normals=fan(normals), coordinates=fan(coordinates)
    )


def rectangle(middle, u, v, **more) -> Triangles:
    """Return a rectangle with half sides u and v; its outside is that of u x v."""
    c, u, v = (np.asarray(each, np.float64) for each in (middle, u, v))
    return figure(c - u - v, c + u - v, c + u + v, c - u + v, **more)


def ruler(middle, u, v, material: int = 0) -> Triangles:
    """Return a rectangle that shows where it is seen: red from -u to u, green from -v to v.

    An image of two by two pixels: between their middles, u and v of 0.25 and 0.75, it is linear.
    """
    corners = [(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)]
    return rectangle(middle, u, v, material=material, coordinates=corners)


def ray(position, way, up=(0.0, 1.0, 0.0)) -> Camera:
    """Return a camera of one pixel: one ray."""
    target = tuple(np.add(position, way).tolist())
    return Camera(tuple(map(float, position)), target, up, angle=1.0, width=1, height=1)


SPECK = figure((0, 0, 90), (1e-3, 0, 90), (0, 1e-3, 90))  # so that every scene has a triangle


def made(
    objects, materials, camera=None, lights=(), background=BLACK, speck=False, **settings
) -> Scene:
    settings = {"threshold": 0.0} | settings
    more = (SPECK,) if speck else ()
    return Scene(
        "tiny",
        camera or ray((0, 0, 5), (0, 0, -1)),
        tuple(lights),
        tuple(materials),
        (*objects, *more),
        background=background,
        settings=Settings(**settings),
    )


def renderer(scene: Scene, effects, kinds=(), precision: str = "float64") -> Renderer:
    """Return a renderer with the code of certain effects: one compiled tracer for many scenes."""
    found = Renderer(scene, Options(precision=precision, force=tuple(effects), kinds=tuple(kinds)))
    more = {name for name, inside in found.effects.items() if inside} - set(effects)
    assert not more, f"the scene calls for {more} too: one more tracer would be compiled"
    assert found.world.kinds - {"fresnel"} <= set(kinds)
    return found


def seen(by: Renderer, camera: Camera | None = None) -> np.ndarray:
    """Return the colour of a camera's only pixel."""
    return by.render(camera).pixels[0, 0].astype(np.float64)
