"""Light that comes to a point straight from the lights, by rays that may be in shadow.

Sources: Appel 1968 (shadow rays); Phong 1975; Cook, Porter & Carpenter 1984 (lights with an area);
Šilhavý 2010, section 2.2 (one ray at random in each cell of a grid).
"""

from __future__ import annotations

import math

import numpy as np

from rtbench.tracer.highlights import blinn_phong, oren_nayar, phong, spot
from rtbench.tracer.sampling import DIMENSIONS, on_light_sphere, uniform
from rtbench.tracer.textures import checker, texel
from rtbench.tracer.waiting import aim, by, colour, cosine, greatest, times, wait
from rtbench.tracer.walking import BLOCKED, FREE, in_the_way

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
SHADOWS = SPECULAR = SOFT_SHADOWS = FILTERED = False
DIMENSION_SOFT_SHADOWS = DIMENSIONS["soft_shadows"]
INFINITY = REAL(np.inf)
SHADOW, LIGHT_BEHIND, NO_CONTRIBUTION = 1, 5, 6
POINT, DIRECTIONAL, SPOT, RECTANGLE, SPHERE_LIGHT = 0, 1, 2, 3, 4
ONE_MORE = np.uint64(1)


def to_light(light, point, s, t):
    """Return the way from a point to a light, to its place (s, t) where it has an area."""
    if light.kind == DIRECTIONAL:
        return -light.direction[0], -light.direction[1], -light.direction[2]
    x, y, z = light.position[0], light.position[1], light.position[2]
    if SOFT_SHADOWS:
        if light.kind == RECTANGLE:
            s, t = s - 0.5, t - 0.5
            x += s * light.edge_u[0] + t * light.edge_v[0]
            y += s * light.edge_u[1] + t * light.edge_v[1]
            z += s * light.edge_u[2] + t * light.edge_v[2]
        elif light.kind == SPHERE_LIGHT:
            x, y, z = on_light_sphere(x, y, z, light.radius, point[0], point[1], point[2], s, t)
    return x - point[0], y - point[1], z - point[2]


def strength(light, point, way, distance):
    """Return how much of a light's colour comes to a point by a way of a length."""
    factor = 1.0
    if light.falls_off:
        factor = 1.0 / (distance * distance)
        if SOFT_SHADOWS:
            if light.kind == SPHERE_LIGHT:
                # Its places are even in the cone that it fills, and it is as bright at each: what
                # comes falls off with the distance of its centre.
                centre = colour(light.position)
                away = centre[0] - point[0], centre[1] - point[1], centre[2] - point[2]
                square = cosine(away, away)
                outside = square - light.radius * light.radius
                if outside > 0.0:
                    factor = 2.0 / (square + math.sqrt(square * outside))
    if light.kind == SPOT:
        along = -cosine(light.direction, way) / distance
        factor *= spot(along, light.cos_inner, light.cos_outer)
    return factor


def answer(material, tint, normal, towards, cosine_light, viewer):
    """Return what a surface sends to the viewer of light that comes from somewhere."""
    lit = cosine_light
    if material.diffuse_roughness > 0.0:
        lit *= oren_nayar(
            normal[0],
            normal[1],
            normal[2],
            towards[0],
            towards[1],
            towards[2],
            viewer[0],
            viewer[1],
            viewer[2],
            material.diffuse_roughness,
        )
    sent = times(by(colour(material.diffuse), lit), tint)
    if SPECULAR:
        if greatest(material.specular) > 0.0:
            if material.is_blinn:
                shine = blinn_phong(
                    normal[0],
                    normal[1],
                    normal[2],
                    towards[0],
                    towards[1],
                    towards[2],
                    viewer[0],
                    viewer[1],
                    viewer[2],
                    material.exponent,
                )
            else:
                shine = phong(
                    normal[0],
                    normal[1],
                    normal[2],
                    towards[0],
                    towards[1],
                    towards[2],
                    viewer[0],
                    viewer[1],
                    viewer[2],
                    material.exponent,
                )
            sent = (
                sent[0] + material.specular[0] * shine,
                sent[1] + material.specular[1] * shine,
                sent[2] + material.specular[2] * shine,
            )
    return sent


def textured(world, texture, point, at_u, at_v):
    """Return a texture's colour at a point."""
    if texture.is_image:
        return texel(world.texels, texture.offset, texture.width, texture.height, at_u, at_v)
    x, y, z = (
        point[0] + texture.origin[0],
        point[1] + texture.origin[1],
        point[2] + texture.origin[2],
    )
    if checker(x, y, z, texture.size) == 0:
        return colour(texture.color)
    return colour(texture.other)


def lit(world, seed, drawn, top, time, index, material, tint, at, geometric, normal, viewer, mine):
    """Return what the lights bring to the viewer from a point, and the stack's height.

    ``at`` is where shadow rays start, ``drawn`` how many places on lights were drawn before, and
    ``mine`` weight, depth and wave of the ray that came here: what light through glass has to wait
    with.
    """
    weight, depth, wave = mine
    red, green, blue = 0.0, 0.0, 0.0
    for k in range(world.lights.shape[0]):
        light = world.lights[k]
        side = 1
        if SOFT_SHADOWS:
            side = light.grid
        share = 1.0 / REAL(side * side)
        for cell in range(side * side):
            s, t = 0.5, 0.5
            if SOFT_SHADOWS:
                if light.area:
                    first = DIMENSION_SOFT_SHADOWS + drawn
                    drawn += np.uint64(2)
                    s = (REAL(cell % side) + uniform(seed, first)) / REAL(side)
                    t = (REAL(cell // side) + uniform(seed, first + ONE_MORE)) / REAL(side)
            way = to_light(light, at, s, t)
            distance = math.sqrt(cosine(way, way))
            if not distance > 0.0:
                continue
            towards = by(way, 1.0 / distance)
            cosine_light = cosine(normal, towards)
            if not (cosine_light > 0.0 and cosine(geometric, towards) > 0.0):
                world.counts[LIGHT_BEHIND] += 1
                continue
            sent = answer(material, tint, normal, towards, cosine_light, viewer)
            bright = share * strength(light, at, way, distance)
            sent = by(times(sent, colour(light.color)), bright)
            if not greatest(sent) > 0.0:
                world.counts[NO_CONTRIBUTION] += 1
                continue
            if SHADOWS:
                if light.shadows:
                    far = INFINITY if light.kind == DIRECTIONAL else 1.0
                    aim(world.rays[0], at, way, far)
                    world.counts[SHADOW] += 1
                    found = in_the_way(world, time, index, k)
                    if found == BLOCKED:
                        continue
                    if FILTERED:
                        if found != FREE:
                            top = wait(
                                world,
                                top,
                                SHADOW,
                                depth,
                                index,
                                at,
                                way,
                                far,
                                times(weight, sent),
                                wave,
                            )
                            continue
            red += sent[0]
            green += sent[1]
            blue += sent[2]
    return (red, green, blue), drawn, top


CALLEES = (to_light, strength, answer, textured, lit)
NUMBERS = {
    **{"SHADOW": SHADOW, "LIGHT_BEHIND": LIGHT_BEHIND, "NO_CONTRIBUTION": NO_CONTRIBUTION},
    **{"POINT": POINT, "DIRECTIONAL": DIRECTIONAL, "SPOT": SPOT, "RECTANGLE": RECTANGLE},
    **{"SPHERE_LIGHT": SPHERE_LIGHT, "ONE_MORE": ONE_MORE},
}
