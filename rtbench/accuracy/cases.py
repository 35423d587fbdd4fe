"""Hard cases: rays and triangles with their exact answers, as arrays and as a file.

Classes of the exact answer (two-sided triangle, ray interval t > 0); what a kernel owes by class is
in ``EXPECT``: a hit, a miss, or either where the case is a tie.
"""

from __future__ import annotations

import io
import os
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from rtbench.errors import RtbenchError

CLASS_NAMES = (
    "miss",
    "hit_interior",
    "hit_edge",
    "hit_vertex",
    "origin_on",
    "behind",
    "coplanar_touch",
    "coplanar_miss",
    "parallel",
    "degenerate_touch",
    "degenerate_miss",
    "invalid",
)
(
    MISS,
    HIT_INTERIOR,
    HIT_EDGE,
    HIT_VERTEX,
    ORIGIN_ON,
    BEHIND,
    COPLANAR_TOUCH,
    COPLANAR_MISS,
    PARALLEL,
    DEGENERATE_TOUCH,
    DEGENERATE_MISS,
    INVALID,
) = range(12)

MUST_MISS, MUST_HIT, EITHER = 0, 1, 2
EXPECT = np.array([0, 1, 2, 2, 2, 0, 2, 0, 0, 2, 0, 0], np.int8)
"""What a kernel owes by class: 0 a miss, 1 a hit, 2 either."""

# Of an array with a row a case: its dtype and the shape of one row.
_COLUMNS = {
    **dict.fromkeys(("v0", "v1", "v2", "org", "dir"), (np.float64, (3,))),
    "family": (np.int16, ()),
    "difficulty": (np.float64, ()),
    "f32_ok": (np.bool_, ()),
    **dict.fromkeys(("cls", "expect", "sos_hit"), (np.int8, ())),
    **dict.fromkeys(("t", "u", "v", "eta", "cond_t", "cond_u", "cond_v"), (np.float64, ())),
    "group": (np.int32, ()),
}
_RANGES = {"expect": (0, 2), "sos_hit": (-1, 1), "group": (-1, None)}
_TABLES = ("family_names", "group_rule", "class_names")
_TEXTS = ("name", "source")


def _wanted(name: str, given: object, dtype: type, shape: tuple[int | None, ...]) -> np.ndarray:
    """Return one array in its dtype; complain about what does not fit in it."""
    array = np.asarray(given)
    fits = array.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted = ", ".join("N" if n is None else str(n) for n in shape)
        wanted += "," if len(shape) == 1 else ""
        raise RtbenchError(f"array {name!r} must have the shape ({wanted}), not {array.shape}")
    kinds = {"f": "fiu", "i": "iu", "b": "b"}[np.dtype(dtype).kind]
    if array.dtype.kind not in kinds:
        raise RtbenchError(f"array {name!r} must be {np.dtype(dtype)}, not {array.dtype}")
    with np.errstate(over="ignore"):
        taken = np.ascontiguousarray(array, dtype)
    if not np.array_equal(taken, array, equal_nan=taken.dtype.kind == "f"):
        raise RtbenchError(f"array {name!r} has values that {np.dtype(dtype)} does not hold")
    return taken


def _texts(name: str, given: object) -> tuple[str, ...]:
    array = np.asarray(given)
    if array.ndim != 1 or (array.dtype.kind != "U" and array.size):
        raise RtbenchError(f"array {name!r} must be a list of texts, not {array.dtype}")
    return tuple(map(str, array))


def _within(name: str, values: np.ndarray, low: int, high: int | None) -> None:
    """Complain, naming the first, about integers outside low to high."""
    outside = values < low if high is None else (values < low) | (values > high)
    if outside.any():
        i = int(np.argmax(outside))
        allowed = f"at least {low}" if high is None else f"{low} to {high}"
        raise RtbenchError(f"array {name!r} has {values[i]} in row {i} (allowed: {allowed})")


