"""Mirrors, Snell, Fresnel, Cauchy and highlights against physics by hand and exact decimals."""

from __future__ import annotations

import functools
from decimal import Decimal, localcontext

import numpy as np
import pytest
from compiled_functions import PRECISIONS, Compiled, plain

from rtbench.tracer import highlights, optics

KINDS = {
    "reflected": "rrrrrr > rrr",
    "refracted": "rrrrrrr > rrrb",
    "fresnel": "rr > r",
    "index_for": "rrr > r",
    "band": "ir > r",
}
OF_HIGHLIGHTS = {
    "phong": "rrrrrrrrrr > r",
    "blinn_phong": "rrrrrrrrrr > r",
    "oren_nayar": "rrrrrrrrrr > r",
    "spot": "rrr > r",
}
LINES = {"F": 486.1327, "d": 587.5618, "C": 656.2725}  # nm
RATIOS = (1 / 1.5, 1.5, 1 / 1.33, 1.33, 0.42, 2.4, 0.999, 1.001)


@functools.cache
def compiled(precision: str) -> Compiled:
    return Compiled(optics, KINDS, precision)


@functools.cache
def lit(precision: str) -> Compiled:
    return Compiled(highlights, OF_HIGHLIGHTS, precision)


def eps_of(precision: str) -> float:
    return float(np.finfo(precision).eps)


def unit(n: int, seed: int, precision: str) -> np.ndarray:
    found = np.random.default_rng(seed).normal(size=(3, n))
    return (found / np.linalg.norm(found, axis=0)).astype(precision)


def meeting(n: int, seed: int, precision: str) -> tuple[np.ndarray, np.ndarray]:
    """Return directions and the normals that they meet."""
    d, normal = unit(n, seed, precision), unit(n, seed + 1, precision)
    return np.where((d * normal).sum(0) > 0, -d, d), normal


