"""What in a scene calls for each effect: one rule an effect, in words that name the culprit.

An effect counts only where it can change a pixel; where that is not certain, it counts. Lights,
objects and materials are numbered from 1 in the words, in the order of the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtbench.scenes.model import (
    Disc,
    Material,
    Object,
    Plane,
    Scene,
    Sphere,
    Texture,
    Triangles,
    Triple,
)


@dataclass(frozen=True)
class Reason:
    """Whether a scene calls for an effect, and what in the scene does or why nothing does."""

    called: bool
    why: str


Found = dict[str, Reason]  # of the effects before


class Seen:
    """What of a scene can show.

    Attributes
    ----------
    objects : list of (int, Object)
        Such as are something: Triangles without a triangle are not.
    materials : list of (str, Material)
        Those that an object uses, each once, with its words.
    lights : list of (str, Light)
        Those that shine, with their words.
    lit : bool
        Whether light that falls on some material comes back.
    depth : int
    threshold : float
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.objects = [
            (place, each)
            for place, each in enumerate(scene.objects, 1)
            if not isinstance(each, Triangles) or len(each.corners)
        ]
        first: dict[int, int] = {}
        for place, each in self.objects:
            first.setdefault(each.material, place)
        self.materials = [
            (_named(scene.materials[index], index, place), scene.materials[index])
            for index, place in first.items()
        ]
        self.lights = [
            (f"light {place}", light)
            for place, light in enumerate(scene.lights, 1)
            if any(light.color)
        ]
        self.lit = any(any(each.diffuse) or any(each.specular) for _, each in self.materials)
        # Paths choose their rays by chance, not by a threshold.
        indirect = scene.settings.indirect
        self.depth = max(scene.settings.depth, indirect.depth if indirect else 0)
        self.threshold = 0.0 if indirect else scene.settings.threshold

    def goes_on(self, material: Material) -> bool:
        """Return whether a mirrored or refracted ray of a material is worth sending.

        Total reflection sends back all the light, whatever the weights.
        """
        greatest = max(*material.reflection, *material.transmission)
        if material.transmits and material.index != 1 and not material.fresnel:
            greatest = 1.0
        return self.depth >= 1 and greatest > self.threshold

    def too_weak(self, material: Material) -> str:
        """Return why the rays of a material are not sent."""
        if self.depth < 1:
            return "but the depth is 0"
        return f"not above the threshold {self.threshold:.3g}"


def _named(material: Material, index: int, place: int) -> str:
    return f"material {repr(material.name) if material.name else index + 1} of object {place}"


def _told(value: Triple) -> str:
    same = value[0] == value[1] == value[2]
    return f"{value[0]:g}" if same else "(" + ", ".join(f"{part:g}" for part in value) + ")"


def _shadows(seen: Seen, found: Found) -> Reason:
    if not seen.lights:
        return Reason(False, "no light shines")
    casting = [words for words, light in seen.lights if light.shadows]
    if not casting:
        return Reason(False, "no light casts shadows")
    if not seen.lit:
        return Reason(False, "no surface answers to light: diffuse and specular are 0")
    alone = _nothing_in_the_way(seen)
    if alone:
        return Reason(False, f"nothing can stand in the way: {alone}")
    return Reason(True, f"{casting[0]} casts shadows")


def _nothing_in_the_way(seen: Seen) -> str | None:
    """Return why no object can shadow what is seen, or None where one may.

    Certain for a plane figure, which every light that it faces sees whole, and for an opaque
    sphere seen from outside. Plane figures of several parts must share a coordinate: others may be
    tilted against each other by rounding. Normals at the corners may face a light that the figure
    does not.
    """
    objects = [each for _, each in seen.objects]
    if len(objects) == 1:
        (alone,) = objects
        if isinstance(alone, Plane | Disc):
            return f"one {type(alone).__name__.lower()} is all there is"
        if isinstance(alone, Triangles) and len(alone.corners) == 1 and alone.normals is None:
            return "one triangle is all there is"
        if isinstance(alone, Sphere) and not seen.scene.materials[alone.material].transmits:
            camera = seen.scene.camera
            away = np.linalg.norm(np.subtract(camera.position, alone.center))
            reach = alone.radius + np.linalg.norm(alone.velocity) + camera.lens_radius
            if away > reach * (1 + 1e-6):
                return "one sphere, seen from outside, is all there is"
    if not any(any(each.velocity) for each in objects):
        for axis in range(3):
            levels = {_level(each, axis) for each in objects}
            if len(levels) == 1 and None not in levels:
                return "all objects lie in one plane"
    return None


def _level(one: Object, axis: int) -> float | None:
    """Return the coordinate that all points of an object share along an axis, or None."""
    if isinstance(one, Triangles) and one.normals is None:
        values = one.corners[:, :, axis]
        return float(values[0, 0]) if (values == values[0, 0]).all() else None
    if isinstance(one, Plane | Disc) and not np.delete(one.normal, axis).any():
        return float((one.point if isinstance(one, Plane) else one.center)[axis])
    return None


