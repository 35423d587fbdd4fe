"""Where the configs and the published records are: in the wheel, else beside the package."""

from pathlib import Path

from rtbench.errors import RtbenchError

_PACKAGE = Path(__file__).resolve().parent


def configs() -> Path:
    """Return the folder of the TOML configs.

    Returns
    -------
    Path
        ``rtbench/_data/configs`` of an installed wheel, else ``configs`` of the source tree.

    Raises
    ------
    RtbenchError
        If neither is there.
    """
    return _folder("configs", Path("configs"))


def published() -> Path:
    """Return the folder of the published records.

    Returns
    -------
    Path
        ``rtbench/_data/published`` of an installed wheel, else ``results/published`` of the
        source tree.

    Raises
    ------
    RtbenchError
        If neither is there.
    """
    return _folder("published", Path("results") / "published")


def _folder(installed: str, source: Path) -> Path:
    places = (_PACKAGE / "_data" / installed, _PACKAGE.parent / source)
    for place in places:
        if place.is_dir():
            return place
    raise RtbenchError(f"{places[0]} is missing: the installation is not whole, reinstall rtbench")
