"""What a scene is: a camera, lights, materials, objects, and how it is to be traced.

Plain values, checked where they are made. Lengths are in the scene's own unit; angles are in
degrees; colours are linear red, green and blue, mostly from 0 to 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from rtbench.errors import RtbenchError, unknown

Triple = tuple[float, float, float]

LIGHT_KINDS = ("point", "directional", "spot", "rectangle", "sphere")
FALLOFFS = ("none", "inverse_square")
HIGHLIGHTS = ("phong", "blinn_phong")
TEXTURE_KINDS = ("checker", "image")
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
GREATEST = 2.0**60  # beyond, squares of lengths leave float32


class SceneError(RtbenchError):
    """A value that a scene cannot have.

    Attributes
    ----------
    key : str
        Which one, as scene files name it: a reader finds its line by it.
    """

    def __init__(self, key: str, told: str) -> None:
        super().__init__(told)
        self.key = key


def check_number(key: str, value: float, low: float, high: float, allowed: str) -> None:
    """Raise SceneError unless low <= value <= high, which NaN is not."""
    if not low <= value <= high:
        raise SceneError(key, f"{key} {value:g} is not allowed (allowed: {allowed})")


def check_point(key: str, value: Triple) -> None:
    """Raise SceneError for coordinates that are not finite or too large."""
    for each in value:
        check_number(key, abs(each), 0.0, GREATEST, f"finite, up to {GREATEST:g}")


def check_colour(key: str, value: Triple, high: float = math.inf) -> None:
    """Raise SceneError for a colour with a negative, infinite or too large part."""
    top = np.nextafter(np.inf, 0) if math.isinf(high) else high
    for each in value:
        check_number(
            key, each, 0.0, top, "0 or more" if math.isinf(high) else f"from 0 to {high:g}"
        )


def check_direction(key: str, value: Triple) -> None:
    """Raise SceneError for a direction of no length."""
    check_point(key, value)
    if not any(value):
        raise SceneError(key, f"{key} {tuple(value)} has no direction")


@dataclass(frozen=True)
class Camera:
    """Where the picture is taken from: a pinhole, or a thin lens.

    Attributes
    ----------
    position, target, up : (float, float, float)
    angle : float
        From the lower to the upper side of the picture, in degrees; pixels are square.
    width, height : int
        Pixels.
    lens_radius : float
        Of the thin lens; 0: a pinhole.
    focus : float or None
        How far from the lens, along the view, is sharp; None: as far as the target.
    """

    position: Triple = (0.0, 0.0, 5.0)
    target: Triple = (0.0, 0.0, 0.0)
    up: Triple = (0.0, 1.0, 0.0)
    angle: float = 45.0
    width: int = 512
    height: int = 512
    lens_radius: float = 0.0
    focus: float | None = None

    def __post_init__(self) -> None:
        check_point("position", self.position)
        check_point("target", self.target)
        check_direction("up", self.up)
        check_number("angle", self.angle, 1e-6, 179.0, "above 0, up to 179 degrees")
        for key in ("width", "height"):
            value = getattr(self, key)
            check_number(key, value, 1, 16384, "1 to 16384 pixels")
        check_number("lens_radius", self.lens_radius, 0.0, GREATEST, "0 or more")
        if self.focus is not None:
            check_number("focus", self.focus, 1e-30, GREATEST, "above 0")
        if self.distance == 0:
            raise SceneError("target", f"target {self.target} is where the camera stands")
        if not np.isfinite(self.axes).all():
            raise SceneError("up", f"up {self.up} lies along the view: nothing tells what is up")

    @property
    def distance(self) -> float:
        """From the camera to its target."""
        return float(np.linalg.norm(np.subtract(self.target, self.position)))

    @property
    def axes(self) -> np.ndarray:
        """Right, up and forward, each of length 1, (3, 3) float64."""
        forward = np.subtract(self.target, self.position, dtype=np.float64)
        up = np.asarray(self.up, dtype=np.float64)
        with np.errstate(invalid="ignore", divide="ignore"):
            forward = forward / np.linalg.norm(forward)
            right = np.cross(forward, up / np.linalg.norm(up))
            length = np.linalg.norm(right)
            right = right / (length if length > 1e-12 else 0.0)
        return np.stack([right, np.cross(right, forward), forward])


@dataclass(frozen=True)
class Light:
    """A light.

    Attributes
    ----------
    kind : str
        One of LIGHT_KINDS.
    position : (float, float, float)
        Of a point, a spot, the middle of a rectangle or a sphere; of no use to directional ones.
    direction : (float, float, float)
        Where the light goes, of directional lights and spots; of any length.
    color : (float, float, float)
        What a white surface that faces the light sends back, at distance 1 if it falls off.
    falloff : str
        One of FALLOFFS: with distance d not at all, or by 1 / d^2.
    inner, outer : float
        Of a spot: full light up to the inner angle from its axis, none from the outer on; degrees.
    edge_u, edge_v : (float, float, float)
        The sides of a rectangle.
    radius : float
        Of a sphere.
    grid : int
        Of rectangles and spheres: grid x grid shadow rays, one at random in each cell
        (Cook 1984; Šilhavý 2010, 2.2.1: 8 x 8).
    shadows : bool
        Whether objects stand in its way.
    """

    kind: str = "point"
    position: Triple = (0.0, 0.0, 0.0)
    direction: Triple = (0.0, -1.0, 0.0)
    color: Triple = WHITE
    falloff: str = "none"
    inner: float = 20.0
    outer: float = 25.0
    edge_u: Triple = (1.0, 0.0, 0.0)
    edge_v: Triple = (0.0, 0.0, 1.0)
    radius: float = 0.5
    grid: int = 8
    shadows: bool = True

    def __post_init__(self) -> None:
        for key, allowed in (("kind", LIGHT_KINDS), ("falloff", FALLOFFS)):
            if getattr(self, key) not in allowed:
                raise SceneError(key, unknown(key, str(getattr(self, key)), allowed))
        check_point("position", self.position)
        if self.kind in ("directional", "spot"):
            check_direction("direction", self.direction)
        check_colour("color", self.color)
        check_number("inner", self.inner, 0.0, 180.0, "0 to 180 degrees")
        check_number("outer", self.outer, self.inner, 180.0, "from inner to 180 degrees")
        if self.kind == "rectangle":
            check_direction("edge_u", self.edge_u)
            check_direction("edge_v", self.edge_v)
            if not np.any(np.cross(self.edge_u, self.edge_v)):
                raise SceneError("edge_v", "edge_u and edge_v are parallel: they span nothing")
        if self.kind == "sphere":
            check_number("radius", self.radius, 1e-30, GREATEST, "above 0")
        check_number("grid", self.grid, 1, 64, "1 to 64")

    @property
    def is_area(self) -> bool:
        """Whether it casts soft shadows."""
        return self.kind in ("rectangle", "sphere")


@dataclass(frozen=True, eq=False)
class Texture:
    """What colours a material from place to place.

    Attributes
    ----------
    kind : str
        ``checker``: cubes of side ``size``, by turns ``color`` and ``other``, in the space of the
        scene; ``image``: pixels over (u, v), (0, 0) in the lower left corner, repeated.
    size : float
    color, other : (float, float, float)
    pixels : (H, W, 3) float32 array or None
        Of an image, linear, row 0 on top.
    source : str
        The image's file, for people.
    """

    kind: str = "checker"
    size: float = 1.0
    color: Triple = WHITE
    other: Triple = BLACK
    pixels: np.ndarray | None = None
    source: str = ""

    def __post_init__(self) -> None:
        if self.kind not in TEXTURE_KINDS:
            raise SceneError("kind", unknown("kind", self.kind, TEXTURE_KINDS))
        check_number("size", self.size, 1e-30, GREATEST, "above 0")
        check_colour("color", self.color)
        check_colour("other", self.other)
        if self.kind == "image" and self.pixels is None:
            raise SceneError("file", "a texture of kind 'image' needs a file")


@dataclass(frozen=True, eq=False)
class Material:
    """How a surface answers to light.

    Attributes
    ----------
    ambient : (float, float, float)
        Times the scene's ambient light (Phong 1975).
    diffuse : (float, float, float)
        Times the cosine to the light (Lambert).
    diffuse_roughness : float
        Standard deviation of the slopes of a rough diffuse surface, in degrees (Oren & Nayar
        1994); 0: Lambert's.
    specular : (float, float, float)
        Of the highlight.
    exponent : float
        Of the highlight's cosine.
    highlight : str
        One of HIGHLIGHTS.
    reflection, transmission : (float, float, float)
        What mirrored and refracted rays bring, each times this (Whitted 1980).
    index : float
        Of refraction, inside; outside it is 1.
    fresnel : bool
        Whether Fresnel's equations part the light between reflection and transmission, which are
        then tints of either; otherwise both count as they are.
    abbe : float or None
        Abbe number: how the index depends on the colour of light; None: not at all.
    roughness : float
        Of the mirror and the window: width of the slopes of small facets (GGX's alpha; Walter et
        al. 2007); 0: smooth.
    emission : (float, float, float)
        What the surface sends by itself, whatever falls on it.
    texture : Texture or None
        Multiplies ambient and diffuse.
    name : str
    """

    ambient: Triple = BLACK
    diffuse: Triple = (0.8, 0.8, 0.8)
    diffuse_roughness: float = 0.0
    specular: Triple = BLACK
    exponent: float = 32.0
    highlight: str = "phong"
    reflection: Triple = BLACK
    transmission: Triple = BLACK
    index: float = 1.0
    fresnel: bool = False
    abbe: float | None = None
    roughness: float = 0.0
    emission: Triple = BLACK
    texture: Texture | None = None
    name: str = ""

    def __post_init__(self) -> None:
        for key in ("ambient", "diffuse", "specular", "emission"):
            check_colour(key, getattr(self, key))
        for key in ("reflection", "transmission"):
            check_colour(key, getattr(self, key), 1.0)
        check_number("diffuse_roughness", self.diffuse_roughness, 0.0, 90.0, "0 to 90 degrees")
        check_number("exponent", self.exponent, 0.0, 1e9, "0 to 1e9")
        if self.highlight not in HIGHLIGHTS:
            raise SceneError("highlight", unknown("highlight", self.highlight, HIGHLIGHTS))
        check_number("index", self.index, 0.1, 10.0, "0.1 to 10")
        if self.abbe is not None:
            check_number("abbe", self.abbe, 5.0, 1000.0, "5 to 1000")
        check_number("roughness", self.roughness, 0.0, 1.0, "0 to 1")

    @property
    def reflects(self) -> bool:
        """Whether it sends mirrored rays."""
        return any(self.reflection)

    @property
    def transmits(self) -> bool:
        """Whether it lets rays through."""
        return any(self.transmission)


@dataclass(frozen=True, eq=False)
class Object:
    """What all objects have.

    Attributes
    ----------
    material : int
        Which one of the scene's.
    velocity : (float, float, float)
        How far it moves while the shutter is open.
    """

    material: int = 0
    velocity: Triple = BLACK

    def check(self) -> None:
        """Raise SceneError for values that it cannot have."""
        check_point("velocity", self.velocity)

    def __post_init__(self) -> None:
        self.check()


@dataclass(frozen=True, eq=False)
class Sphere(Object):
    """A sphere."""

    center: Triple = (0.0, 0.0, 0.0)
    radius: float = 1.0

    def check(self) -> None:
        super().check()
        check_point("center", self.center)
        check_number("radius", self.radius, 1e-30, GREATEST, "above 0")


@dataclass(frozen=True, eq=False)
class Cone(Object):
    """A cylinder or a cut cone without its ends; of a whole cone the apex radius is 0."""

    base: Triple = (0.0, 0.0, 0.0)
    apex: Triple = (0.0, 1.0, 0.0)
    base_radius: float = 1.0
    apex_radius: float = 1.0

    def check(self) -> None:
        super().check()
        check_point("base", self.base)
        check_point("apex", self.apex)
        check_number("base_radius", self.base_radius, 0.0, GREATEST, "0 or more")
        check_number("apex_radius", self.apex_radius, 0.0, GREATEST, "0 or more")
        if tuple(self.base) == tuple(self.apex):
            raise SceneError("apex", f"apex {tuple(self.apex)} is where the base is")
        if self.base_radius == self.apex_radius == 0.0:
            raise SceneError("base_radius", "base_radius and apex_radius are both 0")


@dataclass(frozen=True, eq=False)
class Plane(Object):
    """An infinite plane."""

    point: Triple = (0.0, 0.0, 0.0)
    normal: Triple = (0.0, 1.0, 0.0)

    def check(self) -> None:
        super().check()
        check_point("point", self.point)
        check_direction("normal", self.normal)


@dataclass(frozen=True, eq=False)
class Disc(Object):
    """A flat disc."""

    center: Triple = (0.0, 0.0, 0.0)
    normal: Triple = (0.0, 1.0, 0.0)
    radius: float = 1.0

    def check(self) -> None:
        super().check()
        check_point("center", self.center)
        check_direction("normal", self.normal)
        check_number("radius", self.radius, 1e-30, GREATEST, "above 0")


@dataclass(frozen=True, eq=False)
class Triangles(Object):
    """Triangles of one material: of a triangle, a polygon, a patch or a mesh file.

    Attributes
    ----------
    corners : (M, 3, 3) float64 array
        Counter-clockwise seen from outside.
    normals : (M, 3, 3) float64 array or None
        At the corners, of any length: a smooth surface.
    coordinates : (M, 3, 2) float64 array or None
        (u, v) of an image at the corners.
    closed : bool
        Whether together they enclose something.
    name : str
        What it was: ``polygon``, a file.
    """

    corners: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3)))
    normals: np.ndarray | None = None
    coordinates: np.ndarray | None = None
    closed: bool = False
    name: str = ""

    def check(self) -> None:
        super().check()
        finite = np.isfinite(self.corners).all() and np.abs(self.corners).max(initial=0) <= GREATEST
        if not finite:
            raise SceneError("vertices", f"vertices are not all finite and up to {GREATEST:g}")
        if self.normals is not None and not np.isfinite(self.normals).all():
            raise SceneError("normals", "normals are not all finite")


@dataclass(frozen=True)
class Indirect:
    """Path tracing (Kajiya 1986): light that comes by way of diffuse surfaces.

    Attributes
    ----------
    samples : int
        Paths a pixel, at most.
    noise : float or None
        Stop at a pixel when the standard error of its mean is below this; None: all samples.
    depth : int
        Bounces after which a path ends in any case; Russian roulette begins at the third.
    """

    samples: int = 64
    noise: float | None = None
    depth: int = 8

    def __post_init__(self) -> None:
        check_number("samples", self.samples, 1, 1 << 20, "1 to 1048576")
        if self.noise is not None:
            check_number("noise", self.noise, 1e-9, 1.0, "above 0, up to 1")
        check_number("depth", self.depth, 1, 64, "1 to 64")


@dataclass(frozen=True)
class Settings:
    """How a scene is traced, as far as that belongs to it.

    Attributes
    ----------
    depth : int
        Generations of mirrored and refracted rays; 0: primary and shadow rays (Appel 1968).
    threshold : float
        Rays that could not change a pixel by more are not shot (Hall & Greenberg 1983).
    samples : int
        Rays a pixel: a square number of cells, one ray at random in each; 1: through the middle.
    indirect : Indirect or None
    """

    depth: int = 5
    threshold: float = 1.0 / 255.0
    samples: int = 1
    indirect: Indirect | None = None

    def __post_init__(self) -> None:
        check_number("depth", self.depth, 0, 64, "0 to 64")
        check_number("threshold", self.threshold, 0.0, 1.0, "0 to 1")
        check_number("samples", self.samples, 1, 1 << 16, "1 to 65536")
        if math.isqrt(self.samples) ** 2 != self.samples:
            near = max(1, round(math.sqrt(self.samples))) ** 2
            raise SceneError(
                "samples", f"samples {self.samples} is no square number (the nearest is {near})"
            )


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene.

    Attributes
    ----------
    name : str
    camera : Camera
    lights : tuple of Light
    materials : tuple of Material
    objects : tuple of Object
    background : (float, float, float)
        What rays that hit nothing bring.
    ambient : (float, float, float)
        The light that is everywhere.
    settings : Settings
    source : str
        The file.
    remarks : tuple of str
        What a reader had to say, for people.
    """

    name: str
    camera: Camera
    lights: tuple[Light, ...] = ()
    materials: tuple[Material, ...] = (Material(),)
    objects: tuple[Object, ...] = ()
    background: Triple = BLACK
    ambient: Triple = WHITE
    settings: Settings = Settings()
    source: str = ""
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_colour("background", self.background)
        check_colour("ambient", self.ambient)
        for each in self.objects:
            if not 0 <= each.material < len(self.materials):
                raise SceneError("material", f"material {each.material} does not exist")
