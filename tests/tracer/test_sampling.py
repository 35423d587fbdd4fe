"""The generator against big integers and published numbers; what is drawn against densities."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest
from compiled_functions import PRECISIONS, Compiled, plain
from scipy import stats

from rtbench.tracer import sampling

KINDS = {
    "hashed": "u > u",
    "seed_of": "uu > u",
    "uniform": "uu > r",
    "on_disc": "rr > rr",
    "frame": "rrr > rrrrrr",
    "cosine_direction": "rrrrr > rrr",
    "facet": "rrrrrrrrr > rrr",
    "on_rectangle": "rrrrrrrrrrr > rrr",
    "on_light_sphere": "rrrrrrrrr > rrr",
}
BITS = {"float32": 24, "float64": 53}
WHOLE = 2**64
GOLDEN = 0x9E3779B97F4A7C15
FIRST, SECOND = 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
COUNT = 100_000
UNLIKELY = 1e-4  # seeds are fixed: what passes once passes always


@functools.cache
def compiled(precision: str) -> Compiled:
    return Compiled(sampling, KINDS, precision)


def mixed(x: int) -> int:
    """SplitMix64's finaliser in integers of any size."""
    x = (x ^ (x >> 30)) * FIRST % WHOLE
    x = (x ^ (x >> 27)) * SECOND % WHOLE
    return x ^ (x >> 31)


def unmixed(y: int) -> int:
    """What SplitMix64's finaliser makes ``y`` of."""

    def unshifted(y: int, by: int) -> int:
        x = y
        for _ in range(64 // by + 1):
            x = y ^ (x >> by)
        return x

    y = unshifted(y, 31) * pow(SECOND, -1, WHOLE) % WHOLE
    y = unshifted(y, 27) * pow(FIRST, -1, WHOLE) % WHOLE
    return unshifted(y, 30)


def wholes(n: int, seed: int = 1) -> np.ndarray:
    drawn = np.random.default_rng(seed).integers(0, WHOLE, n, dtype=np.uint64)
    ends = [0, 1, 2**31, 2**32 - 1, 2**32, 2**63 - 1, 2**63, WHOLE - 1]
    return np.concatenate([np.array(ends, np.uint64), drawn])


def draws(n: int, dimensions: int, precision: str = "float64", pixel: int = 77) -> np.ndarray:
    """Return ``dimensions`` rows of numbers, one for each sample of a pixel."""
    at = compiled(precision)
    seeds = at.seed_of(np.uint64(pixel), np.arange(n, dtype=np.uint64))
    return at.uniform(seeds, np.arange(dimensions, dtype=np.uint64)[:, None])


def chance(*cells: np.ndarray, bins: int) -> float:
    """Return how likely numbers from 0 to 1 are spread as unevenly as these, or more."""
    where = tuple(np.minimum((each * bins).astype(int), bins - 1) for each in cells)
    counts = np.bincount(
        np.ravel_multi_index(where, [bins] * len(cells)), minlength=bins ** len(cells)
    )
    return stats.chisquare(counts).pvalue


def unit(n: int, seed: int) -> np.ndarray:
    """Return unit vectors as rows, the poles among them."""
    drawn = np.random.default_rng(seed).normal(size=(n, 3))
    ends = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [1, 0, -0.0], [1e-9, 0, -1]]
    found = np.concatenate([ends, drawn])
    return (found / np.linalg.norm(found, axis=1)[:, None]).T


# The published first outputs: of 1234567 as on Rosetta Code, of 0 as in Java's SplittableRandom.
@pytest.mark.parametrize(
    ("seed", "outputs"),
    [
        (
            1234567,
            [
                6457827717110365317,
                3203168211198807973,
                9817491932198370423,
                4593380528125082431,
                16408922859458223821,
            ],
        ),
        (0, [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F]),
    ],
)
@pytest.mark.parametrize("precision", PRECISIONS)
def test_it_is_splitmix64(seed, outputs, precision):
    """Dimension k of a seed is output k of the published generator."""
    dimensions = np.arange(len(outputs), dtype=np.uint64)
    found = compiled(precision).uniform(np.uint64(seed), dimensions)
    bits = BITS[precision]
    assert [int(float(x) * 2**bits) for x in found] == [x >> (64 - bits) for x in outputs]


