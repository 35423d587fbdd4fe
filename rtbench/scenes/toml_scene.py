"""Scene files in TOML, our own format: `format` tells every key."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from rtbench.errors import unknown
from rtbench.scenes.format import OBJECT_KINDS
from rtbench.scenes.model import (
    LIGHT_KINDS,
    TEXTURE_KINDS,
    Camera,
    Indirect,
    Light,
    Material,
    Object,
    Scene,
    SceneError,
    Settings,
    Texture,
)
from rtbench.scenes.placement import PlacementError, check_placement
from rtbench.scenes.toml_objects import made
from rtbench.scenes.toml_values import LocatedError, SceneFile, kind_of, shown, values_of

_LIGHT_TABLES = {kind: "ball" if kind == "sphere" else kind for kind in LIGHT_KINDS}


def read(path: str | os.PathLike) -> Scene:
    """Read a scene file in TOML.

    Parameters
    ----------
    path : path

    Returns
    -------
    Scene
        With the materials, lights and objects of the files that it includes, before its own.

    Raises
    ------
    SceneError
        In one line with the file, the line and the key: files that are absent or no TOML, files
        that include each other, unknown keys, kinds and materials with the nearest one, keys that
        are missing, wrong types, values that cannot be, a camera inside a ball, a light on a
        surface.
    """
    return _Reading(Path(path)).scene


class _Reading:
    """What has been read so far, and where it stands, for what can be checked only at the end."""

    def __init__(self, path: Path) -> None:
        self.files: dict[Path, SceneFile] = {}
        self.materials: dict[str, tuple[Material, SceneFile]] = {}
        self.lights: list[tuple[Light, SceneFile, int]] = []
        self.objects: list[Object] = []
        self.called: list[str] = []  # the objects, in messages
        self.remarks: list[str] = []
        top = SceneFile(path)
        order = self._include(top, ())
        for file in order:
            self._materials(file)
        for file in order:
            self._lights(file)
            self._objects(file)
        self.scene = self._scene(top)

    def _include(self, file: SceneFile, chain: tuple[Path, ...]) -> list[SceneFile]:
        """Return the files that a file includes, each once, and then itself."""
        place = Path(os.path.realpath(file.path))
        self.files[place] = file
        found = []
        with file.at(()):
            # Of files that are included as well: a mistake in them is one, whatever it concerns.
            wanted = values_of("scene", {"camera": {}, **file.told}, "scene")
            if not chain and "camera" not in file.told:
                values_of("scene", file.told, "scene")
            for name in wanted.get("include", ()):
                other = file.path.parent / name
                there = Path(os.path.realpath(other))
                if there in (*chain, place):
                    round_it = [*chain, place, there]
                    names = [each.name for each in round_it[round_it.index(there) :]]
                    told = f"include {shown(name)} leads in a circle: {' > '.join(names)}"
                    raise SceneError("include", told)
                if there in self.files:
                    continue
                try:
                    included = SceneFile(other)
                except LocatedError:
                    raise
                except SceneError as problem:
                    raise SceneError("include", f"include: {problem}") from None
                found += self._include(included, (*chain, place))
        return [*found, file]

    def _materials(self, file: SceneFile) -> None:
        with file.at(()):
            tables = file.told.get("materials", {})
            if not isinstance(tables, dict):
                told = f"materials {shown(tables)} is not allowed (allowed: tables by name)"
                raise SceneError("materials", told)
        for name, told in tables.items():
            way = ("materials", name)
            with file.at(("materials",)):
                if name in self.materials:
                    other = self.materials[name][1].path
                    raise SceneError(name, f"material {name!r} is there twice: also in {other}")
                if not isinstance(told, dict):
                    raise SceneError(name, f"material {name} {shown(told)} is no table")
            with file.at(way):
                values = values_of("material", told, "material")
                if "texture" in values:
                    with file.at((*way, "texture")):
                        values["texture"] = _texture(values["texture"], file.path.parent)
                self.materials[name] = (Material(**values, name=name), file)

    def _tables(self, file: SceneFile, key: str) -> list[Any]:
        with file.at(()):
            tables = file.told.get(key, [])
            if not isinstance(tables, list) or not all(isinstance(t, dict) for t in tables):
                told = (
                    f"{key} {shown(tables)} is not allowed (allowed: tables, each below [[{key}]])"
                )
                raise SceneError(key, told)
        return tables

    def _lights(self, file: SceneFile) -> None:
        for number, told in enumerate(self._tables(file, "lights")):
            with file.at(("lights", number)):
                kind = kind_of(told, "light", LIGHT_KINDS)
                light = Light(**values_of(_LIGHT_TABLES[kind], told, f"{kind} light"))
            self.lights.append((light, file, number))

    def _objects(self, file: SceneFile) -> None:
        names = list(self.materials)
        for number, told in enumerate(self._tables(file, "objects")):
            with file.at(("objects", number)):
                kind = kind_of(told, "object", OBJECT_KINDS)
                values = values_of(kind, told, kind)
                name = values["material"]
                if name not in self.materials:
                    told = unknown("material", name, names) if names else f"{name}: there are none"
                    raise SceneError("material", told)
                each, remark = made(kind, values, names.index(name), file.path.parent)
            self.objects.append(each)
            self.called.append(f"object {number + 1} ({kind})")
            if file is not next(iter(self.files.values())):
                self.called[-1] += f" of {file.path}"
            if remark:
                self.remarks.append(f"{file.path}: {remark}")
            texture = self.materials[name][0].texture
            if texture and texture.kind == "image" and getattr(each, "coordinates", None) is None:
                told = f"{self.called[-1]} has no coordinates: of its image one pixel shows"
                self.remarks.append(f"{file.path}: {told}")

    def _scene(self, file: SceneFile) -> Scene:
        told = file.told
        with file.at(("camera",)):
            camera = Camera(**values_of("camera", told["camera"], "camera"))
        settings = _settings(file)
        lights = tuple(light for light, _, _ in self.lights)
        materials = tuple(material for material, _ in self.materials.values())
        try:
            check_placement(camera, lights, tuple(self.objects), self.called)
        except PlacementError as problem:
            if problem.light is None:
                raise file.error(("camera",), problem.key, str(problem)) from None
            _, there, number = self.lights[problem.light]
            raise there.error(("lights", number), problem.key, str(problem)) from None
        used = {each.material for each in self.objects}
        unused = [each.name for number, each in enumerate(materials) if number not in used]
        if unused:
            listed = ", ".join(repr(name) for name in unused)
            self.remarks.append(f"{file.path}: no object has the material {listed}")
        with file.at(()):
            given = values_of("scene", told, "scene")
            return Scene(
                name=given.get("name", file.path.stem),
                camera=camera,
                lights=lights,
                materials=materials or (Material(),),
                objects=tuple(self.objects),
                settings=settings,
                source=str(file.path),
                remarks=tuple(self.remarks),
                **{key: given[key] for key in ("background", "ambient") if key in given},
            )


def _settings(file: SceneFile) -> Settings:
    way = ("settings",)
    with file.at(way):
        values = values_of("settings", file.told.get("settings", {}), "settings")
        if "indirect" in values:
            with file.at((*way, "indirect")):
                told = values_of("indirect", values["indirect"], "indirect")
                values["indirect"] = Indirect(**told)
        return Settings(**values)


def _texture(told: Any, folder: Path) -> Texture:
    kind = kind_of(told, "texture", TEXTURE_KINDS)
    values = values_of(kind, told, f"{kind} texture")
    if kind == "checker":
        return Texture(**values)
    file = folder / values["file"]
    return Texture(kind="image", pixels=linear_pixels(file), source=str(file))


def linear_pixels(path: Path) -> np.ndarray:
    """Read an image in sRGB as linear red, green and blue.

    Returns
    -------
    (H, W, 3) float32 array
        From 0 to 1, row 0 on top; how opaque pixels are is left out.

    Raises
    ------
    SceneError
        ``file``: absent, no image, or cut off.

    Source
    ------
    IEC 61966-2-1:1999, the sRGB curve.
    """
    from PIL import Image, UnidentifiedImageError  # here: scenes without images need it not

    try:
        with Image.open(path) as image:
            pixels = np.asarray(image.convert("RGB"))
    except UnidentifiedImageError:
        raise SceneError("file", f"file: {str(path)!r} is no image") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as problem:
        reason = getattr(problem, "strerror", None) or " ".join(str(problem).split())
        raise SceneError("file", f"file: image {str(path)!r} cannot be read: {reason}") from None
    levels = np.arange(256) / 255.0
    curve = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
    return curve.astype(np.float32)[pixels]
