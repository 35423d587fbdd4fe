"""No acne and no leaks, at any scale and place, of any shape; glass that takes no light away.

Where the only light shines from the camera, all that is seen is lit: the picture with shadows is
the picture without them, bit for bit, and a pixel that differs is acne. Where the camera is inside
a closed model and all lights are outside, the picture is black, and a lit pixel is a leak.
"""

import dataclasses
import itertools

import numpy as np
import pytest
from tracer_scenes import (
    SHAPES,
    TILTED,
    WHITE,
    capped,
    corners,
    lit_at_the_eye,
    mesh,
    nothing_at,
    picture,
    placed,
)

from rtbench.scenes.model import (
    Camera,
    Disc,
    Light,
    Material,
    Plane,
    Scene,
    Settings,
    Sphere,
    Triangles,
)

MODELS = ("icosphere3", "cube", "scanned:4000", "robots:4000", "even:4000", "bunny", "fandisk")
CLOSED_MODELS = ("icosphere3", "cube", "scanned:4000", "fandisk")
CLOSED_SHAPES = ("sphere", "cylinder", "cone", "spheres that touch")
# From above, from close by, from far, along the ground, along a diagonal.
EYES = ((0.9, 0.8, 1.6), (0, 0.3, 1.2), (7.3, 9.1, -5.2), (1.5, -0.49, 0.3), (0.55, 0.55, 0.55))
SCALES = (1e-3, 1.0, 1e5)
# Triangles of "even" pass through each other, and what is seen nearer to such a line than a point
# is known to may start beyond it.
CROSSING = {"even:4000": {"float32": 5e-4, "float64": 0.0}}
# A light that a curved surface sees under a cosine of some roundings is on neither side of it.
GRAZING = 32
WIDE = {"kernel": ("watertight_safe", "moller_trumbore"), "structure": ("bvh", "kd")}


def places(precision, scales=SCALES):
    """Return scales, and offsets as the issue has them: of float32 in sizes of the object."""
    far = 1e5 if precision == "float64" else 4096
    return [
        (scale, TILTED * offset * (1 if precision == "float64" else scale))
        for scale, offset in itertools.product(scales, (0, far))
    ]


def things(name):
    return SHAPES[name] if name in SHAPES else (mesh(name),)


def acne(objects, eye, target, precision, **given):
    """Return how many pixels are lit, and how many of them are in a shadow that nothing casts."""
    shown = [
        picture(lit_at_the_eye(objects, eye, target, shadows=shadows), precision, **given)
        for shadows in (True, False)
    ]
    assert shown[0].rays["shadow"] > 0 and shown[1].rays["shadow"] == 0
    lit = (shown[1].pixels > 0).any(axis=2)
    return int(lit.sum()), int((shown[0].pixels != shown[1].pixels).any(axis=2).sum())


def acne_of(name, precision, eyes=EYES, scales=SCALES, **given):
    """Return the same of a model or shapes, over scales, offsets and cameras."""
    found = np.zeros(2, int)
    for scale, move in places(precision, scales):
        objects = placed(things(name), scale, move)
        for eye in eyes:
            found += acne(objects, np.array(eye) * scale + move, move, precision, **given)
    return found


def assert_clean(name, precision, **given):
    lit, dark = acne_of(name, precision, **given)
    assert lit > 1000
    assert dark <= lit * CROSSING.get(name, {}).get(precision, 0.0), f"{dark} of {lit} pixels"


def leaks(name, precision, scales=SCALES, **given):
    """Return the brightest of all pixels seen from inside, and how many points were asked."""
    inside = np.array((-0.25, 0.001, 0.01) if name == "spheres that touch" else (0.01, 0.013, 0.02))
    brightest, asked = 0.0, 0
    for scale, move in places(precision, scales):
        objects = placed(things(name), scale, move)
        eye = inside * scale + move
        for way in ((0.3, 0.2, 0.5), (-1, 0.1, 0.2), (0.1, -1, 0.1)):
            seen = lit_at_the_eye(objects, eye, eye + np.array(way) * scale, angle=100)
            around = ((2, 1.0, 1.5), (-0.8, 0.3, -1.2), (0.1, -3, 0.2), (0.01, 0.7, 0.02))
            lights = tuple(Light(position=tuple(np.array(p) * scale + move)) for p in around)
            shown = picture(dataclasses.replace(seen, lights=lights), precision, **given)
            brightest = max(brightest, float(shown.pixels.max()))
            # Every ray hits: each asks the lights that are on its side.
            asked += shown.rays["shadow"] + shown.saved["light_behind"] == 4 * 96 * 96
    assert asked == 3 * len(places(precision, scales))
    return brightest


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", ["icosphere3", "cube", "scanned:4000", "even:4000", "fandisk"])
def test_no_acne_on_models(name, precision):
    assert_clean(name, precision, eyes=EYES[::2])


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", SHAPES)
def test_no_acne_on_shapes(name, precision):
    assert_clean(name, precision, scales=(1e-3, 1e5))


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", [*CLOSED_SHAPES, "icosphere3", "cube", "fandisk"])
def test_no_light_leaks_in(name, precision):
    assert leaks(name, precision, scales=(1e-3, 1e5)) <= GRAZING * np.finfo(precision).eps