def _rays_of(key: str) -> Callable[[Seen, Found], Reason]:
    """Return the rule of mirrored (key ``reflection``) or refracted (``transmission``) rays."""

    def rule(seen: Seen, found: Found) -> Reason:
        some = [(words, each) for words, each in seen.materials if any(getattr(each, key))]
        told = [f"{words} has {key} {_told(getattr(each, key))}" for words, each in some]
        for words, (_, each) in zip(told, some, strict=True):
            if seen.goes_on(each):
                return Reason(True, words)
        if some and key == "transmission" and found["shadows"].called:
            return Reason(True, f"{told[0]}: light passes on its way to other surfaces")
        if some:
            return Reason(False, f"{told[0]}, {seen.too_weak(some[0][1])}")
        return Reason(False, f"no material has {key} above 0")

    return rule


def _dispersion(seen: Seen, found: Found) -> Reason:
    told = "no material that lets light through has an Abbe number and an index other than 1"
    for words, each in seen.materials:
        if each.transmits and each.abbe is not None and each.index != 1:
            if seen.goes_on(each):
                return Reason(True, f"{words} has Abbe number {each.abbe:g}")
            told = f"{words} has Abbe number {each.abbe:g}, {seen.too_weak(each)}"
    return Reason(False, told)


def _specular(seen: Seen, found: Found) -> Reason:
    for words, each in seen.materials:
        if any(each.specular):
            told = f"{words} has specular {_told(each.specular)}"
            return Reason(True, told) if seen.lights else Reason(False, f"{told}, but no light")
    return Reason(False, "no material has specular above 0")


def _texture(seen: Seen, found: Found) -> Reason:
    told = "no material has a texture"
    lit = bool(seen.lights) or seen.scene.settings.indirect is not None
    for words, each in seen.materials:
        if each.texture is None:
            continue
        ambient = np.multiply(each.ambient, seen.scene.ambient).any()
        if ambient or (lit and any(each.diffuse)):
            return Reason(True, f"{words} has {_texture_words(each.texture)}")
        told = f"{words} has {_texture_words(each.texture)}, but no ambient or diffuse light"
    return Reason(False, told)


def _texture_words(texture: Texture) -> str:
    return "a checker" if texture.kind == "checker" else f"the image {texture.source}".rstrip()


def _smooth_normals(seen: Seen, found: Found) -> Reason:
    for place, each in seen.objects:
        if isinstance(each, Triangles) and each.normals is not None:
            name = f" ({each.name})" if each.name else ""
            return Reason(True, f"object {place}{name} has normals at its corners")
    return Reason(False, "no triangle has normals at its corners")


def _soft_shadows(seen: Seen, found: Found) -> Reason:
    # Where nothing stands in its way too: its middle alone lights a surface differently.
    for words, light in seen.lights:
        if light.is_area and seen.lit:
            return Reason(True, f"{words} is a {light.kind}")
        if light.is_area:
            return Reason(False, f"{words} is a {light.kind}, but no surface answers to light")
    return Reason(False, "no light has an area")


def _glossy(seen: Seen, found: Found) -> Reason:
    told = "no material that mirrors or lets through has roughness above 0"
    for words, each in seen.materials:
        sent = (each.reflects and found["reflection"].called) or (
            each.transmits and found["refraction"].called
        )
        if each.roughness > 0 and sent:
            if seen.goes_on(each):
                return Reason(True, f"{words} has roughness {each.roughness:g}")
            told = f"{words} has roughness {each.roughness:g}, {seen.too_weak(each)}"
    return Reason(False, told)


def _depth_of_field(seen: Seen, found: Found) -> Reason:
    radius = seen.scene.camera.lens_radius
    if radius > 0:
        return Reason(True, f"the camera's lens has radius {radius:g}")
    return Reason(False, "the camera is a pinhole")


def _motion_blur(seen: Seen, found: Found) -> Reason:
    for place, each in seen.objects:
        if any(each.velocity):
            told = ", ".join(f"{part:g}" for part in each.velocity)
            return Reason(True, f"object {place} moves by ({told})")
    return Reason(False, "no object moves")


def _antialiasing(seen: Seen, found: Found) -> Reason:
    samples = seen.scene.settings.samples
    return Reason(samples > 1, f"{samples} sample{'s' if samples > 1 else ''} a pixel")


def _indirect(seen: Seen, found: Found) -> Reason:
    if seen.scene.settings.indirect is None:
        return Reason(False, "the scene does not ask for it")
    return Reason(True, f"the scene asks for {seen.scene.settings.indirect.samples} paths a pixel")


RULES: dict[str, Callable[[Seen, Found], Reason]] = {
    "shadows": _shadows,
    "reflection": _rays_of("reflection"),
    "refraction": _rays_of("transmission"),
    "dispersion": _dispersion,
    "specular": _specular,
    "texture": _texture,
    "smooth_normals": _smooth_normals,
    "soft_shadows": _soft_shadows,
    "glossy": _glossy,
    "depth_of_field": _depth_of_field,
    "motion_blur": _motion_blur,
    "antialiasing": _antialiasing,
    "indirect": _indirect,
}
