"""The Neutral File Format, in which the Standard Procedural Databases come."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from rtbench.errors import unknown
from rtbench.scenes.hither import is_cut
from rtbench.scenes.model import (
    BLACK,
    Camera,
    Cone,
    Light,
    Material,
    Object,
    Scene,
    SceneError,
    Sphere,
    Triangles,
    check_colour,
    check_number,
)
from rtbench.scenes.nff_fill import material_of
from rtbench.scenes.nff_words import ENTITIES, VIEW, LineError, Words, is_number
from rtbench.scenes.placement import PlacementError, check_placement
from rtbench.scenes.polygons import triangulated

OBJECTS = ("c", "s", "p", "pp")
OF_CAMERA = {"position": "from", "target": "at", "width": "resolution", "height": "resolution"}
MOST_VERTICES = 1_000_000  # of a polygon
NEAR = 1e-9  # what is looked at once more, exactly


def read(path: str | os.PathLike) -> Scene:
    """Read a scene in the Neutral File Format.

    Parameters
    ----------
    path : path

    Returns
    -------
    Scene
        The polygons of a fill are one object, its patches another; fills that nothing has are left
        out.

    Raises
    ------
    SceneError
        In one line with the file and the line: a file that is absent, entities that are unknown,
        numbers that are missing, too many, none, not finite or not allowed, objects before ``v``.

    Source
    ------
    E. Haines, Neutral File Format 3.9, 1996. An angle is taken from the lower to the upper edge of
    the picture, as his package writes it for POV-Ray.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as problem:
        reason = problem.strerror or type(problem).__name__
        raise SceneError("file", f"scene {str(path)!r} cannot be read: {reason}") from None
    try:
        return _Reading(text).scene(path)
    except LineError as problem:
        told = f"{path}, line {problem.line}: {problem}"
        raise SceneError(problem.key, told) from None
    except SceneError as problem:
        raise SceneError(problem.key, f"{path}: {problem}") from None


