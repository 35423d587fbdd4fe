"""The records that the compiled tracer reads, of what a scene has beside its tree."""

from __future__ import annotations

import numpy as np


def face_type(real: type) -> np.dtype:
    """Return the dtype of what shading reads of a triangle."""
    return np.dtype(
        [
            *((name, real, 3) for name in ("v0", "v1", "v2", "normal")),
            ("inset", real),
            ("margin", real),
            ("smooth", np.int64),
        ],
        align=True,
    )


def material_type(real: type) -> np.dtype:
    """Return the dtype of a material."""
    colours = ("ambient", "diffuse", "specular", "reflection", "transmission", "emission")
    numbers = ("diffuse_roughness", "exponent", "index", "abbe", "roughness")
    return np.dtype(
        [
            *((name, real, 3) for name in colours),
            *((name, real) for name in numbers),
            *((name, np.int64) for name in ("is_blinn", "fresnel", "transmits", "texture")),
        ],
        align=True,
    )


def light_type(real: type) -> np.dtype:
    """Return the dtype of a light."""
    vectors = ("position", "direction", "color", "edge_u", "edge_v")
    return np.dtype(
        [
            *((name, real, 3) for name in vectors),
            *((name, real) for name in ("radius", "cos_inner", "cos_outer")),
            *((name, np.int64) for name in ("kind", "falls_off", "area", "grid", "shadows")),
        ],
        align=True,
    )


def texture_type(real: type) -> np.dtype:
    """Return the dtype of a texture."""
    return np.dtype(
        [
            *((name, real, 3) for name in ("color", "other", "origin")),
            ("size", real),
            *((name, np.int64) for name in ("is_image", "offset", "width", "height")),
        ],
        align=True,
    )


def camera_type(real: type) -> np.dtype:
    """Return the dtype of a camera: ``right`` and ``up`` reach to the picture's sides.

    ``per_column`` and ``per_row`` say how much of them a pixel takes.
    """
    vectors = ("position", "right", "up", "forward", "across", "upward")
    return np.dtype(
        [
            *((name, real, 3) for name in vectors),
            ("lens_radius", real),
            ("focus", real),
            ("per_column", real),
            ("per_row", real),
            ("width", np.int64),
            ("height", np.int64),
        ],
        align=True,
    )


def settings_type(real: type) -> np.dtype:
    """Return the dtype of the settings."""
    return np.dtype(
        [
            ("background", real, 3),
            ("threshold", real),
            ("noise", real),
            ("tolerance", real),
            *((name, np.int64) for name in ("depth", "bounces", "samples", "side", "stride")),
            *((name, np.int64) for name in ("grid_x", "grid_y", "bilinear", "planes")),
        ],
        align=True,
    )


def waiting_type(real: type) -> np.dtype:
    """Return the dtype of a ray that waits to be traced."""
    return np.dtype(
        [
            *((name, real, 3) for name in ("orig", "dir", "weight")),
            ("far", real),
            ("wave", real),
            *((name, np.int64) for name in ("kind", "depth", "start")),
        ],
        align=True,
    )