@pytest.mark.parametrize("precision", PRECISIONS)
def test_whole_numbers_are_those_of_big_integers(precision):
    """numba widens and turns whole numbers into floats where it likes: not here."""
    at, a, b = compiled(precision), wholes(2000), wholes(2000, seed=2)[::-1]
    assert at.hashed(a).tolist() == [mixed(int(x)) for x in a]
    bits = BITS[precision]
    expected = [mixed((int(x) + (int(y) + 1) * GOLDEN) % WHOLE) for x, y in zip(a, b, strict=True)]
    found = at.uniform(a, b)
    assert found.dtype == precision
    assert [int(float(x) * 2**bits) for x in found] == [x >> (64 - bits) for x in expected]
    a, b = a >> np.uint64(32), b >> np.uint64(32)
    assert at.seed_of(a, b).tolist() == [
        mixed(int(x) * 2**32 + int(y)) for x, y in zip(a, b, strict=True)
    ]


def test_plain_functions_give_the_same_numbers():
    """Without numba the sources compute the same, to the bit."""
    at, a, b = compiled("float64"), wholes(200), wholes(200, seed=2)[::-1]
    for name in ("seed_of", "uniform"):
        np.testing.assert_array_equal(getattr(at, name)(a, b), plain(getattr(sampling, name), a, b))
    np.testing.assert_array_equal(at.hashed(a), plain(sampling.hashed, a))


@pytest.mark.parametrize("precision", PRECISIONS)
def test_uniform_stays_below_one(precision):
    """Even where all bits are ones: the seed of that number is found by going backwards."""
    for output, expected in ((WHOLE - 1, 1 - 0.5 ** BITS[precision]), (0, 0.0)):
        seed = (unmixed(output) - GOLDEN) % WHOLE
        assert mixed((seed + GOLDEN) % WHOLE) == output
        assert compiled(precision).uniform(np.uint64(seed), np.uint64(0)) == expected


@pytest.mark.parametrize("precision", PRECISIONS)
def test_numbers_are_uniform_and_independent(precision):
    """Alone, and in pairs: of dimensions near and far, of samples and pixels."""
    at = compiled(precision)
    samples = np.arange(COUNT, dtype=np.uint64)
    seeds = at.seed_of(np.uint64(12345), samples)
    first = at.uniform(seeds, np.uint64(0))
    assert chance(first, bins=256) > UNLIKELY
    assert chance(first * 4096 % 1, bins=256) > UNLIKELY  # later bits, too
    others = {int(sampling.DIMENSIONS[k]) + j for k in KEYS for j in (0, 1, 7, 2**32)}
    for dimension in sorted(others - {0} | {1, 2}):
        assert chance(first, at.uniform(seeds, np.uint64(dimension)), bins=16) > UNLIKELY
    pixels = at.seed_of(samples, np.uint64(0))
    of_pixels = at.uniform(pixels, np.uint64(0))
    assert chance(of_pixels, bins=256) > UNLIKELY
    assert chance(of_pixels[:-1], of_pixels[1:], bins=16) > UNLIKELY
    assert chance(first[:-1], first[1:], bins=16) > UNLIKELY


KEYS = tuple(sampling.DIMENSIONS)


def test_effects_draw_from_blocks_of_their_own():
    """However many numbers one draws; a module's constants are the same numbers."""
    starts = sorted(int(x) for x in sampling.DIMENSIONS.values())
    assert len(set(starts)) == len(KEYS)
    assert min(b - a for a, b in itertools.pairwise(starts)) >= 2**48
    for precision in PRECISIONS:
        told = sampling.constants(precision)
        read = {"np": np, "REAL": getattr(np, precision)}
        for name, value in sampling.DIMENSIONS.items():
            assert eval(told[f"DIMENSION_{name.upper()}"], read) == value
        unit = eval(told["UNIFORM_UNIT"], read)
        assert unit.dtype == precision and float(unit) == 0.5 ** BITS[precision]


