"""What a run that was cut off must share with this process, and what of it is there already."""

from __future__ import annotations

from rtbench.errors import RtbenchError
from rtbench.measure.session import Timed
from rtbench.records.run import Run


def codes(kernels: dict) -> dict:
    """Return the digests of the sources that each kernel's code was made of."""
    return {
        name: {precision: facts["source_digest"] for precision, facts in forms.items()}
        for name, forms in kernels.items()
    }


def must_be_the_same(info: dict, now: dict) -> None:
    """Refuse to add samples of another machine, compiler or workload to a run."""
    for name, value in now.items():
        before = info.get(name)
        if name == "machine":
            before, value = (before or {}).get("cpu_model"), value["cpu_model"]
        elif name == "software":
            kept = ("python", "numba", "llvmlite", "numpy", "rtbench")
            before, value = (
                {key: (told or {}).get(key) for key in kept} for told in (before, value)
            )
        elif name == "kernels":
            before = codes(before or {})
        if before != value:
            if isinstance(value, dict) and isinstance(before, dict):
                key = next(key for key in [*value, *before] if before.get(key) != value.get(key))
                name, before, value = f"{name} {key}", before.get(key), value.get(key)
            what = f": {before} then, {value} now" if len(str(value)) < 80 else ""
            raise RtbenchError(f"this run cannot be resumed here, {name} is not the same{what}")


def samples_taken(run: Run, cells: list[Timed]) -> tuple[set[tuple[int, int, int]], int]:
    """Return the samples that a run holds, as (process, round, cell), and its launches so far."""
    from rtbench.records import tabular

    columns = [*run.cell, *(() if "outcome" in run.cell else ("outcome",))]
    number = {
        _identity({"triangles": cell.count} | cell.key, columns): i for i, cell in enumerate(cells)
    }
    done, launches = set(), 0
    samples = run.samples
    for row in samples.to_dict("records"):
        key = _identity({name: tabular.plain(row[name]) for name in columns}, columns)
        if key not in number:
            raise RtbenchError(f"{run.name} cannot be resumed: it holds samples of {key}, no cell")
        done.add((int(row["process"]), int(row["round"]), number[key]))
        launches = max(launches, int(row["launch"]) + 1)
    return done, launches


def _identity(key: dict, columns: list[str]) -> tuple:
    return tuple(None if key.get(name) in (None, "") else str(key[name]) for name in columns)