def in_plane(degrees: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return directions that come down at some angles to the normal (0, 1, 0), and that."""
    angle = np.radians(degrees)
    d = np.array([np.sin(angle), -np.cos(angle), np.zeros_like(angle)])
    return d, np.array([0.0, 1.0, 0.0])


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_mirror_keeps_the_angle(precision):
    """What is along the normal turns round, what is along the mirror stays."""
    d, n = meeting(2000, 1, precision)
    r = np.array(compiled(precision).reflected(*d, *n), np.float64)
    d, n = d.astype(np.float64), n.astype(np.float64)
    eps = eps_of(precision)
    np.testing.assert_allclose((r * n).sum(0), -(d * n).sum(0), atol=8 * eps)
    np.testing.assert_allclose(np.cross(r.T, n.T), np.cross(d.T, n.T), atol=8 * eps)
    assert [float(x) for x in compiled(precision).reflected(0.6, -0.8, 0, 0, 1, 0)] == [
        pytest.approx(0.6, abs=eps),
        pytest.approx(0.8, abs=eps),
        0,
    ]


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("precision", PRECISIONS)
def test_snell(precision, ratio):
    """sin(behind) = ratio sin(before), on the other side of the normal, in the same plane."""
    critical = np.degrees(np.arcsin(1 / ratio)) if ratio > 1 else 90
    degrees = np.linspace(0, 0.99 * critical, 500)
    d, n = in_plane(degrees)
    x, y, z, total = compiled(precision).refracted(*d, *n, ratio)
    expected = np.degrees(np.arcsin(ratio * np.sin(np.radians(degrees))))
    found = np.degrees(np.arctan2(x.astype(float), -y.astype(float)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=4000 * eps_of(precision))
    assert not z.any() and not total.any()


@pytest.mark.parametrize("precision", PRECISIONS)
def test_snell_in_space(precision):
    """Whichever way all is turned: length 1, and what lies along the boundary times the ratio."""
    d, n = meeting(5000, 3, precision)
    ratio = np.random.default_rng(5).uniform(0.4, 2.5, 5000).astype(precision)
    *t, total = compiled(precision).refracted(*d, *n, ratio)
    t, d, n = (np.array(each, np.float64) for each in (t, d, n))
    along = np.cross(d.T, n.T) * ratio[:, None]
    sine = np.linalg.norm(along, axis=1)
    sure = abs(sine - 1) > 1e-5
    np.testing.assert_array_equal(total[sure], sine[sure] > 1)
    assert total.any() and not total.all()
    eps = eps_of(precision)
    through = ~total
    np.testing.assert_allclose(np.cross(t.T, n.T)[through], along[through], atol=16 * eps)
    clear = through & (sine < 0.99)
    np.testing.assert_allclose(np.linalg.norm(t, axis=0)[clear], 1, atol=32 * eps)
    assert (t * n).sum(0)[clear].max() < 0
    assert t[:, total].tobytes() == d[:, total].tobytes()


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("index", [1.33, 1.5168, 2.42])
def test_total_reflection_begins_at_the_critical_angle(precision, index):
    """Glass to air: asin(1 / n); air to glass: never. R is 1 beyond it, and below 1 before."""
    critical = np.degrees(np.arcsin(1 / index))
    by = 0.02
    d, n = in_plane(np.array([critical - by, critical + by, 89.9]))
    at = compiled(precision)
    assert at.refracted(*d, *n, index)[3].tolist() == [False, True, True]
    assert at.refracted(*d, *n, 1 / index)[3].tolist() == [False] * 3
    before, beyond, grazing = at.fresnel(-d[1], index)
    assert 0.5 < before < 1 and beyond == grazing == 1
    assert (at.fresnel(-d[1], 1 / index) < 1).all()


@pytest.mark.parametrize("precision", PRECISIONS)
def test_where_nothing_changes(precision):
    """Ratio 1: directions go on, bit for bit, nothing is reflected, at any angle."""
    d, n = meeting(2000, 6, precision)
    d[:, 0] = (0.0, -0.0, -1.0)
    at = compiled(precision)
    *t, total = at.refracted(*d, *n, 1.0)
    assert np.array(t, precision).tobytes() == d.tobytes() and not total.any()
    cosines = np.concatenate([[0, eps_of(precision) ** 4, 1], np.linspace(0, 1, 100)])
    assert not at.fresnel(cosines, 1.0).any()
    wavelengths = np.linspace(380, 780, 50)
    for index in (0.7, 1.0, 1.5168):
        for abbe in (0.0, -1.0):
            assert (at.index_for(index, abbe, wavelengths) == np.dtype(precision).type(index)).all()
    assert (at.index_for(1.0, 30.0, wavelengths) == 1).all()


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("n", [1.0003, 1.33, 1.5, 2.42, 4.0])
def test_fresnel_at_angles_known_by_hand(precision, n):
    """Straight on ((n-1)/(n+1))^2; at Brewster's angle half of Rs alone; along the boundary 1."""
    at, eps = compiled(precision), eps_of(precision)
    n = float(np.dtype(precision).type(n))
    into, out = 1 / n, n
    straight = ((n - 1) / (n + 1)) ** 2
    # The ratio's own rounding counts as much as n is near to 1.
    rtol = 16 * eps + 8 * eps * n / (n - 1)
    np.testing.assert_allclose(at.fresnel(1.0, [into, out]), straight, rtol=rtol)
    # tan(Brewster) = n: the refracted ray is at right angles to the mirrored one, so rp = 0 and
    # rs = (cos - n sin) / (cos + n sin) = (1 - n^2) / (1 + n^2).
    cosine = 1 / np.sqrt(1 + n * n)
    half = ((1 - n * n) / (1 + n * n)) ** 2 / 2
    np.testing.assert_allclose(at.fresnel(cosine, into), half, rtol=rtol)
    assert at.fresnel(0.0, into) == pytest.approx(1, abs=4 * eps)
    assert at.fresnel(0.0, out) == 1
    near = at.fresnel(1e-4, into)
    assert 1 - 4e-4 * (n * n + 1) / np.sqrt(n * n - 1) < near < 1


@pytest.mark.parametrize("precision", PRECISIONS)
def test_fresnel_is_never_above_one(precision):
    """Along the boundary rounding would have it so."""
    ratio = np.random.default_rng(7).uniform(0.3, 1, 20_000)
    for cosine in (0.0, eps_of(precision) / 8, 1.0):
        found = compiled(precision).fresnel(cosine, ratio)
        assert found.max() <= 1 and found.min() >= 0
    assert (compiled(precision).fresnel(0.0, ratio) > 1 - 8 * eps_of(precision)).all()


def exact_fresnel(cosine: float, ratio: float) -> float:
    """Return the textbook's (Rs + Rp) / 2, in sixty decimals."""
    with localcontext(prec=60):
        c, r = Decimal(cosine), Decimal(ratio)
        square = 1 - r * r * (1 - c * c)
        if square <= 0:
            return 1.0
        behind = square.sqrt()
        upright = (r * c - behind) / (r * c + behind)
        parallel = (c - r * behind) / (c + r * behind)
        return float((upright * upright + parallel * parallel) / 2)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_fresnel_is_exact_to_roundings(precision):
    """Near ratio 1 too, where the textbook's differences cancel, and along the boundary."""
    rng = np.random.default_rng(8)
    cosine = np.concatenate([rng.uniform(0.05, 1, 500), [1.0, 0.5], 10 ** rng.uniform(-6, -1, 200)])
    ratio = rng.uniform(0.3, 0.95, len(cosine))
    ratio[::3] = 1 - 10 ** rng.uniform(-5, -1, len(ratio[::3]))
    cosine, ratio = cosine.astype(precision), ratio.astype(precision)
    found = compiled(precision).fresnel(cosine, ratio).astype(float)
    expected = [exact_fresnel(float(c), float(r)) for c, r in zip(cosine, ratio, strict=True)]
    # At the angle where rp is 0, R is Rs / 2: rp's absolute error is small against that.
    np.testing.assert_allclose(found, expected, rtol=32 * eps_of(precision))
    ratio = np.float64(1) / ratio.astype(float)
    ratio = ratio.astype(precision)
    found = compiled(precision).fresnel(cosine, ratio).astype(float)
    expected = [exact_fresnel(float(c), float(r)) for c, r in zip(cosine, ratio, strict=True)]
    # Outward the critical angle's square root magnifies roundings without bound near to it.
    square = 1 - ratio.astype(float) ** 2 * (1 - cosine.astype(float) ** 2)
    clear = abs(square) > 0.01 * cosine
    np.testing.assert_allclose(
        found[clear], np.array(expected)[clear], rtol=3e3 * eps_of(precision)
    )
    assert found.max() == 1 and found.min() >= 0


def test_light_is_the_same_both_ways():
    """What is not reflected goes on: with T from the transmitted fields, R + T = 1 (energy)."""
    degrees = np.linspace(0, 89, 90)
    for n in (1.33, 1.5, 2.42):
        cosine = np.cos(np.radians(degrees))
        behind = np.sqrt(1 - (np.sin(np.radians(degrees)) / n) ** 2)
        ts = 2 * cosine / (cosine + n * behind)
        tp = 2 * cosine / (n * cosine + behind)
        through = n * behind / cosine * (ts**2 + tp**2) / 2
        found = compiled("float64").fresnel(cosine, 1 / n)
        np.testing.assert_allclose(found + through, 1, atol=1e-14)
        # Stokes: from inside, at the refracted angle, as much is reflected.
        np.testing.assert_allclose(compiled("float64").fresnel(behind, n), found, rtol=1e-11)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_dispersion_gives_back_what_glasses_are_known_by(precision):
    """n_d and V_d, of crown, flint and diamond."""
    at, eps = compiled(precision), eps_of(precision)
    for index, abbe in ((1.5168, 64.17), (1.7847, 25.76), (2.4173, 55.3)):
        n = {name: float(at.index_for(index, abbe, line)) for name, line in LINES.items()}
        assert n["d"] == np.dtype(precision).type(index)
        assert n["F"] > n["d"] > n["C"]
        spread = n["F"] - n["C"]
        assert spread == pytest.approx((index - 1) / abbe, abs=4 * eps * index)


def test_dispersion_of_bk7():
    """Schott's catalogue: n_F 1.52238, n_C 1.51432; Cauchy's two terms miss by less than 1e-4."""
    at = compiled("float64")
    assert at.index_for(1.5168, 64.17, LINES["F"]) == pytest.approx(1.52238, abs=1e-4)
    assert at.index_for(1.5168, 64.17, LINES["C"]) == pytest.approx(1.51432, abs=1e-4)
    assert at.index_for(1.5168, 64.17, 404.6561) == pytest.approx(1.53024, abs=1e-3)  # line h


@pytest.mark.parametrize("precision", PRECISIONS)
def test_bands_cover_what_eyes_see(precision):
    """Without gap or overlap from 400 to 700 nm; each holds its primary's dominant wavelength."""
    u = np.linspace(0, 1, 101)
    red, green, blue = (compiled(precision).band(k, u) for k in range(3))
    assert (blue[0], blue[-1], green[-1], red[-1]) == (400, 500, 600, 700)
    assert blue[-1] == green[0] and green[-1] == red[0]
    for each, primary in ((red, 611.4), (green, 549.1), (blue, 464.2)):
        assert each[0] < primary < each[-1]
        assert (np.diff(each) > 0).all()


def turned(degrees: float) -> tuple[float, float, float]:
    return np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))


