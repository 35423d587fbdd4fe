"""Which trees a config wants over a model, and which walks through them are timed."""

from __future__ import annotations

import itertools
from dataclasses import asdict, dataclass

from rtbench.errors import RtbenchError
from rtbench.experiments.config import Config
from rtbench.experiments.tree_config import BVH, MEDIANS
from rtbench.kernels.contract import Kernel
from rtbench.trees import leaves, ways
from rtbench.trees.options import Options

NAIVE = "none"  # the structure of a cell without a tree
PEER = "peer"  # the way of a peer's
BRUTE_FORCE = "brute_force"
ANY, NEAREST = "any", "nearest"


@dataclass(frozen=True)
class Built:
    """A tree.

    Attributes
    ----------
    structure, rule, builder, ending : str
        As the records name it.
    options : Options
    """

    structure: str
    rule: str
    builder: str
    ending: str
    options: Options

    @property
    def key(self) -> dict[str, str]:
        """What names it in the records."""
        return {n: getattr(self, n) for n in ("structure", "rule", "builder", "ending")}

    @property
    def told(self) -> dict[str, object]:
        """Its options as a message holds them."""
        return asdict(self.options)


@dataclass(frozen=True)
class Walk:
    """A cell: rays that walk through a tree; ``tree`` is its place in the list, None: no tree."""

    kernel: str
    precision: str
    tree: int | None
    way: str
    rays: str
    threads: int = 1

    @property
    def query(self) -> str:
        """What is asked."""
        return query(self.rays)

    @property
    def group(self) -> tuple[str, str, str]:
        """What walks must share to give the same answers."""
        return self.kernel, self.precision, self.rays

    def key(self, trees: list[Built]) -> dict[str, str]:
        """Return what names it in the records, but for the model."""
        if self.way == PEER:
            of_tree = dict.fromkeys(("structure", "rule", "builder", "ending"), "")
        elif self.tree is None:
            of_tree = {"structure": NAIVE, "rule": "", "builder": "", "ending": ""}
        else:
            of_tree = trees[self.tree].key
        way = self.way if self.threads == 1 else f"{self.way}, {self.threads} threads"
        told = {"kernel": self.kernel, "precision": self.precision} | of_tree
        return told | {"way": way, "rays": self.rays}


def query(rays: str) -> str:
    """Return what is asked of a set of rays."""
    return ANY if rays == "shadow" else NEAREST


def cost_options(config: Config, costs: dict | None) -> dict[str, float]:
    """Return K_T and K_I as options: as given or measured, nothing where they are not."""
    names = ("traversal_cost", "intersection_cost")
    told = costs or {name: getattr(config, name) for name in names}
    return {name: told[name] for name in names if told.get(name) is not None}


def trees(
    config: Config, form: str, structure: str, triangles: int, costs: dict | None = None
) -> list[Built]:
    """Return the trees of a structure that a config wants over a model of so many triangles."""
    told = cost_options(config, costs)
    if structure == BVH:
        return [Built(BVH, "sah", BVH, "", ways.options(form, structure=BVH, **told))]
    found = []
    few = config.large and triangles > config.large
    for rule, ending in itertools.product(
        config.rules, config.endings[:1] if few else config.endings
    ):
        own = told | ({"max_leaf": config.max_leaf} if ending == "ad_hoc" else {})
        if rule in MEDIANS:
            options = own | {"ending": ending, "rule": rule, "axes": config.median_axes}
            options["overlap"] = config.overlaps[0]
            found.append(Built("kd", rule, rule, ending, ways.options(form, **options)))
            continue
        for builder in config.builders:
            first = builder == config.builders[0] and ending == config.endings[0] and not few
            for axes, candidates, overlap in variants(config, first):
                options = own | {"ending": ending, "builder": builder, "axes": axes}
                options |= {"candidates": candidates, "overlap": overlap}
                base = config.axes[0], config.candidates[0], config.overlaps[0]
                others = [
                    value
                    for value, usual in zip((axes, candidates, overlap), base, strict=True)
                    if value != usual
                ]
                label = " ".join([builder, *others])
                found.append(Built("kd", "sah", label, ending, ways.options(form, **options)))
    return found


