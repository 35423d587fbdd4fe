"""Vectors as tuples of three: what `prepare` functions compute with, in the language of kernels."""

import math


def corners(tri):
    """Return the vertices A, B, C of a triangle as tuples."""
    return (
        (tri.v0[0], tri.v0[1], tri.v0[2]),
        (tri.v1[0], tri.v1[1], tri.v1[2]),
        (tri.v2[0], tri.v2[1], tri.v2[2]),
    )


def difference(p, q):
    """Return p - q."""
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


def cross(p, q):
    """Return the cross product p x q, each product rounded once."""
    return (
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    )


def dot(p, q):
    """Return the dot product p . q, summed from x to z."""
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def quotient(p, scalar):
    """Return p / scalar."""
    return p[0] / scalar, p[1] / scalar, p[2] / scalar


def length(p):
    """Return the length of p; 1 in rational arithmetic, where no sign may depend on it."""
    return math.sqrt(dot(p, p))
