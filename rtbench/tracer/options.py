"""What can be chosen of a rendering, beside what the scene says."""

from __future__ import annotations

from dataclasses import dataclass

from rtbench.errors import RtbenchError, unknown

PRECISIONS = ("float32", "float64")
INTERPOLATIONS = ("bilinear", "nearest")
# What the inner loop asks about each primitive: no effects, but compiled in by the same rule.
KINDS = ("triangles", "spheres", "cones", "discs", "planes", "motion")


@dataclass(frozen=True)
class Subsampling:
    """Adaptive subsampling: pixels at the corners of a grid are traced, those between if need be.

    Attributes
    ----------
    grid : (int, int)
        Pixels from corner to corner along x and y.
    tolerance : float
        By how much the corners of a cell may differ, in any colour, for what is between to be
        interpolated.
    interpolation : str
        One of INTERPOLATIONS.

    Source
    ------
    Krupa 2006, as Blecha 2007, appendix A.2, lists its keys: L, X, Y, T and I.
    """

    grid: tuple[int, int] = (4, 4)
    tolerance: float = 0.05
    interpolation: str = "bilinear"

    def __post_init__(self) -> None:
        for each in self.grid:
            if each not in (1, 2, 4, 8, 16):
                raise RtbenchError(f"grid {each} is not allowed (allowed: 1, 2, 4, 8, 16 pixels)")
        if not 0 <= self.tolerance <= 1:
            raise RtbenchError(f"tolerance {self.tolerance} is not allowed (allowed: 0 to 1)")
        if self.interpolation not in INTERPOLATIONS:
            raise RtbenchError(unknown("interpolation", self.interpolation, INTERPOLATIONS))


@dataclass(frozen=True)
class Options:
    """How a scene is rendered.

    Attributes
    ----------
    precision : str
        One of PRECISIONS.
    kernel : str
        What tests triangles.
    structure, rule, builder : str
        Of the tree, see `rtbench.trees.options`.
    depth, samples, threshold : optional
        In place of the scene's.
    without, force : tuple of str
        Effects that are left out though the scene calls for them, and compiled in though it does
        not: for measuring.
    kinds : tuple of str
        Of KINDS, compiled in though the scene has none: for measuring.
    shadow_cache : bool
        Try the last occluder of each light first (Šilhavý 2010, 2.3.1).
    first_hit : bool
        Find what primary rays hit by rasterising (Šilhavý 2010, 2.3.1).
    subsampling : Subsampling or None
    counted : bool
        Count steps and tests of each pixel, for heat maps.
    """

    precision: str = "float64"
    kernel: str = "watertight_safe"
    structure: str = "bvh"
    rule: str = "sah"
    builder: str = "nlogn"
    depth: int | None = None
    samples: int | None = None
    threshold: float | None = None
    without: tuple[str, ...] = ()
    force: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    shadow_cache: bool = True
    first_hit: bool = False
    subsampling: Subsampling | None = None
    counted: bool = False

    def __post_init__(self) -> None:
        if self.precision not in PRECISIONS:
            raise RtbenchError(unknown("precision", self.precision, PRECISIONS))
        for kind in self.kinds:
            if kind not in KINDS:
                raise RtbenchError(unknown("kind", kind, KINDS))
