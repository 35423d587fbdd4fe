"""Whether a plane before the camera would cut off what is in view, for formats that have one."""

from __future__ import annotations

import math

import numpy as np

from rtbench.scenes.model import Camera, Cone, Object, Sphere, Triangles


def is_cut(camera: Camera, hither: float, objects: list[Object]) -> bool:
    """Tell whether corners of triangles, spheres or ends of cones in view lie before a plane.

    Parameters
    ----------
    camera : Camera
    hither : float
        The plane's distance from the camera.
    objects : list of Object
        Of planes and discs nothing is told, nor of triangles whose corners are all beyond.
    """
    points, radii = [np.zeros((0, 3))], [np.zeros(0)]
    for each in objects:
        if isinstance(each, Triangles):
            points.append(each.corners.reshape(-1, 3))
            radii.append(np.zeros(len(points[-1])))
        elif isinstance(each, Sphere):
            points.append(np.array([each.center]))
            radii.append(np.array([each.radius]))
        elif isinstance(each, Cone):
            points.append(np.array([each.base, each.apex]))
            radii.append(np.array([each.base_radius, each.apex_radius]))
    radius = np.concatenate(radii)
    x, y, depth = camera.axes @ (np.concatenate(points) - camera.position).T
    found = (depth + radius > 0) & (depth - radius < hither)
    tall = math.tan(math.radians(camera.angle) / 2)
    for along, half in ((y, tall), (x, tall * camera.width / camera.height)):
        # Nearer to the side of the pyramid of view than their radius, or within it.
        found &= np.abs(along) - half * depth <= radius * math.hypot(1.0, half)
    return bool(found.any())