@pytest.mark.parametrize("precision", PRECISIONS)
def test_highlights_fall_off_with_the_angle(precision):
    """Phong by the angle from the mirrored light, Blinn by half of it, each to the exponent."""
    at, eps = lit(precision), eps_of(precision)
    for off in (0.0, 5.0, 30.0, 80.0):
        for exponent in (1.0, 32.0, 200.0):
            given = (0, 0, 1, *turned(-35), *turned(35 - off), exponent)
            rtol = 8 * eps * (exponent + 1) / np.cos(np.radians(off))
            expected = np.cos(np.radians(off)) ** exponent
            assert at.phong(*given) == pytest.approx(expected, rel=rtol)
            expected = np.cos(np.radians(off / 2)) ** exponent
            assert at.blinn_phong(*given) == pytest.approx(expected, rel=rtol)
    for method in (at.phong, at.blinn_phong):
        assert method(0, 0, 1, *turned(-35), *turned(34), 0.0) == 1
        assert method(0, 0, 1, *turned(0), *turned(180), 0.0) == 0  # opposite: no half vector
        assert method(0, 0, 1, *turned(100), *turned(120), 2.0) == 0
    assert at.phong(0, 0, 1, *turned(-60), *turned(-31), 2.0) == 0  # 91 degrees off


