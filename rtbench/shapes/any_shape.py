"""What is done with a shape of any kind; kinds that a scene does not have cost nothing."""

from __future__ import annotations

from collections.abc import Collection

from rtbench.errors import RtbenchError, unknown
from rtbench.shapes.cone import cone, cone_across, cone_normal, onto_cone
from rtbench.shapes.disc import disc, disc_normal, onto_disc
from rtbench.shapes.plane import onto_plane, plane, plane_normal
from rtbench.shapes.records import KINDS
from rtbench.shapes.sphere import onto_sphere, sphere, sphere_normal

# Stand-ins for what each generated module puts at its top; `constants` has all.
SPHERES = CONES = DISCS = PLANES = True
SPHERE, CONE, DISC, PLANE = KINDS.values()


def hit_shape(shape, orig, dir, itself):
    """Return the least t > 0 at which a ray hits a shape, or -1; see the kinds' own functions."""
    if SPHERES and shape.kind == SPHERE:
        return sphere(shape, orig, dir, itself)
    if CONES and shape.kind == CONE:
        return cone(shape, orig, dir, itself)
    if DISCS and shape.kind == DISC:
        return disc(shape, orig, dir, itself)
    if PLANES and shape.kind == PLANE:
        return plane(shape, orig, dir, itself)
    return -1.0


def shape_normal(shape, x, y, z):
    """Return the unit normal of a shape at a point of its surface."""
    if SPHERES and shape.kind == SPHERE:
        return sphere_normal(shape, x, y, z)
    if CONES and shape.kind == CONE:
        return cone_normal(shape, x, y, z)
    return shape.axis[0], shape.axis[1], shape.axis[2]


def onto_shape(shape, x, y, z):
    """Return a point near a shape's surface moved onto it."""
    if SPHERES and shape.kind == SPHERE:
        return onto_sphere(shape, x, y, z)
    if CONES and shape.kind == CONE:
        return onto_cone(shape, x, y, z)
    if DISCS and shape.kind == DISC:
        return onto_disc(shape, x, y, z)
    if PLANES and shape.kind == PLANE:
        return onto_plane(shape, x, y, z)
    return x, y, z


CALLEES = (
    *(sphere, sphere_normal, onto_sphere),
    *(cone, cone_across, cone_normal, onto_cone),
    *(disc, disc_normal, onto_disc),
    *(plane, plane_normal, onto_plane),
    *(hit_shape, shape_normal, onto_shape),
)


def constants(kinds: Collection[str]) -> dict[str, str]:
    """Return what a generated module needs at its top, after REAL, for `CALLEES`.

    Parameters
    ----------
    kinds : collection of str
        What the scene has, of ``KINDS``.

    Returns
    -------
    dict of str to str
        Names and the source text of their values.

    Raises
    ------
    RtbenchError
        For an unknown kind.
    """
    for kind in kinds:
        if kind not in KINDS:
            raise RtbenchError(unknown("shapes", kind, KINDS))
    return {
        **{name.upper(): str(name in kinds) for name in KINDS},
        **{name.upper().removesuffix("S"): str(code) for name, code in KINDS.items()},
        "ROUNDOFF": "REAL(np.finfo(REAL).eps / 2)",
        "LARGEST": "np.finfo(REAL).max",
    }
