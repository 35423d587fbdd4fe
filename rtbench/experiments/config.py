"""What a run is to do: read from a TOML file, changed by options, checked before anything runs."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

from rtbench import resources
from rtbench.compiled.instantiate import FLAGS
from rtbench.compiled.layout import LAYOUTS, PRECISIONS, PREPARED
from rtbench.compiled.packing import FORMS, PACKETS, WIDTHS
from rtbench.compiled.targets import TARGETS
from rtbench.errors import RtbenchError, unknown
from rtbench.experiments import tree_config
from rtbench.workloads.bundles import WIDEST
from rtbench.workloads.draws import GENERATORS

ORDERS = ("repeat", "sweep", "sorted", "shuffled")
EXPERIMENTS = (
    "accuracy",
    "break_even",
    "compilers",
    "density",
    "effects",
    "latency",
    "naive",
    "operations",
    "outcomes",
    "packets",
    "prediction",
    "relative_error",
    "soup",
    "stability",
    "stages",
    "subsampling",
    "techniques",
    "tree_builders",
    "trees",
    "watertightness",
    "working_set",
)
MOST = 1_000_000_000  # of anything that is counted


@dataclass(frozen=True)
class Config:
    """One question.

    Attributes
    ----------
    name : str
        The file's stem.
    experiment : str
        One of EXPERIMENTS.
    title : str
        A line for tables and plots.
    table : str
        The thesis's table that it repeats, or empty.
    published : str
        The published run that holds that table's numbers, or empty.
    kernels, precisions, densities, orders : tuples
        What is combined. Kernels are names, globs or FILE.py:NAME.
    triangles, repetitions : int
        Pairs, and how often each is tested over all samples of a cell.
    sizes : tuple of int
        Numbers of distinct pairs (experiment working_set).
    rays : int
        Where every ray meets all triangles: how many. Densities are hit ratios there.
    prepared : tuple of str
        In which arithmetic what a kernel stores is prepared: own, double.
    targets, flags : tuple of str
        What is compiled for, and what LLVM may do with floats (experiment compilers).
    forms, widths, packets, angles : tuples
        Experiment packets: what is taken in lanes, how many lanes, what the rays of a packet
        share, and how far they spread (degrees); the first of packets and angles is varied.
    models : tuple of str
        Experiments trees and tree_builders: names, generated ones with ``:N`` for their triangles,
        or paths; one with a question mark is taken if it is there. None: those that there are.
    structures, rules, builders, endings, axes, candidates, overlaps : tuples of str
        Trees: see `rtbench.trees.options`. Of the last three the first is combined with all else.
    median_axes : str
        Along which axes the median rules cut.
    ways, ray_sets, threads, peers : tuples
        How rays walk, which rays, in how many threads, and who else traces them.
    width, height : int
        Of the image whose pixels are the primary rays; random rays are ``rays``.
    traversal_cost, intersection_cost : float or None
        K_T and K_I; None: those that suit the leaves. costs: "given", or "measured" here.
    max_leaf : int
        With the ending ad_hoc.
    naive, judged, exact, large : int
        Rays that are timed against every triangle, put to brute force, put to exact arithmetic;
        of models with more triangles than ``large`` (0: none) only the first ending is built.
    drop_invalid : bool
        Whether triangles that are not finite are left out rather than refused.
    generator, seed, layout
        The workload.
    scenes, parts : tuples of str
        Experiment effects: scenes, none: all that come with rtbench; and what is done with each:
        tracers, steps, proof.
    grids, tolerances, interpolations : tuples
        Experiment subsampling: pixels from corner to corner as 8x4, the first is shown in curves;
        by how much corners may differ; how what is between is filled. Scenes: as for effects.
    techniques : tuple of str
        Experiment techniques: shadow_cache, first_hit. Scenes: as for effects.
    processes, samples : int or None
        Worker processes, and rounds in each; None: chosen from the repetitions.
    """

    name: str = "density"
    experiment: str = "density"
    title: str = "ns per test over the density of hits"
    table: str = ""
    published: str = ""
    kernels: tuple[str, ...] = ("moller1", "badouel", "chirkov")
    precisions: tuple[str, ...] = ("float32",)
    densities: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75, 1.0)
    orders: tuple[str, ...] = ("repeat", "sweep")
    triangles: int = 25_000
    repetitions: int = 20_000
    sizes: tuple[int, ...] = ()
    rays: int = 1024
    prepared: tuple[str, ...] = ("own",)
    targets: tuple[str, ...] = ("native",)
    flags: tuple[str, ...] = ("strict",)
    forms: tuple[str, ...] = ("rays", "triangles", "pairs")
    widths: tuple[int, ...] = (16, 8, 4)
    packets: tuple[str, ...] = ("general", "common", "parallel")
    angles: tuple[float, ...] = (10.0, 0.0, 1.0, 30.0, 90.0)
    models: tuple[str, ...] = ()
    structures: tuple[str, ...] = ("kd",)
    rules: tuple[str, ...] = ("sah", "object_median", "spatial_median")
    builders: tuple[str, ...] = ("nlogn",)
    endings: tuple[str, ...] = ("both",)
    axes: tuple[str, ...] = ("all",)
    candidates: tuple[str, ...] = ("all",)
    overlaps: tuple[str, ...] = ("clipped",)
    median_axes: str = "longest"
    ways: tuple[str, ...] = ("stack",)
    ray_sets: tuple[str, ...] = ("primary", "shadow", "random")
    threads: tuple[int, ...] = (1,)
    peers: tuple[str, ...] = ()
    width: int = 320
    height: int = 240
    traversal_cost: float | None = None
    intersection_cost: float | None = None
    costs: str = "given"
    max_leaf: int = 8
    naive: int = 0
    judged: int = 1000
    exact: int = 0
    large: int = 0
    drop_invalid: bool = False
    scenes: tuple[str, ...] = ()
    parts: tuple[str, ...] = ("tracers", "steps", "proof")
    grids: tuple[str, ...] = ("4x4", "2x2", "8x8", "16x16", "8x4")
    tolerances: tuple[float, ...] = (0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
    interpolations: tuple[str, ...] = ("bilinear", "nearest")
    techniques: tuple[str, ...] = ("shadow_cache", "first_hit")
    generator: str = "pcg64"
    seed: int = 1
    layout: str = "shared"
    processes: int | None = None
    samples: int | None = None

    def __post_init__(self) -> None:
        for name, allowed in (
            ("experiment", EXPERIMENTS),
            ("generator", GENERATORS),
            ("layout", LAYOUTS),
        ):
            if getattr(self, name) not in allowed:
                raise RtbenchError(unknown(name, str(getattr(self, name)), allowed))
        for name, allowed in (
            ("precisions", PRECISIONS),
            ("orders", ORDERS),
            ("prepared", PREPARED),
            ("targets", TARGETS),
            ("flags", FLAGS),
            ("forms", FORMS),
            ("widths", WIDTHS),
            ("packets", PACKETS),
        ):
            for value in getattr(self, name):
                if value not in allowed:
                    told = [str(each) for each in allowed]
                    raise RtbenchError(unknown(name.removesuffix("s"), str(value), told))
        for name in (
            *("kernels", "precisions", "densities", "orders", "prepared", "targets", "flags"),
            *("forms", "widths", "packets", "angles"),
        ):
            values = getattr(self, name)
            if not values:
                raise RtbenchError(f"{name} is empty: at least one is needed")
            if len(set(values)) < len(values):
                raise RtbenchError(f"{name} names {_repeated(values)!r} twice")
        for angle in self.angles:
            if not 0 <= angle <= WIDEST:
                raise RtbenchError(f"angle {angle} is not allowed (allowed: 0 to {WIDEST} degrees)")
        for density in self.densities:
            if not (math.isfinite(density) and 0 <= density <= 1):
                raise RtbenchError(f"density {density} is not allowed (allowed: 0 to 1)")
        for name in ("triangles", "rays", "repetitions", "processes", "samples"):
            value = getattr(self, name)
            if value is not None and not 1 <= value <= MOST:
                raise RtbenchError(f"{name} {value} is not allowed (allowed: 1 to {MOST})")
        tree_config.check(self)
        if self.seed < 0:
            raise RtbenchError(f"seed {self.seed} is not allowed (allowed: 0 or more)")
        for size in self.sizes:
            if not 1 <= size <= MOST:
                raise RtbenchError(f"size {size} is not allowed (allowed: 1 to {MOST})")
        if len(set(self.sizes)) < len(self.sizes):
            raise RtbenchError(f"sizes names {_repeated(self.sizes)} twice")
        if (self.processes or 1) * (self.samples or 1) > self.repetitions:
            raise RtbenchError(
                f"{self.processes or 1} processes x {self.samples or 1} samples need at least as "
                f"many repetitions, and there are {self.repetitions}"
            )

    def changed(self, **options: object) -> Config:
        """Return this with those options replaced that are not None (or an empty tuple)."""
        given = {name: value for name, value in options.items() if value not in (None, ())}
        return dataclasses.replace(self, **given)

    def quick(self) -> Config:
        """Return this with a tenth of the work, in fewer rounds if that is too little for them."""
        if self.experiment == "watertightness":  # it times nothing
            return dataclasses.replace(self, rays=max(1, self.rays // 10))
        if self.experiment == "effects":  # the steps and the proof compile for minutes
            return dataclasses.replace(self, processes=1, samples=2, parts=("tracers",))
        if self.experiment in ("subsampling", "techniques"):  # each scene compiles for seconds
            return dataclasses.replace(
                self, processes=1, samples=2, scenes=self.scenes[:2], grids=self.grids[:2]
            )
        if self.experiment in (tree_config.TREES, tree_config.TREE_BUILDERS):
            return dataclasses.replace(self, **tree_config.quick(self))
        sizes = self.sizes
        if self.experiment == "accuracy":  # its tests that are judged, not timed
            sizes = tuple(max(1, size // 10) for size in sizes)
        repetitions = max(self.processes or 1, self.repetitions // 10)
        samples = self.samples and min(self.samples, repetitions // (self.processes or 1))
        return dataclasses.replace(self, repetitions=repetitions, samples=samples, sizes=sizes)

    def as_dict(self) -> dict:
        """Return what the records keep."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, told: dict) -> Config:
        """Return the config that ``as_dict`` gave, also one that went through JSON.

        Raises
        ------
        RtbenchError
            If it has an unknown key, or a value of a wrong type.
        """
        given = {name: value for name, value in told.items() if value is not None}
        return cls(**_values("the run's config", given, _KINDS))


