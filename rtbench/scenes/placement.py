"""Whether camera and lights stand where they can: not inside a ball, not on a surface."""

from __future__ import annotations

import numpy as np

from rtbench.scenes.model import Camera, Disc, Light, Object, Plane, SceneError, Sphere

ROUNDING = 1e-12  # of the coordinates: what float64 cannot tell from nothing


class PlacementError(SceneError):
    """A camera or a light where it cannot be; ``light`` is the number of the light, or None."""

    def __init__(self, told: str, light: int | None) -> None:
        super().__init__("position", told)
        self.light = light


def blocked(camera: Camera, each: Object) -> str:
    """Tell how the camera is blocked by an object: ``inside``, ``on`` or, if it is not, nothing.

    Only balls have an inside that is certain; one that moves must let the camera out all the time.
    """
    if not isinstance(each, Sphere):
        return ""
    away = np.subtract(camera.position, each.center)
    moved = np.asarray(each.velocity)
    length = float(moved @ moved)
    along = min(1.0, max(0.0, float(away @ moved) / length)) if length else 0.0
    distance = float(np.linalg.norm(away - along * moved))
    near = ROUNDING * _size(camera.position, each.center)
    if abs(distance - each.radius) <= near:
        return "on"
    return "inside" if distance < each.radius else ""


def on_surface(light: Light, each: Object) -> bool:
    """Tell whether a light lies on a ball, a plane or a disc: no side of it would be the lit one.

    A rectangle does when it lies in the plane as a whole; a ball of light may be cut by a surface.
    """
    if light.kind not in ("point", "spot", "rectangle") or any(each.velocity):
        return False
    if isinstance(each, Sphere):
        if light.kind == "rectangle":
            return False
        distance = np.linalg.norm(np.subtract(light.position, each.center))
        return abs(distance - each.radius) <= ROUNDING * _size(light.position, each.center)
    if not isinstance(each, Plane | Disc):
        return False
    point = each.point if isinstance(each, Plane) else each.center
    normal = np.asarray(each.normal) / np.abs(each.normal).max()  # squares of it may underflow
    normal /= np.linalg.norm(normal)
    away = np.subtract(light.position, point)
    if abs(away @ normal) > ROUNDING * _size(light.position, point):
        return False
    if light.kind == "rectangle":
        sides = np.array([light.edge_u, light.edge_v])
        if (np.abs(sides @ normal) > ROUNDING * np.abs(sides).sum(axis=1)).any():
            return False
    return isinstance(each, Plane) or bool(np.linalg.norm(away) <= each.radius)


def check_placement(
    camera: Camera,
    lights: tuple[Light, ...],
    objects: tuple[Object, ...],
    names: list[str] | None = None,
) -> None:
    """Raise SceneError for a camera inside a ball and for a light on a surface.

    Parameters
    ----------
    camera : Camera
    lights : tuple of Light
    objects : tuple of Object
    names : list of str, optional
        Of the objects, as messages call them; ``object 3 (sphere)`` if not given.

    Raises
    ------
    SceneError
        Its key is ``position``; its attribute ``light`` is the number of the light, or None.
    """
    if names is None:
        names = [f"object {i + 1} ({type(o).__name__.lower()})" for i, o in enumerate(objects)]
    for each, name in zip(objects, names, strict=True):
        how = blocked(camera, each)
        if how:
            told = f"position {camera.position}: the camera is {how} {name}"
            raise PlacementError(told, None)
        for number, light in enumerate(lights):
            if on_surface(light, each):
                told = f"position {light.position}: light {number + 1} lies on {name}"
                raise PlacementError(told, number)


def _size(*points: tuple[float, float, float]) -> float:
    return float(np.abs(points).max()) or 1.0