@pytest.mark.full
@pytest.mark.parametrize(
    ("kernel", "structure"), list(itertools.product(*WIDE.values())), ids="-".join
)
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_no_acne_and_no_leaks_with_any_kernel_and_tree(precision, kernel, structure):
    """Möller and Trumbore's test may leak along edges: there only acne is counted."""
    given = {"kernel": kernel, "structure": structure}
    for name in (*MODELS, *SHAPES):
        assert_clean(name, precision, **given)
    if kernel == "watertight_safe":
        for name in (*CLOSED_MODELS, *CLOSED_SHAPES):
            assert leaks(name, precision, **given) <= GRAZING * np.finfo(precision).eps, name


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_grazing_light_and_light_at_corners(precision):
    """A light in a cube's own edges, corners and sides, up to roundings of them, leaks nowhere."""
    cube = mesh("cube")
    for scale, move in places(precision, (1e-3, 1e5)):
        objects = placed((cube,), scale, move)
        # As far as precision and file tell what is outside.
        step = 64 * np.finfo(precision).eps + 64 * np.finfo(float).eps * np.abs(move).max() / scale
        for at in ((0.5, 0.5, 0.5), (0.5, 0.5, 0.1), (0.5, 0.1, 0.2)):
            at = np.array(at) * (1 + step) * scale + move
            eye = np.array((0.1, -0.2, 0.05)) * scale + move
            seen = lit_at_the_eye(objects, eye, at, angle=120)
            seen = dataclasses.replace(seen, lights=(Light(position=tuple(at)),))
            assert picture(seen, precision).pixels.max() == 0
        # From outside, along a side of the cube: what it lights, it lights without a gap.
        eye = np.array((0.9, 0.8, 1.6)) * scale + move
        for height in (0.5 + 1e-4, 0.51, 0.6):
            at = np.array((0.1, height, -0.2)) * scale + move
            seen = lit_at_the_eye(objects, eye, move)
            lit, free = (
                picture(
                    dataclasses.replace(seen, lights=(Light(position=tuple(at), shadows=shadows),)),
                    precision,
                ).pixels
                for shadows in (True, False)
            )
            # A convex body casts no shadow on itself where it faces the light.
            assert (free > 0).any() and (lit == free).all()


def dyadic(name):
    """Return triangles whose coordinates are multiples of 2^-20."""
    return Triangles(corners=np.round(corners(name) * 2**20) / 2**20)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_an_offset_that_the_file_resolves_costs_nothing(precision):
    """Whatever the precision: positions are made local before they are rounded to it."""
    middle = dyadic("icosphere3"), Sphere(center=(0.75, 0.25, 0.5), radius=0.25)
    middle += (Plane(point=(0, -0.5, 0)), Disc(center=(0, 0.75, 0), radius=0.25))
    middle += capped((-0.75, -0.25, 0), (-0.75, 0.5, 0.25), 0.125)
    shown = []
    for offset in (0.0, 1.0, 4096.0, 2.0**20, 2.0**30):
        move = np.array((offset, -offset, offset / 2))
        seen = lit_at_the_eye(placed(middle, 1.0, move), np.array((1, 1.5, 2)) + move, move)
        light = Light(position=tuple(np.array((2, 3, 1)) + move))
        shown.append(picture(dataclasses.replace(seen, lights=(light,)), precision).pixels)
    assert len(np.unique(shown[0])) > 1000
    # The middle of the scene, which positions are taken from, is itself rounded once.
    close = 0.0 if precision == "float32" else 16 * np.finfo(precision).eps
    for other in shown[1:]:
        assert np.abs(other - shown[0]).max() <= close