@pytest.mark.parametrize("precision", PRECISIONS)
def test_points_of_the_disc(precision):
    """All area alike; the middle stays the middle, squares about it become circles."""
    u, v = draws(COUNT, 2, precision).astype(np.float64)
    x, y = (each.astype(np.float64) for each in compiled(precision).on_disc(u, v))
    radius = np.hypot(x, y)
    eps = np.finfo(precision).eps
    np.testing.assert_allclose(
        radius, np.maximum(abs(2 * u - 1), abs(2 * v - 1)), rtol=4 * eps, atol=eps
    )
    turn = np.arctan2(y, x) / (2 * np.pi) % 1
    assert chance(np.minimum(radius**2, 1), turn, bins=16) > UNLIKELY
    assert compiled(precision).on_disc(0.5, 0.5) == (0, 0)
    corners = compiled(precision).on_disc([0, 1, 0, 1, 0.5, 1], [0, 0, 1, 1, 0, 0.5])
    half = np.sqrt(0.5)
    expected = [[-half, half, -half, half, 0, 1], [-half, -half, half, half, -1, 0]]
    np.testing.assert_allclose(corners, expected, atol=2 * eps)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_frames_are_orthonormal(precision):
    """At both poles and beside them too, and right-handed."""
    n = unit(5000, 3).astype(precision)
    found = np.array(compiled(precision).frame(*n), np.float64)
    n = n.astype(np.float64)
    t, b = found[:3], found[3:]
    eps = np.finfo(precision).eps
    products = [(t * t).sum(0) - 1, (b * b).sum(0) - 1, (t * b).sum(0), (t * n).sum(0)]
    np.testing.assert_allclose(products, 0, atol=8 * eps)
    np.testing.assert_allclose(np.cross(t.T, b.T).T, n, atol=8 * eps)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_directions_about_a_normal(precision):
    """The square of a cosine density's sine is uniform, so its mean cosine is 2/3."""
    n = np.array([0.48, -0.6, 0.64])
    u, v = draws(COUNT, 2, precision)
    found = np.array(compiled(precision).cosine_direction(*n, u, v), np.float64)
    eps = np.finfo(precision).eps
    np.testing.assert_allclose((found**2).sum(0), 1, atol=16 * eps)
    cosine = n @ found
    assert cosine.min() > -8 * eps
    error = np.sqrt(1 / 2 - 4 / 9) / np.sqrt(COUNT)
    assert abs(cosine.mean() - 2 / 3) < 4 * error
    t = np.cross(n, [1.0, 0, 0])
    t /= np.linalg.norm(t)
    turn = np.arctan2(np.cross(n, t) @ found, t @ found) / (2 * np.pi) % 1
    assert chance(np.clip(1 - cosine**2, 0, 1), turn, bins=16) > UNLIKELY


@pytest.mark.parametrize("precision", PRECISIONS)
def test_smooth_surfaces_keep_their_normal(precision):
    """Alpha 0: bit for bit, whatever is drawn and wherever one looks from."""
    n, v = unit(500, 4).astype(precision), unit(500, 5).astype(precision)
    s, t = draws(n.shape[1], 2, precision)
    n[:, -1] = -0.0
    found = np.array(compiled(precision).facet(*n, *v, 0.0, s, t), precision)
    assert found.tobytes() == n.tobytes()


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_facets_seen_from_above(alpha, precision):
    """There tan^2 / (tan^2 + alpha^2) is uniform: the integral of GGX times the cosine."""
    n = np.array([0.48, -0.6, 0.64])
    s, t = draws(COUNT, 2, precision)
    found = np.array(compiled(precision).facet(*n, *n, alpha, s, t), np.float64)
    np.testing.assert_allclose((found**2).sum(0), 1, atol=16 * np.finfo(precision).eps)
    cosine = n @ found
    sine = np.linalg.norm(np.cross(n, found.T), axis=1)
    part = (sine / cosine) ** 2 / ((sine / cosine) ** 2 + alpha**2)
    assert cosine.min() > 0 and chance(part, bins=64) > UNLIKELY


