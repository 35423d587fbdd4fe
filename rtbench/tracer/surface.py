"""Where a ray hit: the point, the normals, from where the next rays may start.

The point is computed from the primitive, not along the ray, so that its error does not grow with
the ray's length. Rays start off a flat primitive by more than this error: ``margin`` along its
normal, and inside its edges by ``inset``, so that they start on the right side of its neighbours
too; no length is chosen by the scene's author, all are bounds of what was rounded.

Source: bounds after Pharr, Jakob & Humphreys 2023, section 6.8; the inset is ours.
"""

from __future__ import annotations

import math

import numpy as np

from rtbench.shapes.any_shape import onto_shape, shape_normal

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
TRIANGLES = SHAPES = MOTION = SMOOTH_NORMALS = TEXTURE = RETURNS_THREE = False
CURVED = 3  # shapes of this kind and above are flat
OFF = REAL(0)


def weights(face, x, y, z, u, v):
    """Return the weights of a triangle's corners, none nearer to 0 than the inset."""
    if not RETURNS_THREE:
        # (P - v0) as a sum of the edges: areas seen along the normal's greatest component.
        nx, ny, nz = face.normal[0], face.normal[1], face.normal[2]
        i, j = 0, 1
        if abs(nx) >= abs(ny) and abs(nx) >= abs(nz):
            i, j = 1, 2
        elif abs(ny) >= abs(nz):
            i, j = 2, 0
        p, q = x, y
        if i == 1:
            p, q = y, z
        elif i == 2:
            p, q = z, x
        a, b = face.v1[i] - face.v0[i], face.v1[j] - face.v0[j]
        c, d = face.v2[i] - face.v0[i], face.v2[j] - face.v0[j]
        p, q = p - face.v0[i], q - face.v0[j]
        area = a * d - b * c
        u, v = (p * d - q * c) / area, (a * q - b * p) / area
    u = min(max(u, face.inset), 1.0)
    v = min(max(v, face.inset), 1.0)
    w = min(max(1.0 - u - v, face.inset), 1.0)
    scale = 1.0 / (u + v + w)
    return w * scale, u * scale, v * scale


def surface(world, ray, time, index, t, u, v):
    """Return what a ray hit.

    Returns
    -------
    point, geometric, normal : three tuples of three
        The surface's own normal and that to be shaded with, both on the ray's side, of length 1.
    margin : REAL
        How far along the normal rays must start.
    front : bool
        Whether the ray came from outside.
    at_u, at_v : REAL
        Image coordinates.
    """
    at_u, at_v = 0.0, 0.0
    if TRIANGLES and (not SHAPES or index < world.faces.shape[0]):
        face = world.faces[index]
        gx, gy, gz = face.normal[0], face.normal[1], face.normal[2]
        px, py, pz = 0.0, 0.0, 0.0
        if not RETURNS_THREE:
            px = ray.orig[0] + t * ray.dir[0]
            py = ray.orig[1] + t * ray.dir[1]
            pz = ray.orig[2] + t * ray.dir[2]
            if MOTION:
                px -= time * world.velocities[index, 0]
                py -= time * world.velocities[index, 1]
                pz -= time * world.velocities[index, 2]
        a, b, c = weights(face, px, py, pz, u, v)
        px = a * face.v0[0] + b * face.v1[0] + c * face.v2[0]
        py = a * face.v0[1] + b * face.v1[1] + c * face.v2[1]
        pz = a * face.v0[2] + b * face.v1[2] + c * face.v2[2]
        nx, ny, nz = gx, gy, gz
        if SMOOTH_NORMALS:
            if face.smooth:
                at = world.normals
                nx = a * at[index, 0, 0] + b * at[index, 1, 0] + c * at[index, 2, 0]
                ny = a * at[index, 0, 1] + b * at[index, 1, 1] + c * at[index, 2, 1]
                nz = a * at[index, 0, 2] + b * at[index, 1, 2] + c * at[index, 2, 2]
                length = math.sqrt(nx * nx + ny * ny + nz * nz)
                if length > 0.0:
                    nx, ny, nz = nx / length, ny / length, nz / length
                else:
                    nx, ny, nz = gx, gy, gz
        if TEXTURE:
            at = world.coordinates
            at_u = a * at[index, 0, 0] + b * at[index, 1, 0] + c * at[index, 2, 0]
            at_v = a * at[index, 0, 1] + b * at[index, 1, 1] + c * at[index, 2, 1]
        margin = face.margin
    else:
        shape = world.shapes[index - world.faces.shape[0]]
        px = ray.orig[0] + t * ray.dir[0]
        py = ray.orig[1] + t * ray.dir[1]
        pz = ray.orig[2] + t * ray.dir[2]
        if MOTION:
            px -= time * world.velocities[index, 0]
            py -= time * world.velocities[index, 1]
            pz -= time * world.velocities[index, 2]
        px, py, pz = onto_shape(shape, px, py, pz)
        gx, gy, gz = shape_normal(shape, px, py, pz)
        nx, ny, nz = gx, gy, gz
        margin = 0.0
        if shape.kind >= CURVED:
            margin = OFF * (
                max(abs(px), abs(py), abs(pz))
                + max(abs(shape.point[0]), abs(shape.point[1]), abs(shape.point[2]))
            )
    if MOTION:
        vx = world.velocities[index, 0]
        vy = world.velocities[index, 1]
        vz = world.velocities[index, 2]
        if vx != 0.0 or vy != 0.0 or vz != 0.0:  # what stands is not rounded once more
            px += time * vx
            py += time * vy
            pz += time * vz
            margin += OFF * max(abs(px), abs(py), abs(pz))
    front = ray.dir[0] * gx + ray.dir[1] * gy + ray.dir[2] * gz <= 0.0
    if not front:
        gx, gy, gz = -gx, -gy, -gz
    if nx * gx + ny * gy + nz * gz < 0.0:
        nx, ny, nz = -nx, -ny, -nz
    return (px, py, pz), (gx, gy, gz), (nx, ny, nz), margin, front, at_u, at_v


CALLEES = (weights, surface)
NUMBERS = {"CURVED": CURVED}