@pytest.mark.parametrize("name", ["icosphere3", "cube", "sphere", "cylinder", "disc"])
def test_an_object_far_from_the_middle_of_its_scene(name):
    """Its numbers are coarser there: in float32 4096 sizes away, a size is 2000 roundings."""
    for precision, far in (("float32", 4096.0), ("float64", 1e7)):
        move = TILTED * -far
        objects = (*placed(things(name), 1.0, move), *placed(things(name), 1.0, -move))
        for eye in EYES[:2]:
            lit, dark = acne(objects, np.array(eye) + move, move, precision)
            assert lit > 500 and dark == 0


# Of glass


CLEAR = Material(diffuse=(0, 0, 0), transmission=(1, 1, 1), index=1.0)
CRYSTAL = Material(
    diffuse=(0, 0, 0), reflection=(1, 1, 1), transmission=(1, 1, 1), index=1.5, fresnel=True
)


def behind_glass(objects, scale, move, size=96):
    """Return a scene of patches that shine by themselves, with objects of clear glass before."""
    colours = (CLEAR, *(Material(emission=c) for c in ((1, 0, 0), (0, 1, 0), (0, 0, 1))))
    patches = (
        Disc(center=(0, 0, -1.5), normal=(0.1, 0.05, 1), radius=0.7, material=1),
        Sphere(center=(0.3, 0.1, -1.3), radius=0.2, material=2),
        Disc(center=(0, 0, -2.0), normal=(0, 0, 1), radius=1.2, material=3),
    )
    eye = np.array((0.11, 0.23, 2.1)) * scale + move
    return Scene(
        "clear",
        Camera(tuple(eye), tuple(move), (0, 1, 0), 40, size, size),
        (),
        colours,
        (*placed((*objects, *patches), scale, move), nothing_at(placed(patches, scale, move))),
        background=(0.25, 0.25, 0.25),
        settings=Settings(depth=20, threshold=0.0),
    )


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize(
    "name", ["icosphere3", "cube", "sphere", "cylinder", "cone", "scanned:4000", "fandisk"]
)
def test_clear_glass_of_index_1_is_not_seen(name, precision):
    """And each ray that enters also leaves: the refracted ones are even, of a convex body two."""
    convex = name in ("icosphere3", "cube", "sphere", "cylinder", "cone")
    for scale, move in places(precision):
        with_it = picture(behind_glass(things(name), scale, move), precision)
        without = picture(behind_glass((), scale, move), precision)
        different = (with_it.pixels != without.pixels).any(axis=2).sum()
        assert different == 0
        assert with_it.saved["depth"] == 0
        refracted = with_it.rays["refraction"]
        assert refracted > 1000 and refracted % 2 == 0
        if convex:
            alone = dataclasses.replace(behind_glass(things(name), scale, move), objects=())
            opaque = placed(things(name), scale, move)
            seen = dataclasses.replace(
                alone,
                materials=(Material(emission=(1, 1, 1)),),
                objects=(*opaque, nothing_at(opaque)),
                background=(0, 0, 0),
            )
            assert refracted == 2 * int(picture(seen, precision).pixels[..., 0].sum())