@pytest.mark.parametrize("alpha", [0.1, 0.5])
@pytest.mark.parametrize("slant", [0.9, 0.5, 0.1])
def test_facets_seen_aslant(slant, alpha):
    """Their spread is Heitz's D_v = G1 max(v . m, 0) D / (v . n), integrated numerically."""
    view = np.array([np.sqrt(1 - slant**2), 0.0, slant])
    s, t = draws(COUNT, 2)
    x, y, z = compiled("float64").facet(0, 0, 1, *view, alpha, s, t)
    assert (view @ (x, y, z)).min() > 0
    # Seen from above, q^2 = alpha^2 / (tan^2 + alpha^2) is uniform; by q the density stays tame.
    q = alpha / np.sqrt((x * x + y * y) / (z * z) + alpha**2)
    turn = np.arctan2(y, x) / (2 * np.pi) % 1
    counts, _, _ = np.histogram2d(q, turn, 12, [[0, 1], [0, 1]])
    fine = 100
    q = ((np.arange(12 * fine) + 0.5) / (12 * fine))[:, None]
    turn = 2 * np.pi * q.T
    tan = alpha * np.sqrt(1 / q**2 - 1)
    shown = np.maximum(0, view[0] * tan * np.cos(turn) + view[2])  # v . m over cos
    g1 = 2 / (1 + np.sqrt(1 + alpha**2 * (1 - slant**2) / slant**2))
    density = 2 * q * g1 * shown / slant  # D cos d(solid angle) is 2 q dq d(turn) / (2 pi)
    assert density.mean() == pytest.approx(1, abs=1e-4)
    expected = density.reshape(12, fine, 12, fine).sum((1, 3))
    expected *= COUNT / expected.sum()
    many = expected > 5
    few = [counts[~many].sum(), expected[~many].sum()]
    got, wanted = np.append(counts[many], few[0]), np.append(expected[many], few[1])
    wanted, got = (wanted, got) if few[1] > 5 else (wanted[:-1], got[:-1])
    chi2 = ((got - wanted) ** 2 / wanted).sum()
    assert stats.chi2.sf(chi2, len(got) - 1) > UNLIKELY


