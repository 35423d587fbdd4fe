"""The methods behind a run's kernels: names to print, endings, what they store of a triangle."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from rtbench.report import cells

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

STORED = ("none", "normal", "precomputed")
TESTED_FIRST = {"tuv": "t first", "uvt": "u, v first"}
ALL_TESTED = "nothing skipped"
_SPELT = str.maketrans({"ü": "ue", "ö": "o", "ä": "ae", "-": "_", " ": "_"})


class Method(NamedTuple):
    """What a run says of a kernel's method.

    `base` is the name of the function that gives its pieces, or the kernel's own; `ending` the
    words of its ending as they stand in names ("last uvt"), "" for a listing kept whole; `stored`
    one of STORED, "" if unknown; `division` first, last or none; `early` whether it leaves as
    soon as the test has failed (None: unknown); `outputs` what it returns.
    """

    kernel: str
    title: str
    base: str
    ending: str
    stored: str
    division: str
    early: bool | None
    outputs: tuple[str, ...]

    @property
    def tested(self) -> str:
        """What is tested first, in words; nothing for a listing kept whole."""
        if self.early is False:
            return ALL_TESTED
        return TESTED_FIRST.get(self.ending.split(" ")[-1], self.ending)


def methods_of(run: "Run", kernels: Sequence[str]) -> dict[str, Method]:
    """Return the method of each kernel, as the run's records tell it.

    Parameters
    ----------
    run : Run
        With ``methods`` in its run.json; what is not told there stays empty.
    kernels : sequence of str
        Which.

    Returns
    -------
    dict of str to Method
        Kernel to method, in the order given. Where two kernels of the run have base and ending in
        common, the ending says what each returns too ("last uvt, t").
    """
    told = run.info.get("methods") or {}
    found = {}
    for kernel in kernels:
        facts = told.get(kernel) or {}
        found[kernel] = Method(
            kernel,
            facts.get("method") or kernel,
            facts.get("base") or kernel,
            (facts.get("ending") or "").replace("_", " "),
            facts.get("stored") or "",
            facts.get("division") or "",
            facts.get("early"),
            tuple(facts.get("outputs") or ()),
        )
    names = [(method.base, method.ending) for method in found.values()]
    return {
        kernel: method
        if names.count((method.base, method.ending)) == 1
        else method._replace(ending=f"{method.ending}, {' '.join(method.outputs)}".strip(", "))
        for kernel, method in found.items()
    }


def labels(methods: Sequence[Method]) -> dict[str, str]:
    """Return a name to print for each base, with what tells it from its method's others.

    Parameters
    ----------
    methods : sequence of Method
        Those of one chart.

    Returns
    -------
    dict of str to str
        Base to label: "Wald", "Kensler-Shirley (stored)"; the base itself where two would be
        called the same.
    """
    found = {}
    for method in methods:
        start = method.title.lower().translate(_SPELT)
        rest = method.base.removeprefix(start).strip("_").replace("_", " ")
        known = method.base.startswith(start) and rest
        found[method.base] = f"{method.title} ({rest})" if known else method.title
    told = list(found.values())
    return {base: label if told.count(label) == 1 else base for base, label in found.items()}


def storage(run: "Run", kernel: str, precision: str | None) -> dict:
    """Return what a kernel reads of a triangle: bytes packed and padded, ns to prepare.

    Parameters
    ----------
    run : Run
    kernel : str
    precision : str or None
        None asks for the only one.

    Returns
    -------
    dict
        ``bytes_per_triangle, bytes_per_triangle_padded, prepare_ns_per_triangle``; None where the
        records do not say, or nothing is prepared.
    """
    forms = (run.info.get("kernels") or {}).get(kernel) or {}
    facts = forms.get(precision) or (next(iter(forms.values()), {}) if precision is None else {})
    keys = ("bytes_per_triangle", "bytes_per_triangle_padded", "prepare_ns_per_triangle")
    return {key: facts.get(key) for key in keys}


def variants(frame: "DataFrame") -> list[tuple[dict, str]]:
    """Return the precisions and ways of preparing in which a run's kernels were measured.

    Parameters
    ----------
    frame : DataFrame
        Rows of a summary.

    Returns
    -------
    list of (dict, str)
        Column to value, and the variant in words: "float64, prepared in double"; "" for the
        only one.
    """
    found = []
    several = cells.differing(frame, "precision", "prepared")
    for group, _ in cells.groups(frame, ("precision", "prepared")):
        words = []
        if "precision" in several:
            words.append(str(group["precision"]))
        if "prepared" in several:
            ways = {"own": "prepared in its own precision", "double": "prepared in double"}
            words.append(ways.get(group["prepared"], str(group["prepared"])))
        found.append((group, ", ".join(words)))
    return found