class _Reading:
    """What has been read so far."""

    def __init__(self, text: str) -> None:
        self.words = Words(text)
        self.camera: Camera | None = None
        self.camera_line = 0
        self.hither = 0.0
        self.background = BLACK
        self.lights: list[tuple[Light, bool, int]] = []  # whether it has a colour, its line
        self.fill: Material | None = Material(name="default")  # None: among the materials already
        self.materials: list[Material] = []
        self.objects: list[Object] = []
        self.whole: list[tuple[int, int]] = []  # spheres seen from outside: number, line
        self.inside_out = 0
        self.polygons: list[np.ndarray] = []
        self.patches: list[np.ndarray] = []
        takers = {"v": self._view, "b": self._background, "l": self._light, "f": self._fill}
        takers |= {"c": self._cone, "s": self._sphere, "p": self._polygon, "pp": self._patch}
        last = ""
        while (entity := self.words.next) is not None:
            self.words.take()
            line = self.words.line
            try:
                self._expected(entity, last)
                takers[entity]()
            except LineError:
                raise
            except SceneError as problem:
                raise LineError(problem.key, str(problem), line) from None
            last = entity
        self._gather()

    def _expected(self, entity: str, last: str) -> None:
        """Raise SceneError for a word that is no entity, or not yet."""
        if entity not in ENTITIES:
            if last and is_number(entity):
                told = f"{entity!r} is one number too many for {last!r}"
                raise SceneError(last, f"{told} (allowed: {', '.join(ENTITIES)}, #)")
            raise SceneError("entity", unknown("entity", entity, [*ENTITIES, "#"]))
        if entity in OBJECTS and self.camera is None:
            raise SceneError(entity, f"object {entity!r} before the view 'v'")
        if entity == "v" and self.camera is not None:
            raise SceneError("v", "a second view 'v' (allowed: one)")

    def _view(self) -> None:
        found: dict[str, list[float]] = {}
        lines = {}
        self.camera_line = self.words.line
        while self.words.next in VIEW:
            key = self.words.take()
            if key in found:
                raise LineError(key, f"{key!r} is there twice", self.words.line)
            lines[key] = self.words.line
            found[key] = self.words.numbers(VIEW[key], key)
        missing = [key for key in VIEW if key not in found and key != "hither"]
        if missing:
            word = self.words.next
            if word is not None and word not in ENTITIES and not is_number(word):
                told = unknown("part of the view", word, VIEW)
                raise LineError("v", told, self.words.lines[self.words.at])
            raise SceneError(missing[0], f"the view 'v' has no {missing[0]!r}")
        width, height = found["resolution"]
        (self.hither,) = found.get("hither", (0.0,))
        try:
            for side in (width, height):
                if side != int(side):
                    raise SceneError("resolution", f"resolution {side:g} is no whole number")
            self.camera = Camera(
                position=tuple(found["from"]),
                target=tuple(found["at"]),
                up=tuple(found["up"]),
                angle=found["angle"][0],
                width=int(width),
                height=int(height),
            )
        except SceneError as problem:
            line = lines[OF_CAMERA.get(problem.key, problem.key)]
            raise LineError(problem.key, str(problem), line) from None
        self.camera_line = lines["from"]

    def _background(self) -> None:
        self.background = tuple(self.words.numbers(3, "b"))
        check_colour("b", self.background)

    def _light(self) -> None:
        line = self.words.line
        position = tuple(self.words.numbers(3, "l"))
        coloured = is_number(self.words.next)
        color = {"color": tuple(self.words.numbers(3, "l"))} if coloured else {}
        self.lights.append((Light(position=position, **color), coloured, line))

    def _fill(self) -> None:
        self._gather()
        line = self.words.line
        self.fill = material_of(self.words.numbers(8, "f"), f"fill of line {line}")

    def _material(self) -> int:
        if self.fill is not None:
            self.materials.append(self.fill)
            self.fill = None
        return len(self.materials) - 1

    def _gather(self) -> None:
        """Make objects of the polygons and the patches of a fill."""
        for cut, name in ((self.polygons, "polygons"), (self.patches, "patches")):
            if cut:
                corners = np.concatenate(cut)
                normals = corners[:, :, 3:] if name == "patches" else None
                corners = np.ascontiguousarray(corners[:, :, :3])
                self.objects.append(Triangles(self._material(), BLACK, corners, normals, name=name))
                cut.clear()

    def _sphere(self) -> None:
        line = self.words.line
        *center, radius = self.words.numbers(4, "s")
        if radius < 0:
            self.inside_out += 1
        else:
            self.whole.append((len(self.objects), line))
        self.objects.append(Sphere(self._material(), BLACK, tuple(center), abs(radius)))

    def _cone(self) -> None:
        *base, wide, ax, ay, az, narrow = self.words.numbers(8, "c")
        if wide < 0 or narrow < 0:
            if wide > 0 or narrow > 0:
                told = f"c has radii {wide:g} and {narrow:g} (allowed: both of one sign)"
                raise SceneError("c", told)
            self.inside_out += 1
        ends = tuple(base), (ax, ay, az)
        self.objects.append(Cone(self._material(), BLACK, *ends, abs(wide), abs(narrow)))

    def _vertices(self, entity: str, width: int) -> np.ndarray:
        """Return the corners of the triangles of a polygon, (k, 3, width)."""
        count = self.words.whole(entity)
        check_number(entity, count, 3, MOST_VERTICES, f"3 to {MOST_VERTICES} vertices")
        found = np.array(self.words.numbers(width * count, entity)).reshape(count, width)
        return found[triangulated(found[:, :3])]

    def _polygon(self) -> None:
        self.polygons.append(self._vertices("p", 3))
        self._material()

    def _patch(self) -> None:
        found = self._vertices("pp", 6)
        if not found[:, :, 3:].any(axis=2).all():
            raise SceneError("normals", "a normal of the patch has no direction")
        self.patches.append(found)
        self._material()

    def scene(self, path: Path) -> Scene:
        """Return what it all comes to."""
        if self.camera is None:
            raise SceneError("v", "there is no view 'v'")
        white = (1 / math.sqrt(max(1, len(self.lights))),) * 3
        self._check_placement()
        return Scene(
            name=path.stem,
            camera=self.camera,
            lights=tuple(
                each if coloured else replace(each, color=white)
                for each, coloured, _ in self.lights
            ),
            materials=tuple(self.materials) or (Material(),),
            objects=tuple(self.objects),
            background=self.background,
            source=str(path),
            remarks=tuple(f"{path}: {each}" for each in self._remarks()),
        )

    def _check_placement(self) -> None:
        """Raise LineError for a camera inside a sphere or a light on one."""
        spheres = [self.objects[number] for number, _ in self.whole]
        if not spheres:
            return
        # Few come near: these alone are looked at one by one.
        centers = np.array([each.center for each in spheres])
        radii = np.array([each.radius for each in spheres])
        doubtful = np.linalg.norm(centers - self.camera.position, axis=1) <= radii * (1 + NEAR)
        for light, _, _ in self.lights:
            off = np.abs(np.linalg.norm(centers - light.position, axis=1) - radii)
            doubtful |= off <= NEAR * (np.abs(centers).max(axis=1) + radii)
        chosen = np.flatnonzero(doubtful).tolist()
        lights = tuple(light for light, _, _ in self.lights)
        names = [f"the sphere of line {self.whole[i][1]}" for i in chosen]
        try:
            check_placement(self.camera, lights, tuple(spheres[i] for i in chosen), names)
        except PlacementError as problem:
            line = self.camera_line if problem.light is None else self.lights[problem.light][2]
            raise LineError(problem.key, str(problem), line) from None

    def _remarks(self) -> list[str]:
        said = []
        if any(each.name == "default" for each in self.materials):
            said.append("objects before the first fill 'f' are white, matte")
        if self.inside_out:
            said.append(
                f"{self.inside_out} spheres or cones have negative radii, of which the inside "
                "alone is to be seen: they are taken whole"
            )
        if not self.lights:
            said.append("no light 'l'")
        if not self.objects:
            said.append("no objects")
        if is_cut(self.camera, self.hither, self.objects):
            said.append(f"hither {self.hither:g} would cut off what is in view: it is not heeded")
        return said