@pytest.mark.parametrize("precision", PRECISIONS)
def test_facets_of_any_view_are_unit_vectors(precision):
    """Along the surface, from behind it, straight at it, with the least alpha and the greatest."""
    n, v = unit(3000, 6), unit(3000, 7)[:, ::-1]
    v[:, :100] = n[:, :100]
    v[:, 100:200] = -n[:, 100:200]
    s, t = draws(n.shape[1], 2, precision)
    s[:500:7], t[:500:5] = 0, np.nextafter(np.dtype(precision).type(1), 0)
    t[:500:6] = 0
    for alpha in (float(np.finfo(precision).smallest_subnormal), 1e-6, 0.5, 1.0):
        found = np.array(compiled(precision).facet(*n, *v, alpha, s, t), np.float64)
        np.testing.assert_allclose((found**2).sum(0), 1, atol=16 * np.finfo(precision).eps)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_points_of_rectangles(precision):
    """Corners and middle are where they are; without sides there is the middle alone."""
    at = compiled(precision)
    middle, u, v = (1.0, 2.0, 3.0), (4.0, 0.0, 0.0), (0.0, 0.0, -2.0)
    found = np.array(at.on_rectangle(*middle, *u, *v, [0, 1, 0, 1, 0.5], [0, 0, 1, 1, 0.5]))
    expected = [[-1, 3, -1, 3, 1], [2] * 5, [4, 4, 2, 2, 3]]
    np.testing.assert_array_equal(found, expected)
    p = np.random.default_rng(8).normal(size=(3, 1000)).astype(precision)
    s, t = draws(1000, 2, precision)
    found = np.array(at.on_rectangle(*p, *[0.0] * 6, s, t), precision)
    assert found.tobytes() == p.tobytes()


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("distance", [1.001, 2.0, 30.0, 1e4])
def test_points_of_sphere_lights(distance, precision):
    """On the sphere, on the side that one sees, and uniform over the cone that it fills."""
    centre, radius = np.zeros(3), 0.75
    axis = np.array([0.48, -0.6, 0.64])
    p = (axis * distance * radius).astype(precision).astype(np.float64)
    s, t = draws(COUNT, 2, precision)
    at = compiled(precision)
    found = np.array(at.on_light_sphere(*centre, radius, *p, s, t), np.float64)
    eps = np.finfo(precision).eps
    np.testing.assert_allclose(np.linalg.norm(found, axis=0), radius, rtol=16 * eps)
    # Seen from p, nothing of the sphere is in front of it: p is above its tangent plane.
    seen = (found * (p[:, None] - found)).sum(0) / radius**2
    assert seen.min() > -64 * eps * distance
    if distance > 1000 and precision == "float32":
        return  # which direction it is can no longer be told from the rounded point
    way = found - p[:, None]
    way /= np.linalg.norm(way, axis=0)
    sine2 = (np.cross(axis, way.T) ** 2).sum(1)
    widest = 1 / distance**2
    less = sine2 / (1 + np.sqrt(np.maximum(0, 1 - sine2)))  # 1 - cosine
    part = less / (widest / (1 + np.sqrt(1 - widest)))
    assert part.max() < 1 + 2000 * eps
    np.testing.assert_allclose(part, s, atol=1e-3 if precision == "float32" else 1e-8)
    e = np.cross(axis, [1.0, 0, 0])
    e /= np.linalg.norm(e)
    turn = np.arctan2(np.cross(axis, e) @ way, e @ way) / (2 * np.pi) % 1
    assert chance(np.clip(part, 0, 1), turn, bins=16) > UNLIKELY


@pytest.mark.parametrize("precision", PRECISIONS)
def test_sphere_lights_that_are_points(precision):
    """Of radius 0, or around p: the centre, bit for bit."""
    at = compiled(precision)
    c = np.random.default_rng(9).normal(size=(3, 1000)).astype(precision)
    c[:, 0] = -0.0
    s, t = draws(1000, 2, precision)
    for radius, away in ((0.0, 3.0), (0.0, 0.0), (2.0, 0.0), (2.0, 0.5)):
        found = np.array(at.on_light_sphere(*c, radius, *(c + away), s, t), precision)
        assert found.tobytes() == c.tobytes()


@pytest.mark.parametrize("precision", PRECISIONS)
def test_compiled_and_plain_agree(precision):
    """To a few roundings of what went in."""
    at, eps = compiled(precision), np.finfo(precision).eps
    n, v, p = unit(300, 10), unit(300, 11), unit(300, 12) * 3
    v = np.where((n * v).sum(0) < 0, -v, v)
    s, t = 0.02 + 0.96 * draws(n.shape[1], 2)
    given = [each.astype(precision) for each in (n, v, p, s, t)]
    n, v, p, s, t = (each.astype(np.float64) for each in given)
    for name, arguments in {
        "on_disc": (s, t),
        "frame": n,
        "cosine_direction": (*n, s, t),
        "facet": (*n, *v, 0.25, s, t),
        "on_rectangle": (*p, *n, *v, s, t),
        "on_light_sphere": (*n, 0.5, *p, s, t),
    }.items():
        found = np.array(getattr(at, name)(*arguments), np.float64)
        np.testing.assert_allclose(
            found, plain(getattr(sampling, name), *arguments), rtol=0, atol=64 * eps, err_msg=name
        )