@pytest.mark.parametrize("precision", PRECISIONS)
def test_highlights_stay_below_one(precision):
    """With the greatest exponent a cosine of 1 and a rounding would be e^60."""
    n, light = unit(20000, 20, precision), unit(20000, 21, precision)
    viewer = np.array(compiled(precision).reflected(*-light, *n), precision)
    for exponent in (1.0, 1e9):
        found = lit(precision).phong(*n, *light, *viewer, exponent)
        assert found.max() <= 1 and found.min() >= 0
        found = lit(precision).blinn_phong(*n, *light, *viewer, exponent)
        assert found.max() <= 1 and found.min() >= 0


def upper(n: int, seed: int, precision: str) -> np.ndarray:
    found = unit(n, seed, precision)
    found[2] = abs(found[2])
    return found


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("degrees", [5.0, 30.0, 90.0])
def test_rough_diffuse_surfaces(precision, degrees):
    """The formula as printed, with its angles, sine and tangent."""
    sigma = np.radians(degrees)
    light, viewer = upper(2000, 9, precision), upper(2000, 10, precision)
    found = lit(precision).oren_nayar(0, 0, 1, *light, *viewer, sigma)
    light, viewer = light.astype(float), viewer.astype(float)
    theta_i, theta_r = (np.arctan2(np.hypot(x, y), z) for x, y, z in (light, viewer))
    phi = np.arctan2(light[1], light[0]) - np.arctan2(viewer[1], viewer[0])
    alpha, beta = np.maximum(theta_i, theta_r), np.minimum(theta_i, theta_r)
    a = 1 - 0.5 * sigma**2 / (sigma**2 + 0.33)
    b = 0.45 * sigma**2 / (sigma**2 + 0.09)
    expected = a + b * np.maximum(0, np.cos(phi)) * np.sin(alpha) * np.tan(beta)
    # Both cosines small: what is left of l . v is divided by them.
    clear = np.maximum(light[2], viewer[2]) > 0.05
    np.testing.assert_allclose(found[clear], expected[clear], rtol=200 * eps_of(precision))
    # Grazing back-lighting brightens the edge: the moon is no Lambertian ball.
    edge = lit(precision).oren_nayar(0, 0, 1, *turned(80), *turned(80), sigma)
    ahead = lit(precision).oren_nayar(0, 0, 1, *turned(80), *turned(-80), sigma)
    assert edge > 1 > ahead


