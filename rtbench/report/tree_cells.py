"""What a run of trees was timed of: a tree that was built, a cell with its samples, their names."""

from dataclasses import dataclass, field

import numpy as np

from rtbench.records.statistics import Times
from rtbench.report.digits import absent

TREE = ("structure", "rule", "builder", "ending")
RULES = {"sah": "SAH", "object_median": "object median", "spatial_median": "spatial median"}
ENDINGS = {"automatic": "automatic", "ad_hoc": "ad hoc", "both": "both"}
RAYS = ("primary", "shadow", "random", "aimed")
USUAL = "nlogn"  # the builder that is not named
OURS = ("kd", "bvh")  # structures
NAIVE, PEER = "brute_force", "peer"  # ways
ONE_THREAD = ("embree", "embree_robust", "trimesh_embree", "trimesh_numpy")  # of the libraries
# Ways through leaves in blocks of 8 triangles, and through triangles one by one.
BLOCK_WAYS = ("lanes", "packets", "blocks")
PLAIN_WAYS = ("stack", "recursive", "mailboxes")
VISITS = ("steps", "leaves", "leaf_tests")
EXPECTED = ("expected_steps", "expected_leaves", "expected_tests")


@dataclass(frozen=True)
class Built:
    """A tree of a model: what the records tell of it, the same in every process but its seconds.

    Attributes
    ----------
    key : tuple of str
        Structure, rule, builder, ending; empty strings where they say nothing.
    block : int or None
        Its leaves are made of blocks of so many triangles.
    facts : dict
        A row of trees.csv.
    seconds : ndarray of float64, (processes,)
        What building took of the processor; of a library, which may build in threads, by the clock.
    """

    key: tuple
    block: int | None
    facts: dict
    seconds: np.ndarray


@dataclass(frozen=True)
class Timed:
    """A cell with its samples.

    Attributes
    ----------
    cell : dict
        Column to value; nothing is None.
    times, cpu : Times
        Nanoseconds a ray, of the wall clock and of the processor.
    triangles, rays : int
        Of the model; in a sample, each repetition of it.
    """

    cell: dict
    times: Times = field(repr=False)
    cpu: Times = field(repr=False)
    triangles: int
    rays: int

    @property
    def key(self) -> tuple:
        """Structure, rule, builder, ending."""
        return key_of(self.cell)

    @property
    def form(self) -> tuple:
        """Kernel and precision."""
        return self.cell["kernel"], self.cell["precision"]

    @property
    def threads(self) -> int:
        """In how many threads the rays walked; 1 where nothing is said."""
        number = str(self.cell["way"]).rpartition(", ")[2].removesuffix(" threads")
        return int(number) if number.isdigit() else 1

    @property
    def by_cpu(self) -> bool:
        """Whether its time is that of the processor: of one thread alone, and known."""
        # What a library that starts threads of its own takes, only the clock tells.
        other = self.cell["way"] == PEER and self.cell["kernel"] not in ONE_THREAD
        return not other and self.threads == 1 and bool(np.isfinite(self.cpu.ns).all())

    @property
    def ours(self) -> bool:
        """Whether a tree of rtbench was walked."""
        return self.cell["way"] not in (NAIVE, PEER)

    @property
    def block(self) -> int | None:
        """Of how many triangles the blocks of the leaves are that its way reads; None: any."""
        way = (self.cell["way"] or "").partition(",")[0]
        return 8 if way in BLOCK_WAYS else 1 if way in PLAIN_WAYS else None


def key_of(row: dict) -> tuple:
    """Return structure, rule, builder and ending of a row; empty strings for what is absent."""
    return tuple("" if absent(row.get(name)) else str(row[name]) for name in TREE)


def build_seconds(key: tuple, row: dict) -> float:
    """Return what a build took: of the processor, or of a library by the clock."""
    cpu = row.get("build_cpu_seconds")
    return float(row["build_seconds"] if key[0] not in OURS or absent(cpu) else cpu)


def clocks(*timed: Timed) -> list[Times]:
    """Return the times that cells are compared by: the processor's, or the clock's for all."""
    by_cpu = all(one.by_cpu for one in timed)
    return [one.cpu if by_cpu else one.times for one in timed]


def clock_note(timed: list[Timed]) -> str:
    """Return which time is told, and how much more the clock says where others took the machine."""
    there = [one for one in timed if one.by_cpu]
    if not there:
        return "by the clock"
    more = max(float(np.median(one.times.ns) / np.median(one.cpu.ns)) for one in there)
    words = "by CPU time of the thread"
    words += f" (by the clock up to {more:.1f} times as much: others ran)" if more >= 1.1 else ""
    rest = [one for one in timed if not one.by_cpu]
    return words + ("; of more threads by the clock" if rest else "")


def file_name(model: str) -> str:
    """Return a model's name as a part of a file's."""
    return "".join(letter if letter.isalnum() or letter in "-_." else "-" for letter in model)


def is_peer(tree: Built) -> bool:
    """Tell whether a row of trees.csv is of a library, not of rtbench."""
    return tree.key[0] not in OURS


def tree_name(key: tuple, endings: bool = True) -> str:
    """Return a tree's rule in words: SAH; with its builder where that is not the usual one.

    Parameters
    ----------
    key : tuple of str
        Structure, rule, builder, ending.
    endings : bool
        Whether the ending is named too.
    """
    structure, rule, builder, ending = key
    if structure == "none":
        return "naive"
    if structure not in OURS:
        return structure
    name = "BVH" if structure == "bvh" else RULES.get(rule, rule)
    if structure == "kd" and builder not in (USUAL, rule, ""):
        name += f", {builder.removeprefix(f'{USUAL} ')}"
    return f"{name}, {ENDINGS.get(ending, ending)}" if endings and ending else name


def timed_name(timed: Timed, endings: bool = True) -> str:
    """Return what was timed in words: the tree, the library, or the naive way."""
    if timed.cell["way"] == PEER:
        return str(timed.cell["kernel"])
    return tree_name(timed.key, endings)
