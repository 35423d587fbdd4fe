"""Every key of scene files in TOML: what it holds, its unit, what it is if not given.

Documentation and checks both come from here: a key that is not in these tables is refused.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from rtbench.scenes import model

REQUIRED = "required"
HOLDS = {
    "text": "in quotes",
    "texts": "an array of texts",
    "number": "finite",
    "whole": "a whole number",
    "switch": "true or false",
    "point": "three numbers x, y, z; also a direction, of any length",
    "angles": "three numbers in degrees",
    "color": "linear red, green and blue, or one number for grey; 0 or more",
    "points": "an array of points",
    "pairs": "an array of pairs of numbers",
    "table": "a table of its own, as told below",
}
"""What a value can be."""


@dataclass(frozen=True)
class Key:
    """A key.

    Attributes
    ----------
    name : str
    holds : str
        One of HOLDS.
    text : str
        What it means, for people.
    default : object
        What it is if not given; REQUIRED; None: nothing.
    unit : str
    example : object
        A value that it can have, where there is no default.
    allowed : tuple of str
        Of texts: all that it can be, if few.
    """

    name: str
    holds: str
    text: str
    default: Any = REQUIRED
    unit: str = ""
    example: Any = None
    allowed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Table:
    """A table: how its header looks, what it is, its keys, and the table whose keys it has too."""

    heading: str
    text: str
    keys: tuple[Key, ...]
    also: str = ""


def _of(cls: type, name: str, holds: str, text: str, **more: Any) -> Key:
    """Return a key that a class of the model has, with the default that it has there."""
    if "default" not in more:
        more["default"] = next(f.default for f in dataclasses.fields(cls) if f.name == name)
    return Key(name, holds, text, **more)


_C, _L, _M, _T = model.Camera, model.Light, model.Material, model.Texture
_PLACES = Key("position", "point", "where it is", example=(2, 5, 3))
_WAY = Key("direction", "point", "where its light goes", example=(-1, -2, -1))
_GRID = _of(_L, "grid", "whole", "grid x grid shadow rays, one at random in each cell")
_CENTER = Key("center", "point", "its middle", example=(0, 1, 0))
_NORMAL = Key("normal", "point", "across it; of any length", example=(0, 1, 0))
_RADIUS = Key("radius", "number", "above 0", example=0.5)
_CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0))
_BASE = Key("base", "point", "the middle of one end", example=(0, 0, 0))
_APEX = Key("apex", "point", "the middle of the other end", example=(0, 1, 0))
_UV = Key("coordinates", "pairs", "u and v of an image at the vertices; (0, 0) is lower left", None)
_ROTATE = Key("rotate", "angles", "about x, then y, then z", (0.0, 0.0, 0.0), unit="degrees")

FORMAT: dict[str, Table] = {
    "scene": Table(
        "",
        "At the top of the file, before any table; lengths are in a unit of your choice",
        (
            Key("name", "text", "of the scene; the file's if not given", None, example="glass"),
            _of(model.Scene, "background", "color", "what rays bring that hit nothing"),
            _of(model.Scene, "ambient", "color", "light that is everywhere"),
            Key(
                "include",
                "texts",
                "other scene files, beside this one, whose materials, lights and objects are "
                "added; what else they hold does not count",
                (),
            ),
            Key("camera", "table", "where the picture is taken from", example={}),
            Key("settings", "table", "how the scene is traced", None),
            Key("materials", "table", "one table each, by name", None),
            Key("lights", "table", "one table each", None),
            Key("objects", "table", "one table each", None),
        ),
    ),
    "camera": Table(
        "[camera]",
        "A pinhole, or a thin lens",
        (
            Key("position", "point", "the eye, or the middle of the lens", example=(0, 1, 5)),
            Key("target", "point", "what it looks at", example=(0, 1, 0)),
            _of(_C, "up", "point", "what is up in the picture"),
            _of(_C, "angle", "number", "from the lower to the upper side", unit="degrees"),
            _of(_C, "width", "whole", "of the picture", unit="pixels"),
            _of(_C, "height", "whole", "of the picture", unit="pixels"),
            _of(_C, "lens_radius", "number", "of the thin lens; 0: a pinhole"),
            _of(_C, "focus", "number", "sharp at this distance; if not given, at the target"),
        ),
    ),
    "settings": Table(
        "[settings]",
        "How the scene is traced, as far as that belongs to it",
        (
            _of(model.Settings, "depth", "whole", "generations of mirrored and refracted rays"),
            _of(
                model.Settings,
                "threshold",
                "number",
                "rays that could not change a pixel by more are not shot",
            ),
            _of(model.Settings, "samples", "whole", "rays a pixel, a square number: 1, 4, 9 ..."),
            Key("indirect", "table", "light by way of diffuse surfaces", None),
        ),
    ),
    "indirect": Table(
        "[settings.indirect]",
        "Light by way of diffuse surfaces, by path tracing; none without this table",
        (
            _of(model.Indirect, "samples", "whole", "paths a pixel, at most"),
            _of(model.Indirect, "noise", "number", "standard error at which a pixel is done"),
            _of(model.Indirect, "depth", "whole", "bounces, at most"),
        ),
    ),
    "material": Table(
        "[materials.NAME]",
        "How a surface answers to light",
        (
            _of(_M, "ambient", "color", "times the scene's ambient light"),
            _of(_M, "diffuse", "color", "times the cosine to the light"),
            _of(
                _M,
                "diffuse_roughness",
                "number",
                "slopes of a rough diffuse surface (Oren & Nayar); 0: Lambert's",
                unit="degrees",
            ),
            _of(_M, "specular", "color", "of the highlight"),
            _of(_M, "exponent", "number", "of the highlight's cosine: large is sharp"),
            _of(_M, "highlight", "text", "whose highlight", allowed=model.HIGHLIGHTS),
            _of(_M, "reflection", "color", "times what a mirrored ray brings; up to 1"),
            _of(_M, "transmission", "color", "times what a refracted ray brings; up to 1"),
            _of(_M, "index", "number", "of refraction, inside; outside it is 1"),
            _of(_M, "fresnel", "switch", "part the light between the two by Fresnel's equations"),
            _of(_M, "abbe", "number", "Abbe number: the index depends on colour; else it does not"),
            _of(_M, "roughness", "number", "of mirror and window, 0 to 1 (GGX's alpha)"),
            _of(_M, "emission", "color", "what it sends by itself"),
            Key("texture", "table", "multiplies ambient and diffuse", None),
        ),
    ),
    "texture": Table(
        "[materials.NAME.texture]",
        'Colour from place to place; also in one line: texture = {kind = "checker", size = 2}',
        (Key("kind", "text", "", example="checker", allowed=model.TEXTURE_KINDS),),
    ),
    "checker": Table(
        'texture, kind = "checker"',
        "Cubes in the space of the scene",
        (
            _of(_T, "size", "number", "side of a cube"),
            _of(_T, "color", "color", "of one half of the cubes"),
            _of(_T, "other", "color", "of the other half"),
        ),
        also="texture",
    ),
    "image": Table(
        'texture, kind = "image"',
        "Pixels over u and v, repeated",
        (Key("file", "text", "PNG, JPEG ..., in sRGB; beside the scene", example="wood.png"),),
        also="texture",
    ),
    "light": Table(
        "[[lights]]",
        "A light, one table each",
        (
            Key("kind", "text", "", example="point", allowed=model.LIGHT_KINDS),
            _of(_L, "color", "color", "what a white surface sends back that faces it"),
            _of(_L, "falloff", "text", "with distance", allowed=model.FALLOFFS),
            _of(_L, "shadows", "switch", "whether objects stand in its way"),
        ),
    ),
    "point": Table('lights, kind = "point"', "From one point, all ways", (_PLACES,), also="light"),
    "directional": Table('lights, kind = "directional"', "From afar", (_WAY,), also="light"),
    "spot": Table(
        'lights, kind = "spot"',
        "From one point, in a cone",
        (
            _PLACES,
            _WAY,
            _of(_L, "inner", "number", "full light up to here from the axis", unit="degrees"),
            _of(_L, "outer", "number", "none from here on", unit="degrees"),
        ),
        also="light",
    ),
    "rectangle": Table(
        'lights, kind = "rectangle"',
        "From an area: soft shadows",
        (
            Key("position", "point", "its middle", example=(0, 5, 0)),
            Key("edge_u", "point", "one side", example=(1, 0, 0)),
            Key("edge_v", "point", "the other", example=(0, 0, 1)),
            _GRID,
        ),
        also="light",
    ),
    "ball": Table(
        'lights, kind = "sphere"', "From a ball: soft shadows", (_PLACES, _RADIUS, _GRID), "light"
    ),
    "object": Table(
        "[[objects]]",
        "An object, one table each",
        (
            Key("kind", "text", "", example="sphere"),
            Key("material", "text", "NAME of [materials.NAME]", example="red"),
            _of(model.Object, "velocity", "point", "how far it moves while the shutter is open"),
        ),
    ),
}


def _object(kind: str, text: str, *keys: Key) -> None:
    FORMAT[kind] = Table(f'objects, kind = "{kind}"', text, keys, also="object")


_object("sphere", "A ball", _CENTER, _RADIUS)
_object("cylinder", "A tube without its ends", _BASE, _APEX, _RADIUS)
_object(
    "cone",
    "A cone, or a part of one, without its ends",
    _BASE,
    _APEX,
    Key("base_radius", "number", "at the base", example=1.0),
    Key("apex_radius", "number", "at the apex", 0.0),
)
_object("plane", "An infinite plane", Key("point", "point", "on it", example=(0, 0, 0)), _NORMAL)
_object("disc", "A flat disc", _CENTER, _NORMAL, _RADIUS)
_object("triangle", "Of three vertices", Key("vertices", "points", "three", example=_CORNERS), _UV)
_object(
    "polygon",
    "Of vertices in one plane, counter-clockwise seen from outside; need not be convex",
    Key("vertices", "points", "three or more", example=(*_CORNERS[:2], (1, 1, 0), (0, 1, 0))),
    _UV,
)
_object(
    "patch",
    "A polygon with normals, so that it looks smooth",
    Key("vertices", "points", "three or more", example=_CORNERS),
    Key("normals", "points", "one a vertex", example=((-1, 0, 2), (1, 0, 2), (0, 1, 2))),
    _UV,
)
_object(
    "box",
    "Twelve triangles between two corners, sides along the axes",
    Key("corner", "point", "one corner", example=(0, 0, 0)),
    Key("opposite", "point", "the one opposite", example=(1, 2, 1)),
    dataclasses.replace(_ROTATE, text="about its middle: about x, then y, then z"),
)
_object(
    "mesh",
    "Triangles of a file or a generated model: fitted, scaled, turned, moved",
    Key("file", "text", "PLY, STL, OBJ, OFF, glTF ..., beside the scene", None),
    Key("model", "text", "instead of a file: a generated one, of so many triangles", None),
    Key("fit", "number", "its longest side, its middle to (0, 0, 0); else as it is", None),
    Key("scale", "number", "times this", 1.0),
    _ROTATE,
    Key("move", "point", "by this", (0.0, 0.0, 0.0)),
    Key("smooth", "switch", "normals at its vertices, so that it looks smooth", False),
)

OBJECT_KINDS = tuple(name for name, table in FORMAT.items() if table.also == "object")
"""Kinds of objects."""


def keys_of(table: str) -> dict[str, Key]:
    """Return the keys of a table of FORMAT by name, those it shares with others first."""
    found = FORMAT[table]
    shared = FORMAT[found.also].keys if found.also else ()
    return {key.name: key for key in (*shared, *found.keys)}
