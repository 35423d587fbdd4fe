"""What one ray from the camera brings: Whitted's algorithm, its recursion a stack of waiting rays.

A ray that hits something is lit directly, by rays to the lights, and sends mirrored and refracted
rays on, each with the weight that what it brings has in the pixel. A ray is shot only where it can
change the pixel. The blocks of effects that a scene does not call for are not compiled.

Sources: Whitted 1980; Hall & Greenberg 1983 (adaptive depth); Kajiya 1986 (indirect light);
Šilhavý 2010, chapter 2.
"""

from __future__ import annotations

import numpy as np

from rtbench.tracer.lighting import lit, textured
from rtbench.tracer.onward import bounced, sent_on
from rtbench.tracer.surface import surface
from rtbench.tracer.waiting import aim, colour, off, times, wait
from rtbench.tracer.walking import nearest

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
TEXTURE = INDIRECT = FILTERED = MIRRORED = MOTION = False
INFINITY = REAL(np.inf)
PRIMARY, SHADOW = 0, 1


def radiance(world, seed, time):
    """Return what the one waiting ray brings: red, green and blue."""
    red, green, blue = 0.0, 0.0, 0.0
    on_lights = facets = bands = paths = np.uint64(0)
    settings = world.settings[0]
    ray = world.rays[0]
    top = 1
    while top > 0:
        top -= 1
        waiting = world.waiting[top]
        kind, depth, wave = waiting.kind, waiting.depth, waiting.wave
        weight = colour(waiting.weight)
        aim(ray, waiting.orig, waiting.dir, waiting.far)
        index, t, u, v = nearest(world, time, np.int32(waiting.start), kind == PRIMARY)
        if index < 0:
            if not FILTERED or kind != SHADOW:
                weight = times(weight, colour(settings.background))
            red, green, blue = red + weight[0], green + weight[1], blue + weight[2]
            continue
        material = world.materials[world.material_of[index]]
        point, geometric, normal, margin, front, at_u, at_v = surface(
            world, ray, time, index, t, u, v
        )
        if FILTERED:
            if kind == SHADOW:
                if material.transmits:
                    at = off(point, geometric, -margin)
                    way = colour(ray.dir)
                    if ray.tmax < INFINITY:
                        way = (
                            ray.orig[0] + way[0] - at[0],
                            ray.orig[1] + way[1] - at[1],
                            ray.orig[2] + way[2] - at[2],
                        )
                    weight = times(weight, colour(material.transmission))
                    top = wait(world, top, SHADOW, depth, index, at, way, ray.tmax, weight, wave)
                continue
        dir = colour(ray.dir)
        viewer = -dir[0], -dir[1], -dir[2]
        at = off(point, geometric, margin)

        # What the surface sends by itself, and of the light that is everywhere
        tint = 1.0, 1.0, 1.0
        if TEXTURE:
            if material.texture >= 0:
                place = point
                if MOTION:
                    # A texture moves with its object.
                    moved_by = world.velocities
                    place = (
                        point[0] - time * moved_by[index, 0],
                        point[1] - time * moved_by[index, 1],
                        point[2] - time * moved_by[index, 2],
                    )
                tint = textured(world, world.textures[material.texture], place, at_u, at_v)
        own = times(colour(material.ambient), tint)
        red += weight[0] * (own[0] + material.emission[0])
        green += weight[1] * (own[1] + material.emission[1])
        blue += weight[2] * (own[2] + material.emission[2])

        # Light that comes straight from the lights
        direct, on_lights, top = lit(
            world,
            seed,
            on_lights,
            top,
            time,
            index,
            material,
            tint,
            at,
            geometric,
            normal,
            viewer,
            (weight, depth, wave),
        )
        red += weight[0] * direct[0]
        green += weight[1] * direct[1]
        blue += weight[2] * direct[2]

        mine = weight, depth, wave
        if INDIRECT:
            paths, top = bounced(
                world, seed, paths, top, index, material, tint, at, geometric, normal, mine
            )
        if MIRRORED:
            ways = dir, geometric, normal
            facets, bands, top = sent_on(
                world,
                seed,
                facets,
                bands,
                top,
                index,
                material,
                point,
                margin,
                front,
                ways,
                mine,
            )
    return red, green, blue


CALLEES = (radiance,)
NUMBERS = {"PRIMARY": PRIMARY, "SHADOW": SHADOW}