def crystal(objects, eye, depth, size=64, angle=40.0):
    """Return a white world with crystal in it."""
    return Scene(
        "crystal",
        Camera(tuple(eye), (0, 0, 0), (0, 1, 0), angle, size, size),
        (),
        (CRYSTAL,),
        (*objects, nothing_at(objects)),
        background=(1, 1, 1),
        settings=Settings(depth=depth, threshold=0.0),
    )


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("depth", [1, 2, 3, 8])
def test_a_crystal_ball_in_a_white_world_loses_what_the_depth_cuts_off(depth, precision):
    """Of a ray that entered, R stays inside at each bounce: (1 - R) R^(depth - 1) is cut off."""
    size, distance, angle = 64, 3.0, 40.0
    shown = picture(crystal((Sphere(radius=1.0),), (0, 0, distance), depth), precision).pixels
    half = np.tan(np.radians(angle / 2))
    place = ((np.arange(size) + 0.5) / size * 2 - 1) * half
    across = np.hypot(*np.meshgrid(place, place))
    impact = distance * across / np.sqrt(1 + across**2)  # of a ray past the ball's middle
    inside = impact < 0.999
    sine = np.where(inside, impact, 0.0)
    cos_in, cos_out = np.sqrt(1 - sine**2), np.sqrt(1 - (sine / 1.5) ** 2)
    parallel = (1.5 * cos_in - cos_out) / (1.5 * cos_in + cos_out)
    across_it = (cos_in - 1.5 * cos_out) / (cos_in + 1.5 * cos_out)
    returned = (parallel**2 + across_it**2) / 2
    expected = 1 - (1 - returned) * returned ** (depth - 1)
    # 100 roundings, times how steeply Fresnel's equations rise at the rim.
    allowed = 100 * np.finfo(precision).eps / (1 - impact[inside])
    for channel in range(3):
        assert (abs(shown[..., channel] - expected)[inside] < allowed).all()
    assert (shown[impact > 1.001] == 1).all()
    assert shown.max() <= 1 + 16 * np.finfo(precision).eps


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", ["icosphere3", "cube", "cylinder"])
def test_crystal_gives_back_no_more_than_it_gets(name, precision):
    """More depth brings more of it back; what it lacks is in rays that were cut off."""
    before = 0.0
    eps = np.finfo(precision).eps
    for depth in (1, 3, 6, 10):
        shown = picture(crystal(things(name), (0.7, 0.9, 1.3), depth, 40), precision)
        assert shown.pixels.max() <= 1 + 64 * eps
        assert (shown.pixels >= before - 64 * eps).all()
        before = shown.pixels
        dim = (before < 1 - 64 * eps).any(axis=2).sum()
        assert dim <= shown.saved["depth"]
        assert shown.saved["depth"] > 0 or dim == 0


def test_light_through_sheets_of_glass_is_weighted_by_each():
    """k sheets of transmission t leave t^k of the light; a closed body is two sheets."""
    t = (0.5, 0.25, 0.75)
    glass = Material(diffuse=(0, 0, 0), transmission=t)
    half = Material(diffuse=(0, 0, 0), transmission=(0.5, 0.5, 0.5))
    floor = Plane(point=(0, 0, 0), normal=(0, 1, 0))
    body = mesh("cube", material=2)
    for precision, sheets, closed in itertools.product(
        ("float32", "float64"), range(4), (None, body, Sphere(radius=0.4, material=2))
    ):
        over = tuple(
            Disc(center=(0, 1.0 + k, 0), normal=(0.1 * k, 1, 0), radius=50.0, material=1)
            for k in range(sheets)
        )
        if closed is not None:
            over += placed((closed,), 1.0, (0, 7.0, 0))
        # From below the sheets, a few pixels in the light's very foot point.
        seen = Scene(
            "sheets",
            Camera((0, 0.5, 0.0), (0, 0, 0), (0, 0, 1), 0.01, 4, 4),
            (Light(position=(0, 10, 0)),),
            (WHITE, glass, half),
            (floor, *over, nothing_at((floor,))),
        )
        shown = picture(seen, precision)
        expected = np.array(t) ** sheets * (0.25 if closed is not None else 1.0)
        # The cosine to the light, at most 1e-9 from 1 here, is rounded too.
        np.testing.assert_allclose(
            shown.pixels,
            np.broadcast_to(expected, (4, 4, 3)),
            rtol=1e-6 if precision == "float32" else 1e-9,
        )


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("shell", ["sphere", "icosphere3"])
def test_an_opaque_ball_inside_clear_glass(shell, precision):
    """Rays to the eye and to the light cross the glass once each: a quarter, without acne."""
    half = Material(diffuse=(0, 0, 0), transmission=(0.5, 0.5, 0.5))
    (around,) = things(shell)
    around = dataclasses.replace(around, material=1)
    for scale, move in places(precision):
        ball = placed((Sphere(radius=0.3),), scale, move)
        eye = np.array((0.9, 0.8, 1.6)) * scale + move
        bare = lit_at_the_eye(ball, eye, move)
        cased = dataclasses.replace(
            bare,
            materials=(WHITE, half),
            objects=(*bare.objects, *placed((around,), scale, move)),
            settings=Settings(depth=4, threshold=0.0),
        )
        expected = picture(bare, precision).pixels
        shown = picture(cased, precision)
        seen = expected[..., 0] > 0
        assert seen.sum() > 500
        # Where light and eye graze the ball, roundings are not small beside the cosine.
        close = 200 * np.finfo(precision).eps
        assert np.abs(shown.pixels - expected / 4)[seen].max() < close
        assert (shown.pixels[~seen] <= close).all()
        assert shown.saved["depth"] == 0
