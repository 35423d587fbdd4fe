"""Tables of what LLVM compiles for and may do with floats: times, and the answers that differ."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rtbench.report import cells, machine
from rtbench.report.digits import frequency, interval, measured, usual_decimals
from rtbench.report.methods import Method, methods_of, variants
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from pandas import DataFrame

    from rtbench.records.run import Run

STRICT = "strict"
FLAGS = (STRICT, "contract", "fast")
OTHER_T, OTHER_TRIANGLE = "~", "!"
_ALLOWED = {
    STRICT: "as written",
    "contract": "a * b + c may be fused",
    "fast": "LLVM's fast-math: reordered, no NaN, no infinity, no sign of 0",
}
_KEY = ("kernel", "precision", "density", "target", "flags")
_TIMES = ("ns_per_test", "ci_low", "ci_high")
_COUNTS = ("rays", "other_hits", "other_t")


def compilers_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``compilers``.

    Parameters
    ----------
    run : Run
        Measured, finished or not.

    Returns
    -------
    list of Table
        The times, then on how many rays the answers differ; without rows where nothing was
        measured, or nothing differs.
    """
    return [compilers_table(run), answers_table(run)]


def compilers_table(run: "Run") -> Table:
    """Return the times of the kernels for each target and with each set of flags.

    Parameters
    ----------
    run : Run
        A run of the experiment ``compilers``.

    Returns
    -------
    Table
        A row a kernel, hit ratio and set of flags (and precision), a column a target: ns a test
        with its 95 % interval, marked where rays have other answers than with strict arithmetic
        for the first target. In csv and json a row a target, with how many rays.
    """
    frame = cells.times_of(run)
    there, differ = targets(run, frame), other_answers(run)
    methods = methods_of(run, cells.kernels(frame))
    common, words = told_apart(list(methods.values()))
    rows, raw, seen = [], [], set()
    for group, _ in variants(frame):
        for kernel in methods:
            block = cells.where(frame, kernel=kernel, **group)
            most = _decimals(block)
            for facts, part in _lines(block):
                row = {"kernel": methods[kernel].base, "ending": words[kernel], **group, **facts}
                row["density"] = _ratio(facts["density"])
                for cell in part.to_dict("records"):
                    counted = differ.get(tuple(cell.get(name) for name in _KEY), {})
                    mark = mark_of(counted)
                    seen.add(mark)
                    row[cell["target"]] = _time(cell, most, mark)
                    raw.append({name: cell.get(name) for name in (*_KEY, *_TIMES)} | counted)
                rows.append(row)
    several = cells.differing(frame, "precision", "prepared")
    ending = ["ending"] if any(words.values()) else []
    only = cells.precisions(frame)
    title = [str(run.info.get("title") or "compilers"), "ns a test and its 95 % interval"]
    return Table(
        "compilers",
        rows,
        ["kernel", *ending, *several, "density", "flags", *there],
        "; ".join([*title, *(only if len(only) == 1 else [])]),
        [*_KEY, *_TIMES, *_COUNTS],
        raw,
        {"density": "ratio"},
        [
            *([f"every ending: {common}"] if common else []),
            *_marks(seen, there),
            "; ".join(f"{name}: {_ALLOWED[name]}" for name in flags(frame) if name in _ALLOWED),
            *_ratios(run),
            machine.provenance(run),
        ],
    )


