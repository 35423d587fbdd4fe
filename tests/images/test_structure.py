"""Structural similarity: by hand where it can be, else as the paper's sums say, one by one."""

import math

import numpy as np
import pytest

from rtbench.images.structure import structural_similarity

RANDOM = np.random.default_rng(3)
A = RANDOM.random((19, 24))


def as_the_paper_says(x, y) -> float:
    """Wang et al. 2004, equations 13 to 17, window by window with plain loops."""
    weights = {
        (i, j): math.exp(-(i * i + j * j) / (2 * 1.5**2))
        for i in range(-5, 6)
        for j in range(-5, 6)
    }
    total = math.fsum(weights.values())
    c1, c2 = (0.01 * 1) ** 2, (0.03 * 1) ** 2
    found = []
    for row in range(5, x.shape[0] - 5):
        for column in range(5, x.shape[1] - 5):
            window = [
                (w / total, x[row + i, column + j], y[row + i, column + j])
                for (i, j), w in weights.items()
            ]
            mx = math.fsum(w * a for w, a, _ in window)
            my = math.fsum(w * b for w, _, b in window)
            vx = math.fsum(w * (a - mx) ** 2 for w, a, _ in window)
            vy = math.fsum(w * (b - my) ** 2 for w, _, b in window)
            cov = math.fsum(w * (a - mx) * (b - my) for w, a, b in window)
            found.append(
                (2 * mx * my + c1) * (2 * cov + c2) / ((mx**2 + my**2 + c1) * (vx + vy + c2))
            )
    return math.fsum(found) / len(found)


@pytest.mark.parametrize(
    "b",
    [
        np.clip(A + RANDOM.normal(0, 0.1, A.shape), 0, 1),
        A * 0.5,
        1 - A,
        A[::-1],
        np.zeros_like(A),
        RANDOM.random(A.shape) < 0.5,
    ],
    ids=["noise", "half as bright", "negative", "upside down", "black", "dots"],
)
def test_it_is_the_papers(b):
    assert structural_similarity(A, b) == pytest.approx(as_the_paper_says(A, b), abs=1e-12)
    assert structural_similarity(b, A) == pytest.approx(structural_similarity(A, b), abs=1e-15)


def test_equal_pictures_have_1():
    assert structural_similarity(A, A) == pytest.approx(1, abs=1e-14)


@pytest.mark.parametrize(("one", "other"), [(0.2, 0.5), (0.0, 1.0), (0.7, 0.71)])
def test_of_flat_pictures_brightness_alone_is_left(one, other):
    """Variances 0: (2 m n + c1) / (m^2 + n^2 + c1), the second factor c2 / c2."""
    flat = np.ones((12, 30))
    expected = (2 * one * other + 1e-4) / (one**2 + other**2 + 1e-4)
    assert structural_similarity(one * flat, other * flat) == pytest.approx(expected, abs=1e-9)


def test_a_negative_of_one_window_is_below_0():
    """Equal means, covariance -variance: (c2 - 2 v) / (c2 + 2 v)."""
    x = np.zeros((11, 11))
    x[:, 5] = 0.2  # the middle column, its weight p
    w = [math.exp(-(i * i) / 4.5) for i in range(-5, 6)]
    p = w[5] / sum(w)
    mean, variance = 0.2 * p, 0.04 * p * (1 - p)
    y = 2 * mean - x
    expected = (9e-4 - 2 * variance) / (9e-4 + 2 * variance)
    assert structural_similarity(x, y) == pytest.approx(expected, abs=1e-12)
    assert expected < 0


def test_below_the_window_there_is_none():
    assert math.isnan(structural_similarity(A[:10], A[:10]))
    assert not math.isnan(structural_similarity(A[:11, :11], A[:11, :11]))
