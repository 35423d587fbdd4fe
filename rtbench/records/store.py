"""Run folders, found and loaded."""

import difflib
from pathlib import Path

from rtbench import resources
from rtbench.errors import NotComparable, RtbenchError, unknown
from rtbench.records.run import Run, read_info
from rtbench.records.schema import RUN, SAMPLES, UNTIMED


def find_run(ref: str, out: Path) -> Path:
    """Return the folder of a run.

    Parameters
    ----------
    ref : str
        A path, a folder name under ``out``, or the name of a published run (in this order).
    out : Path
        The output folder.

    Returns
    -------
    Path
        An existing folder.

    Raises
    ------
    RtbenchError
        If there is none; the message has the nearest name.
    """
    for path in (Path(ref), Path(out) / ref, resources.published() / ref):
        if ref and path.is_dir():
            return path
        if ref and path.is_file() and path.name in (RUN, SAMPLES):
            return path.parent
    own = [folder.parent.name for folder in Path(out).glob(f"[!.]*/{RUN}")]
    names = own + [folder.parent.name for folder in resources.published().glob(f"*/{RUN}")]
    # The newest few are enough to choose from; the nearest is looked for among all.
    near = difflib.get_close_matches(ref, names, n=1, cutoff=0.5)
    shown = sorted(set(near + sorted(own)[-5:] + names[len(own) :]))
    raise RtbenchError(unknown("run", ref, shown))


def load_run(ref: str | Path, out: Path = Path("results")) -> Run:
    """Find a run and read its run.json; its tables are read when they are asked for.

    Parameters
    ----------
    ref : str or Path
        As `find_run` takes it.
    out : Path
        The output folder.

    Returns
    -------
    Run
        The run, finished or not.

    Raises
    ------
    RtbenchError
        If there is no such run.
    NotComparable
        If it cannot be read.
    """
    path = find_run(str(ref), Path(out))
    run = Run(path, read_info(path))
    if not run.published and run.info.get("experiment") not in UNTIMED:
        if not (path / SAMPLES).exists():
            raise NotComparable(f"{path} has no {SAMPLES}: not a run that can be read")
        _ = run.samples  # a damaged file is told here, where the reader asked for the run
    return run