@dataclass(frozen=True, eq=False)
class Cases:
    """Rays against triangles, one a row, with what exact arithmetic says of them.

    Attributes
    ----------
    v0, v1, v2 : (N, 3) float64 array
        Vertices.
    org, dir : (N, 3) float64 array
        Rays' origins and directions.
    family : (N,) int16 array
        Index into family_names.
    family_names : tuple of str
        F names of families.
    difficulty : (N,) float64 array
        How hard, in the family's own unit.
    f32_ok : (N,) bool array
        True where float32 holds all fifteen numbers.
    cls : (N,) int8 array
        Exact class, an index into class_names.
    expect : (N,) int8 array
        1 must hit, 0 must miss, 2 either.
    sos_hit : (N,) int8 array
        The answer with ties broken: 1, 0; -1 undefined.
    class_names : tuple of str
        Names of the classes.
    t, u, v : (N,) float64 array
        Where the line meets the plane; NaN where it does not. t in units of the direction.
    eta : (N,) float64 array
        Relative perturbation of the numbers that would change the answer; NaN where undefined.
    cond_t, cond_u, cond_v : (N,) float64 array
        Absolute condition numbers of t, u and v, in their units; NaN where undefined.
    group : (N,) int32 array
        Cases with one number belong together (-1: none).
    group_rule : (F,) int8 array
        What holds for a group of a family: 1 at least one hit, ideally exactly one; 2 an odd
        number; 3 the same answer for all; 0 nothing.
    name, source : (N,) unicode array, optional
        What a case is called and who published it; empty where it has none.
    """

    v0: np.ndarray
    v1: np.ndarray
    v2: np.ndarray
    org: np.ndarray
    dir: np.ndarray
    family: np.ndarray
    family_names: tuple[str, ...]
    difficulty: np.ndarray
    f32_ok: np.ndarray
    cls: np.ndarray
    expect: np.ndarray
    sos_hit: np.ndarray
    class_names: tuple[str, ...]
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    eta: np.ndarray
    cond_t: np.ndarray
    cond_u: np.ndarray
    cond_v: np.ndarray
    group: np.ndarray
    group_rule: np.ndarray
    name: np.ndarray | None = None
    source: np.ndarray | None = None

    def __post_init__(self) -> None:
        n = len(np.atleast_1d(self.v0))
        take = object.__setattr__  # the class is frozen
        for column, (dtype, row) in _COLUMNS.items():
            take(self, column, _wanted(column, getattr(self, column), dtype, (n, *row)))
        for column in ("family_names", "class_names"):
            take(self, column, _texts(column, getattr(self, column)))
        families = len(self.family_names)
        take(self, "group_rule", _wanted("group_rule", self.group_rule, np.int8, (families,)))
        for column in _TEXTS:
            given = getattr(self, column)
            texts = ("",) * n if given is None else _texts(column, given)
            if len(texts) != n:
                raise RtbenchError(f"array {column!r} must have {n} texts, not {len(texts)}")
            take(self, column, np.array(texts, np.str_))
        _within("family", self.family, 0, families - 1)
        _within("cls", self.cls, 0, len(self.class_names) - 1)
        _within("group_rule", self.group_rule, 0, 3)
        for column, (low, high) in _RANGES.items():
            _within(column, getattr(self, column), low, high)

    def __len__(self) -> int:
        return len(self.v0)

    @property
    def triangles(self) -> np.ndarray:
        """Vertices as one (N, 3, 3) float64 array."""
        return np.stack([self.v0, self.v1, self.v2], axis=1)

    def take(self, indices: np.ndarray) -> Cases:
        """Return some of the cases.

        Parameters
        ----------
        indices : int array, bool array or slice
            Which, in the order wanted.

        Returns
        -------
        Cases
            With the same families and classes.
        """
        rows = {c: getattr(self, c)[indices] for c in (*_COLUMNS, *_TEXTS)}
        return Cases(**rows, **{table: getattr(self, table) for table in _TABLES})

    def save(self, path: str | Path) -> None:
        """Write the cases as an npz file that loads without pickle.

        Parameters
        ----------
        path : str or Path
            The file's name, used as given; a file that is there is replaced only when all is
            written.

        Raises
        ------
        RtbenchError
            If the file cannot be written.
        """
        path = Path(path)
        arrays = {field.name: np.asarray(getattr(self, field.name)) for field in fields(self)}
        data = io.BytesIO()
        np.savez_compressed(data, **arrays)
        try:
            handle, temporary = tempfile.mkstemp(".part", f".{path.name}.", path.parent)
        except OSError as error:
            raise RtbenchError(f"cannot write {path}: {error.strerror}") from None
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data.getbuffer())
            mask = os.umask(0)  # mkstemp made it private; a corpus is to be handed on
            os.umask(mask)
            os.chmod(temporary, 0o666 & ~mask)
            os.replace(temporary, path)
        except OSError as error:
            Path(temporary).unlink(missing_ok=True)
            raise RtbenchError(f"cannot write {path}: {error.strerror}") from None
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise

    @classmethod
    def load(cls, path: str | Path) -> Cases:
        """Read cases that `save` wrote, or anybody else in the same format.

        Parameters
        ----------
        path : str or Path
            An npz file; arrays unknown to the format are ignored, also if they are pickled.

        Returns
        -------
        Cases

        Raises
        ------
        RtbenchError
            Naming the file and what is missing, misshapen or of a wrong type in it.
        """
        try:
            with open(path, "rb") as file:
                return cls(**_read(file))
        except OSError as error:
            raise RtbenchError(f"cannot read {path}: {error.strerror or error}") from None
        except RtbenchError as error:
            raise RtbenchError(f"{path}: {error}") from None


def _read(file: io.BufferedReader) -> Mapping[str, np.ndarray]:
    """Return the arrays of the format that are in an npz file."""
    try:
        archive = np.load(file, allow_pickle=False)
    except (ValueError, EOFError, zipfile.BadZipFile):
        archive = None
    if not isinstance(archive, np.lib.npyio.NpzFile):
        raise RtbenchError("not an npz file of cases")
    names = [field.name for field in fields(Cases)]
    missing = [name for name in names if name not in archive.files and name not in _TEXTS]
    if missing:
        raise RtbenchError(f"missing array {', '.join(map(repr, missing))}")
    arrays = {}
    for name in names:
        if name in archive.files:
            try:
                arrays[name] = archive[name]
            except (ValueError, EOFError, zipfile.BadZipFile, zipfile.zlib.error) as error:
                reason = str(error).splitlines()[0]
                raise RtbenchError(f"array {name!r} cannot be read: {reason}") from None
    return arrays
