"""Which effects a scene calls for: read off the scene, each with what calls for it.

An effect counts only where it can change a pixel: materials that no object uses, lights without
colour and rays too weak to be shot call for nothing. Where that is not certain, it counts: whatever
is not called for changes no bit of the picture when it is compiled in all the same. Lights,
objects and materials are numbered from 1 in the words, in the order of the scene.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from rtbench.errors import RtbenchError, unknown
from rtbench.scenes.model import Scene
from rtbench.tracer.calls import RULES, Reason, Seen


@dataclass(frozen=True)
class Effect:
    """What an effect is.

    Attributes
    ----------
    title : str
        For people.
    simulates : str
        What of the real thing the tracer imitates, and how.
    source : str
        Author, year, and section where there is one.
    neutral : str
        What it does that is compiled in without being called for: nothing that shows.
    needs : tuple of str
        Where all of these are left out, so is this; forced, it brings the first with it.
    """

    title: str
    simulates: str
    source: str
    neutral: str
    needs: tuple[str, ...] = ()


DESCRIBED: dict[str, Effect] = {
    "shadows": Effect(
        "shadows",
        "a light counts at a point where nothing stands between: one ray to each light",
        "Appel 1968; Whitted 1980",
        "lights that cast none send no shadow rays; such as are sent meet nothing",
    ),
    "reflection": Effect(
        "reflection",
        "mirrors: a ray goes on at the angle that it came in, and what it brings is tinted",
        "Whitted 1980",
        "reflection 0: no mirrored ray is sent",
    ),
    "refraction": Effect(
        "refraction",
        "light through surfaces: bent by Snell's law, parted by Fresnel's equations where the "
        "material asks for it, mirrored where it cannot leave; shadow rays pass without bending",
        "Whitted 1980; Born & Wolf 1999, section 1.5",
        "transmission 0: no refracted ray is sent, and shadow rays end at the first surface",
    ),
    "dispersion": Effect(
        "dispersion",
        "the index of refraction falls with the wavelength, by the Abbe number: glass parts them",
        "Cauchy 1836; Thomas 1986",
        "no Abbe number: one index for all colours",
        ("refraction",),
    ),
    "specular": Effect(
        "specular highlight",
        "the lights' own blurred mirror image: a power of the cosine to the mirrored ray (Phong) "
        "or between normal and half-way vector (Blinn)",
        "Phong 1975; Blinn 1977",
        "specular 0: nothing is added",
    ),
    "texture": Effect(
        "texture",
        "ambient and diffuse colour from an image over (u, v), or from a checker in space",
        "Catmull 1974; Blinn & Newell 1976; Peachey 1985",
        "no texture: the colours are taken times 1",
    ),
    "smooth_normals": Effect(
        "smooth normals",
        "a curved surface on flat triangles: normals at the corners, blended linearly",
        "Phong 1975",
        "no normals at the corners: each triangle has its own all over",
    ),
    "soft_shadows": Effect(
        "soft shadows",
        "lights with an area: a ray to a random point in each cell of a grid on them; left out, "
        "they shine from their middle",
        "Cook, Porter & Carpenter 1984; Šilhavý 2010, 2.2.1",
        "every light is a point: one shadow ray, to its middle",
        ("shadows",),
    ),
    "glossy": Effect(
        "glossy rays",
        "rough mirrors and frosted glass: the normal of a random small facet turns the ray",
        "Cook, Porter & Carpenter 1984; Walter et al. 2007",
        "roughness 0: mirrored and refracted rays go the one way",
        ("reflection", "refraction"),
    ),
    "depth_of_field": Effect(
        "depth of field",
        "a thin lens: rays leave from random points of it and meet where it is sharp",
        "Potmesil & Chakravarty 1981; Cook, Porter & Carpenter 1984",
        "lens radius 0: every ray leaves from the camera's position",
    ),
    "motion_blur": Effect(
        "motion blur",
        "an open shutter: each primary ray and its descendants have a random time",
        "Cook, Porter & Carpenter 1984",
        "velocity 0: every object stays where it is",
    ),
    "antialiasing": Effect(
        "anti-aliasing",
        "the mean over a pixel: a ray at random in each cell of a grid on it",
        "Cook 1986",
        "one sample: one ray, through the middle of the pixel",
    ),
    "indirect": Effect(
        "indirect light",
        "light by way of other surfaces: paths go on from diffuse ones, at random, with a ray to "
        "a light at each bounce, until Russian roulette ends them",
        "Kajiya 1986; Arvo & Kirk 1990",
        "not asked for: no path goes on from a diffuse surface",
    ),
}
EFFECTS: dict[str, str] = {key: effect.title for key, effect in DESCRIBED.items()}
neutral: dict[str, str] = {key: effect.neutral for key, effect in DESCRIBED.items()}


def called_for(scene: Scene, without: Iterable[str] = ()) -> dict[str, str | None]:
    """Return what in a scene calls for each effect.

    Parameters
    ----------
    scene : Scene
        Depth, threshold and samples are those of its settings.
    without : iterable of str
        Effects that are left out, and with them what needs them.

    Returns
    -------
    dict of str to (str or None)
        In the order of `EFFECTS`; None: nothing does.
    """
    found = reasons(scene, without)
    return {key: reason.why if reason.called else None for key, reason in found.items()}


def reasons(scene: Scene, without: Iterable[str] = ()) -> dict[str, Reason]:
    """Return for each effect whether a scene calls for it, and why or why not; see `called_for`."""
    left_out = set(without)
    seen = Seen(scene)
    found: dict[str, Reason] = {}
    for key in EFFECTS:  # what an effect needs comes before it
        if key in left_out:
            found[key] = Reason(False, "left out")
            continue
        needs = DESCRIBED[key].needs
        if needs and left_out.issuperset(needs):
            bases = " or ".join(EFFECTS[base] for base in needs)
            found[key] = Reason(False, f"needs {bases}, left out")
            continue
        found[key] = RULES[key](seen, found)
    return found


def with_settings(
    scene: Scene,
    depth: int | None = None,
    samples: int | None = None,
    threshold: float | None = None,
) -> Scene:
    """Return a scene with some of its settings replaced; None: the scene's own.

    Raises
    ------
    SceneError
        For values that settings cannot have.
    """
    given = {"depth": depth, "samples": samples, "threshold": threshold}
    changed = {key: value for key, value in given.items() if value is not None}
    return replace(scene, settings=replace(scene.settings, **changed)) if changed else scene


def compiled(
    scene: Scene, without: Iterable[str] = (), force: Iterable[str] = ()
) -> dict[str, bool]:
    """Return which effects the tracer of a scene holds the code of.

    Parameters
    ----------
    scene : Scene
    without : iterable of str
        Left out though the scene calls for them; what needs them goes too.
    force : iterable of str
        Compiled in though it does not, with what they need; they then are neutral.

    Returns
    -------
    dict of str to bool
        In the order of `EFFECTS`.

    Raises
    ------
    RtbenchError
        For an unknown name, one that is both left out and forced, and one that is forced while
        what it needs is left out.
    """
    without, force = tuple(without), tuple(force)
    for key in (*without, *force):
        if key not in EFFECTS:
            raise RtbenchError(unknown("effect", key, EFFECTS))
    flags = {key: reason.called for key, reason in reasons(scene, without).items()}
    for key in force:
        if key in without:
            raise RtbenchError(f"effect {key!r} cannot be both left out and forced")
        flags[key] = True
    for key in force:
        needs = DESCRIBED[key].needs
        if needs and not any(flags[base] for base in needs):
            possible = [base for base in needs if base not in without]
            if not possible:
                bases = " or ".join(map(repr, needs))
                raise RtbenchError(f"effect {key!r} needs {bases}, left out: it cannot be forced")
            flags[possible[0]] = True
    return flags