_KINDS = {field.name: field.type for field in dataclasses.fields(Config)}


def _repeated(values: tuple) -> object:
    return next(value for i, value in enumerate(values) if value in values[:i])


def read(path: Path) -> Config:
    """Read a config file.

    Raises
    ------
    RtbenchError
        If it is not there or not TOML, has an unknown key, or a value of a wrong type.
    """
    try:
        told = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise RtbenchError(f"config {str(path)!r} cannot be read: {problem.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
        raise RtbenchError(f"config {str(path)!r} is not TOML: {problem}") from None
    kinds = {key: kind for key, kind in _KINDS.items() if key != "name"}
    return Config(name=path.stem, **_values(f"config {path.name}", told, kinds))


def _values(where: str, told: dict, kinds: dict[str, str]) -> dict:
    """Return what was told as the fields want it."""
    for key in told:
        if key not in kinds:
            raise RtbenchError(f"{where}: {unknown('key', key, kinds)}")
    return {key: _value(where, key, kinds[key], value) for key, value in told.items()}


def _value(where: str, key: str, kind: str, value: object) -> object:
    """Return a value as its field wants it."""
    inner = kind.removeprefix("tuple[").split(",")[0].split(" |")[0]
    types = {"str": (str,), "int": (int,), "float": (int, float), "bool": (bool,)}[inner]
    items = value if kind.startswith("tuple") else [value]
    good = isinstance(items, list | tuple) and all(
        isinstance(item, types) and isinstance(item, bool) == (inner == "bool") for item in items
    )
    if not good:
        wanted = f"a list of {inner}" if kind.startswith("tuple") else inner
        raise RtbenchError(f"{where}: {key} = {value!r} is not allowed ({wanted})")
    items = [float(item) if inner == "float" else item for item in items]
    return tuple(items) if kind.startswith("tuple") else items[0]


def shipped() -> dict[str, Path]:
    """Return the configs that come with rtbench, by name."""
    return {path.stem: path for path in sorted(resources.configs().glob("*.toml"))}


def find(name: str) -> Config:
    """Return the config of a path, or of the name of one that comes with rtbench."""
    if name in shipped():
        return read(shipped()[name])
    path = Path(name)
    if name == f"{path.stem}.toml" and not path.exists() and path.stem in shipped():
        return read(shipped()[path.stem])
    if not path.exists():
        raise RtbenchError(unknown("config", name, shipped()))
    return read(path)
