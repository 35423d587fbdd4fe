"""Run folders, made and grown round by round.

Whatever kills the run, the folder can be loaded: it appears under its name with run.json and the
header of samples.csv in it, run.json is only ever replaced by a rename, and samples.csv only grows.
"""

import json
import os
import re
import shutil
import tempfile
import time
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from rtbench.errors import RtbenchError
from rtbench.records.run import read_info
from rtbench.records.samples import read_samples
from rtbench.records.schema import OUTCOMES, RUN, SAMPLES, SCHEMA, SUMMARY
from rtbench.records.tabular import lines, reason, replace

try:
    import fcntl
except ImportError:  # not a POSIX system: two writers of one run are not noticed there
    fcntl = None


MAKING = ".making-"
ABANDONED = 86400.0  # seconds after which a folder that never got its name is somebody's leftover


class RunWriter:
    """Writes one run folder.

    Attributes
    ----------
    path : Path
        The folder.
    name : str
        The folder's name.
    info : dict
        What run.json holds now.
    columns : list of str
        The header of samples.csv.
    """

    def __init__(self, path: Path, info: dict, columns: list[str]) -> None:
        self.path = path
        self.name = path.name
        self.info = info
        self.columns = columns
        try:
            self._file = os.open(path / SAMPLES, os.O_WRONLY | os.O_APPEND)
        except OSError as error:
            raise RtbenchError(f"cannot write {path / SAMPLES}: {reason(error)}") from error
        try:
            if fcntl is not None:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(self._file)
            raise RtbenchError(f"{path} is being written by another process") from error

    @classmethod
    def create(
        cls, out: Path, label: str, config_name: str, info: dict, sample_columns: list[str]
    ) -> "RunWriter":
        """Make a new run folder.

        Parameters
        ----------
        out : Path
            The output folder, made if it is not there.
        label, config_name : str
            Parts of the folder's name; what does not belong in one becomes ``-``.
        info : dict
            The content of run.json; schema, name, created and finished are filled in here.
        sample_columns : list of str
            The header of samples.csv.

        Returns
        -------
        RunWriter
            Ready for the first round.

        Raises
        ------
        RtbenchError
            If nothing can be written there.
        """
        out = Path(out)
        now = datetime.now(UTC)
        words = (re.sub(r"[^\w.+-]+", "-", word).strip("-.") for word in (label, config_name))
        stem = "-".join([now.strftime("%Y%m%d-%H%M%S"), *(word for word in words if word)])
        created = now.isoformat(timespec="seconds")
        head = {"schema": SCHEMA, "name": stem, "created": created, "finished": None}
        info = head | {key: value for key, value in info.items() if key not in head}
        making = None
        try:
            out.mkdir(parents=True, exist_ok=True)
            _sweep(out)
            making = Path(tempfile.mkdtemp(prefix=MAKING, dir=out))
            making.chmod(0o777 & ~_umask())
            _write_new(making / SAMPLES, ",".join(sample_columns) + "\n")
            path = _name_it(making, out, stem, info)
        except OSError as error:
            if making is not None:
                shutil.rmtree(making, ignore_errors=True)
            raise RtbenchError(f"cannot write to {out}: {reason(error)}") from error
        return cls(path, info, list(sample_columns))

    @classmethod
    def reopen(cls, path: Path) -> "RunWriter":
        """Open an unfinished run to go on with it.

        A last line of samples.csv that was cut off is removed; every whole line stays. Which
        rounds are complete is for the caller to see from the run's samples.

        Parameters
        ----------
        path : Path
            The run folder.

        Returns
        -------
        RunWriter
            Ready for the next round.

        Raises
        ------
        RtbenchError
            If the run is finished, published, being written, or cannot be written.
        NotComparable
            If it cannot be read.
        """
        path = Path(path)
        info = read_info(path)
        if info.get("published"):
            raise RtbenchError(f"{path.name} is a published record: it cannot be resumed")
        if info.get("finished"):
            raise RtbenchError(
                f"{path.name} is finished: nothing is left to resume (rtbench table and rtbench "
                "plot make its tables and plots again)"
            )
        whole = read_samples(path / SAMPLES, info["cell"])
        writer = cls(path, info, whole.columns)
        # Read again now that the file is locked: another process may have written meanwhile.
        whole = read_samples(path / SAMPLES, info["cell"])
        try:
            os.ftruncate(writer._file, whole.size)
        except OSError as error:
            writer.close()
            raise RtbenchError(f"cannot write {path / SAMPLES}: {reason(error)}") from error
        if whole.size == 0:
            writer._write(",".join(whole.columns) + "\n")
        return writer

    def append(self, rows: list[dict]) -> None:
        """Add the samples of a round, on the disk when this returns.

        Parameters
        ----------
        rows : list of dict
            One sample each; absent keys become empty fields.

        Raises
        ------
        RtbenchError
            If they cannot be written; the round is then taken back as a whole.
        ValueError
            If a row has a key that is no column.
        """
        self._write(lines(rows, self.columns))

    def update(self, **more: object) -> None:
        """Let run.json grow.

        Absent keys are added, None is filled in, dicts are joined by the same rule, lists are
        extended by the items that they do not hold yet. Any other value that stands, stays: so a
        resumed run keeps what it was started with.

        Raises
        ------
        RtbenchError
            If it cannot be written.
        """
        grown = _grow(self.info, more)
        try:
            replace(self.path / RUN, _as_json(grown))
        except RtbenchError as error:
            raise RtbenchError(f"{error}; {self.cure()}") from error
        self.info = grown

    def finish(self, **more: object) -> None:
        """Mark the run as finished now, adding keys as `update` does, and close it."""
        self.update(finished=datetime.now(UTC).isoformat(timespec="seconds"), **more)
        for derived in (SUMMARY, OUTCOMES):
            # That the run is finished changes no table: those that stand are not out of date.
            with suppress(OSError):
                os.utime(self.path / derived)
        self.close()

    def close(self) -> None:
        """Close the file; a run that is not finished can be reopened."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def __enter__(self) -> "RunWriter":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, text: str) -> None:
        data = text.encode()
        size = None
        try:
            size = os.fstat(self._file).st_size
            written = os.write(self._file, data)
            while written < len(data):  # a nearly full disk takes a part; the rest then fails
                written += os.write(self._file, data[written:])
            os.fsync(self._file)
        except OSError as error:
            if size is not None:
                with suppress(OSError):
                    os.ftruncate(self._file, size)
            path = self.path / SAMPLES
            raise RtbenchError(f"cannot write {path}: {reason(error)}; {self.cure()}") from error

    def cure(self) -> str:
        """Return how to go on with the run after whatever stopped it."""
        in_default = self.path.parent == Path("results")
        run = self.name if in_default else self.path
        return f"what was measured is kept, go on with: rtbench run --resume {run}"


def _sweep(out: Path) -> None:
    """Remove what runs left behind that were killed while their folder was being made."""
    for making in out.glob(f"{MAKING}*"):
        with suppress(OSError):
            if time.time() - making.stat().st_mtime > ABANDONED:
                shutil.rmtree(making, ignore_errors=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _write_new(path: Path, text: str) -> None:
    with open(path, "x", encoding="utf-8", newline="") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())


def _name_it(making: Path, out: Path, stem: str, info: dict) -> Path:
    # A rename onto a folder that holds something fails: nothing is ever overwritten.
    for number in range(1, 10000):
        info["name"] = stem if number == 1 else f"{stem}-{number}"
        path = out / info["name"]
        if path.exists():
            continue
        (making / RUN).unlink(missing_ok=True)
        _write_new(making / RUN, _as_json(info))
        with suppress(FileExistsError):
            try:
                making.rename(path)
                return path
            except OSError:
                if not path.exists():
                    raise
    raise FileExistsError(f"{out / stem} exists ten thousand times")


def _as_json(info: dict) -> str:
    def value(item: object) -> object:
        if hasattr(item, "tolist"):
            return item.tolist()
        return str(item)

    return json.dumps(info, indent=1, ensure_ascii=False, default=value) + "\n"


def _grow(old: dict, more: dict) -> dict:
    grown = dict(old)
    for key, value in more.items():
        stands = grown.get(key)
        if stands is None:
            grown[key] = value
        elif isinstance(stands, dict) and isinstance(value, dict):
            grown[key] = _grow(stands, value)
        elif isinstance(stands, list) and isinstance(value, list):
            grown[key] = stands + [item for item in value if item not in stands]
    return grown