def answers_table(run: "Run") -> Table:
    """Return on how many rays a variant answers otherwise than strict arithmetic.

    Parameters
    ----------
    run : Run
        A run of the experiment ``compilers``.

    Returns
    -------
    Table
        A row a kernel, hit ratio and set of flags (and precision) for which some ray differs, a
        column a target: rays with another triangle / rays with another t.
    """
    frame = cells.times_of(run)
    there, differ = targets(run, frame), other_answers(run)
    methods = methods_of(run, list(dict.fromkeys(key[0] for key in differ)))
    _, words = told_apart(list(methods.values()))
    rows: dict[tuple, dict] = {}
    raw = []
    for key, counted in sorted(differ.items(), key=lambda one: list(methods).index(one[0][0])):
        kernel, precision, density, target, flag = key
        facts = {"precision": precision, "density": density, "flags": flag}
        named = {"kernel": methods[kernel].base, "ending": words[kernel]}
        shown = named | facts | {"density": _ratio(density)}
        row = rows.setdefault((kernel, *facts.values()), shown)
        triangles, ts = counted["other_hits"], counted["other_t"]
        marked = f"{triangles:,}{OTHER_TRIANGLE if triangles else ''} / {ts:,}"
        row[target] = Cell(ts, marked if mark_of(counted) else "0")
        raw.append(dict(zip(_KEY, key, strict=True)) | counted)
    kept = [row for row in rows.values() if any(row[t].text != "0" for t in there if t in row)]
    shot = sorted({counted["rays"] for counted in differ.values()})
    several = ["precision"] if len({key[1] for key in differ}) > 1 else []
    ending = ["ending"] if any(row["ending"] for row in kept) else []
    return Table(
        "answers",
        kept,
        ["kernel", *ending, *several, "density", "flags", *there],
        f"of {' or '.join(f'{n:,}' for n in shot)} rays: with another triangle / another t than "
        f"strict arithmetic for {there[0] if there else 'the first target'}",
        [*_KEY, *_COUNTS],
        raw,
        {"density": "ratio"},
        [machine.provenance(run)],
    )


def targets(run: "Run", frame: "DataFrame") -> list[str]:
    """Return the targets of some rows as the run's config has them."""
    listed = (run.info.get("config") or {}).get("targets") or ()
    return cells.values(frame, "target", tuple(listed))


def flags(frame: "DataFrame") -> list[str]:
    """Return what was allowed in some rows, from the strictest on."""
    return cells.values(frame, "flags", FLAGS)


def other_answers(run: "Run") -> dict[tuple, dict]:
    """Return (kernel, precision, density, target, flags) to rays, other_hits and other_t."""
    return {
        tuple(row.get(name) for name in _KEY): {name: row.get(name) or 0 for name in _COUNTS}
        for row in run.info.get("variants") or []
    }


def mark_of(counted: dict) -> str:
    """Return the mark of a variant: another triangle, or only another t, or nothing."""
    if counted.get("other_hits"):
        return OTHER_TRIANGLE
    return OTHER_T if counted.get("other_t") else ""


def told_apart(methods: list[Method]) -> tuple[str, dict[str, str]]:
    """Return the words that all endings begin with, and of each kernel what comes after them."""
    split = [method.ending.split() for method in methods]
    shared = 0
    while split and all(len(words) > shared for words in split):
        if len({words[shared] for words in split}) > 1:
            break
        shared += 1
    common = " ".join(split[0][:shared]) if split else ""
    return common, {
        method.kernel: " ".join(words[shared:])
        for method, words in zip(methods, split, strict=True)
    }


def _lines(block: "DataFrame") -> Iterator[tuple[dict, "DataFrame"]]:
    """Yield hit ratio and flags, from the strictest on, and the rows of both."""
    for facts, part in cells.groups(block, ("density",)):
        for name in flags(part):
            yield facts | {"flags": name}, cells.where(part, flags=name)


def _decimals(block: "DataFrame") -> int:
    """Return the decimals of a kernel's times: with more than three digits a row is too wide."""
    widest = 2 if block["ns_per_test"].max() < 10 else 1
    return min(usual_decimals(block.to_dict("records")), widest)


def _ratio(density) -> Cell:
    return Cell(density, cells.density_text(density))


def _time(cell: dict, most: int, mark: str) -> Cell:
    ends = cell["ns_per_test"], cell.get("ci_low"), cell.get("ci_high")
    words = [measured(*ends, most).text, interval(*ends, most)]
    return Cell(cell["ns_per_test"], " ".join(filter(None, words)) + mark)


def _marks(seen: set[str], there: list[str]) -> list[str]:
    lines = []
    if OTHER_T in seen:
        lines.append(f"{OTHER_T} another t than strict arithmetic for {there[0]} on some rays")
    if OTHER_TRIANGLE in seen:
        lines.append(
            f"{OTHER_TRIANGLE} another triangle than strict arithmetic for {there[0]} on some rays"
        )
    return lines or [f"every ray has the bits of strict arithmetic for {there[0]}" if there else ""]


def _ratios(run: "Run") -> list[str]:
    return [
        f"hit ratio {cells.density_text(work['density'])}: {work['scene']:,} triangles x "
        f"{work['rays']:,} rays, {frequency(work['hit_ratio']).text} % of the pairs hit"
        for work in run.info.get("workloads") or []
        if "scene" in work and work.get("hit_ratio") is not None
    ]