@pytest.mark.parametrize("precision", PRECISIONS)
def test_smooth_diffuse_surfaces_are_lamberts(precision):
    """Roughness 0: exactly 1, from any side."""
    given = [unit(2000, seed, precision) for seed in (11, 12, 13)]
    assert (lit(precision).oren_nayar(*given[0], *given[1], *given[2], 0.0) == 1).all()
    flat = (1.0, 0.0, float(np.finfo(precision).smallest_subnormal))  # 1 / that is infinite
    assert lit(precision).oren_nayar(0, 0, 1, *flat, *flat, 0.0) == 1


@pytest.mark.parametrize("precision", PRECISIONS)
def test_spots(precision):
    """All within the inner cone, nothing beyond the outer one, smooth and falling between."""
    at = lit(precision)
    inner, outer = np.cos(np.radians([20.0, 30.0])).astype(precision)
    cosine = np.cos(np.radians(np.linspace(0, 90, 9001)))
    found = at.spot(cosine, inner, outer).astype(float)
    assert (found[:2000] == 1).all() and (found[3001:] == 0).all()
    assert (np.diff(found) <= 0).all() and abs(np.diff(found)).max() < 2e-3
    assert at.spot((inner + outer) / 2, inner, outer) == pytest.approx(0.5, abs=1e-5)
    assert at.spot(outer, outer, outer) == 1 and at.spot(np.cos(1.6), outer, outer) == 0
    below = -1 - 4 * eps_of(precision)
    assert at.spot(below, -2.0, -2.0) == 1


@pytest.mark.parametrize("precision", PRECISIONS)
def test_compiled_and_plain_agree(precision):
    """To a few roundings of what went in."""
    eps = eps_of(precision)
    d, n = (x.astype(float) for x in meeting(300, 14, precision))
    light, viewer = (-d, upper(300, 16, precision).astype(float))
    cosine = -(d * n).sum(0).astype(precision).astype(float)
    ratio = np.random.default_rng(17).uniform(0.4, 0.99, 300).astype(precision).astype(float)
    cases = {
        "reflected": (*d, *n),
        "refracted": (*d, *n, ratio),
        "fresnel": (cosine, ratio),
        "index_for": (1.5, 40.0, 400 + 300 * ratio),
        "phong": (*n, *light, *viewer, 8.0),
        "blinn_phong": (*n, *light, *viewer, 8.0),
        "oren_nayar": (*n, *light, *(0.5 * n - 0.5 * d), 0.5),
        "spot": (cosine, 0.75, 0.25),
    }
    for name, given in cases.items():
        source, at = (
            (highlights, lit(precision)) if name in OF_HIGHLIGHTS else (optics, compiled(precision))
        )
        found = np.array(getattr(at, name)(*given), float)
        expected = np.array(plain(getattr(source, name), *given), float)
        np.testing.assert_allclose(found, expected, rtol=64 * eps, atol=64 * eps, err_msg=name)
