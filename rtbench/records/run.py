"""A run as it is read: run.json at once, its tables when they are asked for."""

import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from rtbench.errors import NotComparable
from rtbench.records import schema, tabular
from rtbench.records.samples import WholeLines, read_samples

if TYPE_CHECKING:
    import pandas


class Run:
    """One run folder.

    Attributes
    ----------
    path : Path
        The folder.
    name : str
        Its name.
    info : dict
        run.json.
    """

    def __init__(self, path: Path, info: dict) -> None:
        self.path = Path(path)
        self.name = info.get("name") or self.path.name
        self.info = info

    @property
    def cell(self) -> list[str]:
        """The columns that identify a cell."""
        return list(self.info["cell"])

    @property
    def published(self) -> bool:
        """Whether the numbers were printed somewhere, not measured by rtbench."""
        return bool(self.info.get("published"))

    @property
    def finished(self) -> bool:
        """Whether the run came to its end."""
        return bool(self.info.get("finished"))

    @property
    def dropped(self) -> int:
        """Number of cut-off lines that were left out of the samples (0 or 1)."""
        return self._whole.dropped

    @cached_property
    def samples(self) -> "pandas.DataFrame":
        """One row a sample: cell, outcome, process, launch, round, position, ..., ns, cpu_ns."""
        return tabular.frame(self._whole.rows, self._whole.columns)

    @cached_property
    def summary(self) -> "pandas.DataFrame":
        """One row a cell; derived here if summary.csv is missing or older than the samples."""
        from rtbench.records.derive import summarise

        if self._stands(schema.SUMMARY):
            return tabular.read(self.path / schema.SUMMARY, schema.SUMMARY_COLUMNS)
        return summarise(self)

    @cached_property
    def outcomes(self) -> "pandas.DataFrame":
        """One row an outcome; derived here if outcomes.csv is missing or older."""
        from rtbench.records.derive import outcome_table

        if self._stands(schema.OUTCOMES):
            return tabular.read(self.path / schema.OUTCOMES, schema.OUTCOME_COLUMNS)
        return outcome_table(self)

    @cached_property
    def operations(self) -> "pandas.DataFrame":
        """One row a kernel: add, sub, mul, div, cond and the vector operations; may be empty."""
        return self._table(schema.OPERATIONS)

    @cached_property
    def errors(self) -> "pandas.DataFrame":
        """One row a kernel, precision, preparation, quantity and reference; may be empty."""
        return self._table(schema.ERRORS)

    @cached_property
    def choices(self) -> "pandas.DataFrame":
        """One row a kernel, precision, preparation and density; may be empty."""
        return self._table(schema.CHOICES)

    @cached_property
    def stability(self) -> "pandas.DataFrame":
        """One row a kernel and precision: what hard cases showed; may be empty."""
        return self._table(schema.STABILITY)

    @cached_property
    def families(self) -> "pandas.DataFrame":
        """One row a kernel, precision and family of hard cases; may be empty."""
        return self._table(schema.FAMILIES)

    @cached_property
    def curves(self) -> "pandas.DataFrame":
        """One row a kernel, precision, family and difficulty; may be empty."""
        return self._table(schema.CURVES)

    @cached_property
    def leaks(self) -> "pandas.DataFrame":
        """One row a kernel or peer, precision, place and aim: rays that leaked; may be empty."""
        return self._table(schema.LEAKS)

    @cached_property
    def peers(self) -> "pandas.DataFrame":
        """One row a peer, or kernel beside them, and precision; may be empty."""
        return self._table(schema.PEERS)

    @cached_property
    def accuracy(self) -> "pandas.DataFrame":
        """One row a form of a kernel and workload: what it gets wrong; may be empty."""
        return self._table(schema.ACCURACY)

    @cached_property
    def trees(self) -> "pandas.DataFrame":
        """One row a build of a tree over a model, or of a peer's scene; may be empty."""
        return self._table(schema.TREES)

    @cached_property
    def visits(self) -> "pandas.DataFrame":
        """One row a tree and ray set: what rays meet; or a kernel's wrong answers; may be empty."""
        return self._table(schema.VISITS)

    @cached_property
    def builds(self) -> "pandas.DataFrame":
        """One row a build by a builder over a model of some size; may be empty."""
        return self._table(schema.BUILDS)

    @cached_property
    def effects(self) -> "pandas.DataFrame":
        """One row a tracer of a scene: rays, digests of its picture and code; may be empty."""
        return self._table(schema.EFFECTS)

    @cached_property
    def subsampling(self) -> "pandas.DataFrame":
        """One row a way to subsample a scene's picture: rays, errors; may be empty."""
        return self._table(schema.SUBSAMPLING)

    @cached_property
    def techniques(self) -> "pandas.DataFrame":
        """One row a technique over a scene: rays, digest of its picture; may be empty."""
        return self._table(schema.TECHNIQUES)

    def _table(self, name: str) -> "pandas.DataFrame":
        path = self.path / name
        if path.exists():
            return tabular.read(path, schema.TABLES[name])
        return tabular.frame([], schema.TABLES[name])

    @cached_property
    def _whole(self) -> WholeLines:
        path = self.path / schema.SAMPLES
        if not path.exists():  # published, or nothing was to be timed
            return WholeLines(schema.sample_columns(self.cell), [], 0, 0)
        return read_samples(path, self.cell)

    def _stands(self, name: str) -> bool:
        derived = self.path / name
        if not derived.exists():
            return False
        samples = self.path / schema.SAMPLES
        if not samples.exists():
            return True
        # A run that was killed has grown since its tables were derived.
        newest = max(samples.stat().st_mtime_ns, (self.path / schema.RUN).stat().st_mtime_ns)
        return derived.stat().st_mtime_ns >= newest


def read_info(path: Path) -> dict:
    """Read and check the run.json of a folder.

    Parameters
    ----------
    path : Path
        The run folder.

    Returns
    -------
    dict
        Its content.

    Raises
    ------
    NotComparable
        If it is missing, damaged, foreign, or of a newer schema.
    """
    file = path / schema.RUN
    try:
        info = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise NotComparable(f"{path} is not a run: it has no {schema.RUN}") from error
    except OSError as error:
        raise NotComparable(f"cannot read {file}: {tabular.reason(error)}") from error
    except ValueError as error:
        raise NotComparable(f"{file} is damaged: {error}") from error
    number = info.get("schema") if isinstance(info, dict) else None
    if not isinstance(number, int) or isinstance(number, bool):
        raise NotComparable(f"{file} is not a run of rtbench: no schema number")
    if number > schema.SCHEMA:
        raise NotComparable(
            f"{file} has schema {number}; this rtbench reads up to {schema.SCHEMA}: update rtbench"
        )
    cell = info.get("cell")
    if not isinstance(cell, list) or not cell or not all(isinstance(name, str) for name in cell):
        raise NotComparable(f"{file} does not say which columns identify a cell (cell)")
    return info


def write_derived(path: Path) -> None:
    """Write summary.csv and outcomes.csv of a run folder, each replaced by a rename.

    Parameters
    ----------
    path : Path
        The run folder. A published run, which has no samples, is left as it is.

    Raises
    ------
    RtbenchError
        If they cannot be written.
    NotComparable
        If the run cannot be read.
    """
    path = Path(path)
    run = Run(path, read_info(path))
    if run.published:
        return
    from rtbench.records.derive import outcome_table, summarise

    tabular.write(path / schema.SUMMARY, summarise(run))
    tabular.write(path / schema.OUTCOMES, outcome_table(run))