def variants(config: Config, every: bool) -> list[tuple[str, str, str]]:
    """Return axes, candidates and overlap: the first of each, or all that are wanted."""
    if not every:
        return [(config.axes[0], config.candidates[0], config.overlaps[0])]
    planes = list(itertools.product(config.axes, config.candidates, config.overlaps[:1]))
    more = [(config.axes[0], config.candidates[0], each) for each in config.overlaps[1:]]
    return planes + more


def plan(
    config: Config, kernels: list[Kernel], triangles: int, costs: dict | None = None
) -> tuple[list[Built], list[Walk], list[str]]:
    """Return the trees over a model, the walks that are timed in them, and remarks.

    Raises
    ------
    RtbenchError
        Where nothing is left to be timed.
    """
    built: list[Built] = []
    walks: list[Walk] = []
    remarks: list[str] = []
    for kernel, precision, way in itertools.product(kernels, config.precisions, config.ways):
        if precision not in kernel.precisions:
            remarks.append(f"kernel {kernel.name} is not to be had in {precision}")
            continue
        structure, of_kernel = ways.WAYS[way][1], leaves.form_of(kernel, precision)
        form = ways.form(way, of_kernel)
        if structure not in config.structures:
            continue
        if form == leaves.IN_BLOCKS and of_kernel != leaves.IN_BLOCKS:
            remarks.append(f"kernel {kernel.name} in {precision} has no way {way}: no blocks")
            continue
        for tree in trees(config, form, structure, triangles, costs):
            if tree not in built:
                built.append(tree)
            place = built.index(tree)
            walks += [
                Walk(kernel.name, precision, place, way, rays, threads)
                for rays, threads in itertools.product(config.ray_sets, config.threads)
            ]
    if not walks:
        raise RtbenchError(
            f"ways {', '.join(config.ways)} do not go with structures "
            f"{', '.join(config.structures)} and kernels {', '.join(k.name for k in kernels)}"
        )
    if config.naive:
        first = next(name for name in config.ray_sets if name != "shadow")
        kernel, precision = walks[0].kernel, walks[0].precision
        walks.append(Walk(kernel, precision, None, BRUTE_FORCE, first))
    return built, walks, list(dict.fromkeys(remarks))


def counted(built: list[Built], walks: list[Walk]) -> list[Walk]:
    """Return a walk a tree and ray set, of one kernel, whose steps are counted.

    Of lanes and packets, which count otherwise, the walk of one ray through the same blocks.
    """
    found: dict[tuple, Walk] = {}
    for walk in walks:
        if walk.tree is None or walk.threads > 1:
            continue
        way = walk.way
        if built[walk.tree].structure != BVH:
            way = "stack" if built[walk.tree].options.block == 1 else "blocks"
        asked = Walk(walk.kernel, walk.precision, walk.tree, way, walk.rays)
        found.setdefault((walk.tree, walk.rays), asked)
    return list(found.values())


def to_compile(built: list[Built], walks: list[Walk], judged: bool) -> list[dict]:
    """Return all that is compiled for these walks, and for brute force to judge them; each once."""
    wanted = [(w.kernel, w.precision, w.way, w.query, False) for w in walks]
    first = walks[0]
    wanted += [
        (w.kernel, w.precision, w.way, w.query, True)
        for w in counted(built, walks)
        if (w.kernel, w.precision) == (first.kernel, first.precision)
    ]
    wanted += [(w.kernel, w.precision, BRUTE_FORCE, NEAREST, False) for w in walks if w.way != PEER]
    names = ("kernel", "precision", "way", "query", "counted")
    return [dict(zip(names, each, strict=True)) for each in dict.fromkeys(wanted)]
