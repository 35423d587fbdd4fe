"""What differs between the machines, the software and the settings of several runs."""

import json
from collections.abc import Sequence

from rtbench.records.run import Run

UNKNOWN = "unknown"
SAME, DIFFERENT = "same", "different"

# Settings that change what a cell means, though they are no column of it.
MEANING = ("layout", "generator", "triangles")


def differences(runs: Sequence[Run]) -> list[dict]:
    """Return the keys of machine, software and config in which runs differ.

    Parameters
    ----------
    runs : sequence of Run
        Two or more.

    Returns
    -------
    list of dict
        ``key`` and a value a run name; the processor comes first, even if it is the same. What
        only one run knows is left out where the others are published: print is always brief.
    """
    flat = [_flat(run) for run in runs]
    rows = [{"key": "processor"} | {run.name: processor(run) for run in runs}]
    measured = [not run.published for run in runs]
    for key in dict.fromkeys(key for one in flat for key in one):
        values = [one.get(key, UNKNOWN) for one in flat]
        known = sum(value != UNKNOWN for value in values)
        gap = any(own and value == UNKNOWN for own, value in zip(measured, values, strict=True))
        if len(set(values)) > 1 and (known > 1 or gap):
            rows.append({"key": key} | {run.name: v for run, v in zip(runs, values, strict=True)})
    return rows


def processor(run: Run) -> str:
    """Return what a run says of its machine in one phrase."""
    machine = run.info.get("machine") or {}
    for key in ("description", "cpu_model", "label"):
        if machine.get(key) not in (None, "", UNKNOWN):
            return str(machine[key])
    return UNKNOWN


def machine_code(runs: Sequence[Run]) -> list[dict]:
    """Return whether runs timed the same code.

    Parameters
    ----------
    runs : sequence of Run
        The first is compared with each later one.

    Returns
    -------
    list of dict
        ``kernel, precision, run, source, machine_code``: the words same, different, unknown. Only
        kernels that both runs know; no rows for published runs.
    """
    rows = []
    first = runs[0].info.get("kernels") or {}
    for run in runs[1:]:
        later = run.info.get("kernels") or {}
        for kernel in first:
            for precision in first[kernel]:
                theirs = (later.get(kernel) or {}).get(precision)
                if theirs is None:
                    continue
                ours = first[kernel][precision]
                row = {"kernel": kernel, "precision": precision, "run": run.name}
                row["source"] = _same(ours, theirs, "source_digest")
                row["machine_code"] = _same(ours, theirs, "machine_code_digest")
                rows.append(row)
    return rows


def same_code(first: Run, later: Run) -> set[tuple[str, str]]:
    """Return the kernels and precisions of which two runs timed the same code on the same thing.

    Parameters
    ----------
    first, later : Run

    Returns
    -------
    set of (kernel, precision)
        Also with "" for the precision; empty where the processors differ or are not known, or
        where the runs' cells do not mean the same.
    """
    models = [(run.info.get("machine") or {}).get("cpu_model") for run in (first, later)]
    if models[0] != models[1] or models[0] in (None, UNKNOWN) or doubts([first, later]):
        return set()
    same = [row for row in machine_code([first, later]) if row["machine_code"] == "same"]
    return {(row["kernel"], p) for row in same for p in (row["precision"], "")}


def doubts(runs: Sequence[Run], allow: Sequence[str] = ()) -> list[str]:
    """Return in what the cells of runs do not mean the same, where both sides say so.

    Parameters
    ----------
    runs : sequence of Run
        The first is compared with each later one.
    allow : sequence of str
        What is not to be remarked: workloads, layout, generator, triangles.

    Returns
    -------
    list of str
        One line each.
    """
    found = []
    first = runs[0]
    for run in runs[1:]:
        for key in MEANING:
            one, other = ((side.info.get("config") or {}).get(key) for side in (first, run))
            if key not in allow and None not in (one, other) and one != other:
                found.append(f"{key}: {one} in {first.name}, {other} in {run.name}")
        if "workloads" in allow:
            continue
        ours, theirs = _digests(first), _digests(run)
        differ = [key for key in ours if key in theirs and ours[key] != theirs[key]]
        if differ:
            where = ", ".join(f"density {density} of {pairs} pairs" for density, pairs in differ)
            found.append(f"other pairs were tested in {first.name} and {run.name}: {where}")
    for run in runs:
        if run.dropped:
            found.append(f"{run.name}: a last line that was cut off is left out")
        if not run.finished:
            found.append(f"{run.name} is not finished: rtbench run --resume {run.name}")
    return found


def _digests(run: Run) -> dict[tuple, str]:
    return {
        (work.get("density"), work.get("triangles")): work["digest"]
        for work in run.info.get("workloads") or []
        if work.get("digest")
    }


def _same(one: dict, other: dict, key: str) -> str:
    if any(side.get(key) in (None, "", UNKNOWN) for side in (one, other)):
        return UNKNOWN
    return SAME if one[key] == other[key] else DIFFERENT


def _flat(run: Run) -> dict[str, str]:
    flat: dict[str, str] = {}

    def walk(prefix: str, value: object) -> None:
        if isinstance(value, dict):
            for key, item in value.items():
                walk(f"{prefix}.{key}", item)
        elif value not in (None, ""):
            is_text = isinstance(value, str)
            flat[prefix] = value if is_text else json.dumps(value, ensure_ascii=False)

    for part in ("machine", "software", "config"):
        walk(part, run.info.get(part) or {})
    flat.pop("machine.description", None)  # shown as the processor
    return flat
