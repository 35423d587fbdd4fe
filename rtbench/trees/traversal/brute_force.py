"""No tree at all: every ray against every triangle, the thesis's naive way (Šilhavý 2010, 2.1)."""

from __future__ import annotations

import numpy as np

from rtbench.kernels.contract import ZERO

# Stand-ins for what each generated module puts at its top.
COUNTED = RETURNS_THREE = False


def nearest_in_leaf(refs, triangles, begin, end, ray, index, t, u, v):
    return index, t, u, v


def any_in_leaf(refs, triangles, begin, end, ray):
    return False


def nearest(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            ray = rays[k]
            found = nearest_in_leaf(
                refs, triangles, 0, triangles.shape[0], ray, np.int32(-1), ray.tmax, ZERO, ZERO
            )
            outcome[k] = found[0]
            t[k] = found[1]
            if RETURNS_THREE:
                u[k] = found[2]
                v[k] = found[3]
            if COUNTED:
                counts[k, 0], counts[k, 1], counts[k, 2] = 0, 1, triangles.shape[0]


def any_hit(nodes, refs, triangles, scene, rays, first, second, outcome, t, u, v, counts):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            outcome[k] = any_in_leaf(refs, triangles, 0, triangles.shape[0], rays[k])
            if COUNTED:
                counts[k, 0], counts[k, 1], counts[k, 2] = 0, 1, triangles.shape[0]


QUERIES = {"nearest": nearest, "any": any_hit}
CALLEES = ()
