"""Rays that a surface sends on: mirrored, refracted, and anywhere at random."""

from __future__ import annotations

import numpy as np

from rtbench.tracer.optics import band, fresnel, index_for, reflected, refracted
from rtbench.tracer.sampling import DIMENSIONS, cosine_direction, facet, uniform
from rtbench.tracer.waiting import by, colour, cosine, greatest, off, times, wait

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
REFLECTION = REFRACTION = DISPERSION = GLOSSY = FRESNEL = False
DIMENSION_GLOSSY, DIMENSION_DISPERSION = DIMENSIONS["glossy"], DIMENSIONS["dispersion"]
DIMENSION_INDIRECT = DIMENSIONS["indirect"]
INFINITY = REAL(np.inf)
REFLECTED, REFRACTED, INDIRECTED, BELOW_THRESHOLD, TOO_DEEP = 2, 3, 4, 7, 8
ONE_MORE = np.uint64(1)


def bounced(world, seed, drawn, top, index, material, tint, at, geometric, normal, mine):
    """Send a ray on in a random direction, for light that comes by way of diffuse surfaces.

    Returns
    -------
    drawn : uint64
        How many random numbers were drawn for this effect so far.
    top : int
        The height of the stack of waiting rays.

    Sources: Kajiya 1986; Arvo & Kirk 1990 (Russian roulette).
    """
    weight, depth, wave = mine
    settings = world.settings[0]
    onward = times(weight, times(colour(material.diffuse), tint))
    chance = 1.0
    if depth >= 2:
        chance = min(1.0, greatest(onward))
        drawn += ONE_MORE
        if not uniform(seed, DIMENSION_INDIRECT + drawn) < chance:
            chance = 0.0
    if chance > 0.0 and greatest(onward) > 0.0 and settings.bounces > 0:
        if depth < settings.bounces:
            s = uniform(seed, DIMENSION_INDIRECT + drawn + ONE_MORE)
            drawn += np.uint64(2)
            way = cosine_direction(
                normal[0],
                normal[1],
                normal[2],
                s,
                uniform(seed, DIMENSION_INDIRECT + drawn),
            )
            if cosine(way, geometric) > 0.0:
                world.counts[INDIRECTED] += 1
                top = wait(
                    world,
                    top,
                    INDIRECTED,
                    depth + 1,
                    index,
                    at,
                    way,
                    INFINITY,
                    by(onward, 1.0 / chance),
                    wave,
                )

    return drawn, top


def sent(world, top, kind, depth, index, at, way, weight, wave):
    """Send a ray on if it is not too deep and can change the pixel; return the stack's height."""
    settings = world.settings[0]
    if not greatest(weight) > 0.0:
        return top
    if depth >= settings.depth:
        world.counts[TOO_DEEP] += 1
        return top
    if greatest(weight) <= settings.threshold:
        world.counts[BELOW_THRESHOLD] += 1
        return top
    world.counts[kind] += 1
    return wait(world, top, kind, depth + 1, index, at, way, INFINITY, weight, wave)


def mirrored(dir, geometric, normal):
    """Return the mirrored direction.

    What a smooth normal or a facet would mirror into the surface is turned back up by the surface
    itself: so the directions of a rough mirror have no gap or peak.
    """
    x, y, z = reflected(dir[0], dir[1], dir[2], normal[0], normal[1], normal[2])
    if not cosine((x, y, z), geometric) > 0.0:
        x, y, z = reflected(x, y, z, geometric[0], geometric[1], geometric[2])
    return x, y, z


def in_band(world, seed, bands, each, weight):
    """Return what of a weight is in one of three bands of colour, and a wavelength in it."""
    part = (
        weight[0] if each == 0 else 0.0,
        weight[1] if each == 1 else 0.0,
        weight[2] if each == 2 else 0.0,
    )
    return part, band(each, uniform(seed, DIMENSION_DISPERSION + bands))


def sent_on(world, seed, facets, bands, top, index, material, point, margin, front, ways, mine):
    """Send mirrored and refracted rays on.

    ``ways``: the ray's direction, the surface's own normal and that to be shaded with.

    Returns
    -------
    facets, bands : uint64
        How many random numbers were drawn for rough surfaces and for wavelengths so far.
    top : int
        The height of the stack of waiting rays.

    Sources: Whitted 1980; Hall & Greenberg 1983 (weights); Cook, Porter & Carpenter 1984.
    """
    dir, geometric, normal = ways
    weight, depth, wave = mine
    mirror = 0.0, 0.0, 0.0
    if REFLECTION:
        mirror = colour(material.reflection)
    window = 0.0, 0.0, 0.0
    if REFRACTION:
        window = colour(material.transmission)
    if not (greatest(mirror) > 0.0 or greatest(window) > 0.0):
        return facets, bands, top
    if GLOSSY:
        if material.roughness > 0.0:
            s = uniform(seed, DIMENSION_GLOSSY + facets)
            t = uniform(seed, DIMENSION_GLOSSY + facets + ONE_MORE)
            facets += np.uint64(2)
            nx, ny, nz = normal
            normal = facet(nx, ny, nz, -dir[0], -dir[1], -dir[2], material.roughness, s, t)
    parts = 1
    if DISPERSION:
        if material.abbe > 0.0 and wave == 0.0 and greatest(window) > 0.0:
            parts = 3
    for each in range(parts):
        part = weight
        if DISPERSION:
            if parts == 3:
                part, wave = in_band(world, seed, bands, each, weight)
                bands += ONE_MORE
        back = times(part, mirror)
        if FRESNEL:
            inside = material.index
            if DISPERSION:
                if wave > 0.0:
                    inside = index_for(material.index, material.abbe, wave)
            ratio = 1.0 / inside if front else inside
            returned = 0.0
            if material.fresnel:
                returned = fresnel(-cosine(dir, normal), ratio)
                back = by(back, returned)
            if REFRACTION:
                if greatest(window) > 0.0:
                    through = times(part, window)
                    x, y, z, total = refracted(
                        dir[0], dir[1], dir[2], normal[0], normal[1], normal[2], ratio
                    )
                    if not total:
                        beyond = off(point, geometric, -margin)
                        through = by(through, 1.0 - returned)
                        top = sent(
                            world, top, REFRACTED, depth, index, beyond, (x, y, z), through, wave
                        )
                    elif material.fresnel:
                        back = (
                            max(back[0], through[0]),
                            max(back[1], through[1]),
                            max(back[2], through[2]),
                        )
                    else:
                        back = part
        if greatest(back) > 0.0:
            at = off(point, geometric, margin)
            way = mirrored(dir, geometric, normal)
            top = sent(world, top, REFLECTED, depth, index, at, way, back, wave)
    return facets, bands, top


CALLEES = (bounced, sent, mirrored, in_band, sent_on)
NUMBERS = {
    **{"REFLECTED": REFLECTED, "REFRACTED": REFRACTED, "INDIRECTED": INDIRECTED},
    **{"BELOW_THRESHOLD": BELOW_THRESHOLD, "TOO_DEEP": TOO_DEEP, "ONE_MORE": ONE_MORE},
}
