"""The one door to scenes: files of any kind, scenes that ship, models."""

from __future__ import annotations

import os
from pathlib import Path

from rtbench import resources
from rtbench.errors import unknown
from rtbench.scenes.model import Scene, SceneError

OWN = (".toml", ".nff")
MESHES = (".ply", ".stl", ".obj", ".off", ".gltf", ".glb")  # the best known; trimesh knows more


def names() -> list[str]:
    """Return the names of the scenes that ship with rtbench, sorted."""
    return sorted(_shipped())


def read(path: str | os.PathLike, models: str | os.PathLike | None = None) -> Scene:
    """Read a scene.

    Parameters
    ----------
    path : str or path
        A file, by its suffix: ``.toml`` (our own format), ``.nff`` (Neutral File Format), or a
        mesh, which gets a camera and a light; or the name of a scene that ships (`names`), of a
        mesh file in the folder of models, or of a generated model: ``robots:20000``. A file in the
        current folder goes first.
    models : path, optional
        The folder of mesh files; what RTBENCH_MODELS names if not given.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        In one line: unknown names and suffixes and files that are absent, with the nearest; and
        whatever is wrong in a file, with its line and key.
    """
    text = os.fspath(path)
    file = Path(text)
    shipped = _shipped()
    if not file.is_file() and text in shipped:
        file = shipped[text]
    suffix = file.suffix.lower()
    if file.is_file():
        if suffix in OWN:
            return _own(file)
        _check_suffix(text, suffix)
    else:
        _check_name(text, suffix, shipped, models)
    from rtbench.scenes import mesh_scene  # here: other scenes need no meshes

    return mesh_scene.read(text, models)


def _shipped() -> dict[str, Path]:
    return {file.stem: file for file in (resources.configs() / "scenes").glob("*.toml")}


def _own(file: Path) -> Scene:
    if file.suffix.lower() == ".nff":
        from rtbench.scenes import nff as reader
    else:
        from rtbench.scenes import toml_scene as reader
    return reader.read(file)


def _check_suffix(text: str, suffix: str) -> None:
    """Raise SceneError for a file of no format that is read."""
    if suffix in MESHES:
        return
    import trimesh  # here: it costs half a second

    form = suffix.removeprefix(".")
    allowed = {each.removeprefix(".") for each in OWN} | set(trimesh.available_formats())
    if form not in allowed:
        told = unknown("scene format", form, allowed)
        raise SceneError("scene", f"scene {text!r}: {told}")


def _check_name(
    text: str, suffix: str, shipped: dict[str, Path], models: str | os.PathLike | None
) -> None:
    """Raise SceneError for what is neither a file nor the name of a scene or of a model."""
    from rtbench.workloads import meshes
    from rtbench.workloads.generated_models import MODELS

    there = meshes.models(models)
    if text in there or text.partition(":")[0] in MODELS:
        return
    file = Path(text)
    if file.is_dir():
        raise SceneError("scene", f"scene {text!r} is a folder (allowed: a file)")
    if not suffix and len(file.parts) < 2:
        raise SceneError("scene", unknown("scene", text, [*shipped, *there, *MODELS]))
    beside = file.parent.iterdir() if file.parent.is_dir() else ()
    near = [str(each) for each in beside if each.suffix.lower() in OWN + MESHES]
    told = f"scene {text!r}: there is no such file"
    hint = unknown("file", text, near).partition("; ")[2] if near else ""
    raise SceneError("scene", f"{told}; {hint}" if hint else told)
