"""First-hit optimisation: what primary rays hit, found by rasterising.

Each primitive is asked for the pixels that its box covers in the picture, by the same test and the
same rays that the tracer would send, and each pixel keeps the nearest. So the answer is that of
the tree to the last bit; the tracer then asks only the leaf that holds the winner.

Only for pinholes, one ray through the middle of each pixel, and what does not move.

Source: Šilhavý 2010, section 2.3.1 (there by graphics hardware).
"""

from __future__ import annotations

import functools

import numpy as np

from rtbench.compiled import syntax
from rtbench.compiled.embedded import refused_in_a_line
from rtbench.compiled.instantiate import Instance, instantiate
from rtbench.compiled.layout import REAL_TYPE, fill
from rtbench.compiled.sources import dtype_source, named
from rtbench.kernels.contract import HIT, Kernel
from rtbench.shapes import any_shape
from rtbench.shapes.any_shape import hit_shape
from rtbench.shapes.records import KINDS, shape_type
from rtbench.tracer import records, sampling, world
from rtbench.tracer.camera import from_camera
from rtbench.tracer.turns import in_turns
from rtbench.tracer.view import covered
from rtbench.trees import leaves
from rtbench.trees.traversal import leaf_tests
from rtbench.trees.traversal.leaf_tests import ask

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
TRIANGLES = SHAPES = READS_END = False
INFINITY = REAL(np.inf)
BAND = 64  # rows that a thread takes at a time


def rasterised(triangles, shapes, places, camera, rays, ways, best, winner, first_row, last_row):
    view, ray = camera[0], rays[0]
    for y in range(first_row, last_row):
        for x in range(view.width):
            _, way = from_camera(view, np.uint64(0), REAL(x) + 0.5, REAL(y) + 0.5)
            for axis in range(3):
                ways[y, x, axis] = way[axis]
    for axis in range(3):
        ray.orig[axis] = view.position[axis]
    ray.tmax = INFINITY
    for i in range(places.shape[0]):
        left, right = max(places[i, 0], 0.0), min(places[i, 2], np.float64(view.width))
        upper = max(places[i, 1], np.float64(first_row))
        lower = min(places[i, 3], np.float64(last_row))
        if not (left < right and upper < lower):
            continue
        for y in range(int(upper), int(np.ceil(lower))):
            for x in range(int(left), int(np.ceil(right))):
                for axis in range(3):
                    ray.dir[axis] = ways[y, x, axis]
                    if READS_END:
                        ray.end[axis] = ray.orig[axis] + ray.dir[axis]
                at = -1.0
                if TRIANGLES and (not SHAPES or i < triangles.shape[0]):
                    result = ask(triangles[i], ray)
                    if (result[0] == HIT) & (result[1] > 0.0) & (result[1] < INFINITY):
                        at = result[1]
                elif SHAPES:
                    at = hit_shape(shapes[i - triangles.shape[0]], ray.orig, ray.dir, False)
                # In the order of their numbers: of equal ones the first stays.
                if at > 0.0 and at < best[y, x]:
                    best[y, x], winner[y, x] = at, i


@functools.cache
def rasteriser(kernel: Kernel, precision: str, kinds: frozenset[str]) -> Instance:
    """Return the compiled rasteriser.

    Parameters
    ----------
    kernel : Kernel
    precision : str
    kinds : frozenset of str
        Of primitives.

    Returns
    -------
    Instance
        ``call(triangles, shapes, places, camera, rays, ways, best, winner, first_row, last_row)``:
        records as the kernel reads them one by one, SHAPE records, where each primitive may be
        seen (`rtbench.tracer.view.covered`); directions (H, W, 3), t (H, W), which begins at
        infinity, and the primitive (H, W) int32 are written for rows from first_row on.
    """
    inside = leaves.test_of(kernel, precision, leaves.ONE_BY_ONE)
    real = REAL_TYPE[precision]
    shapes = kinds & set(KINDS)
    constants = inside.constants | {
        "TRIANGLES": str("triangles" in kinds),
        "SHAPES": str(bool(shapes)),
        "READS_END": str("end" in leaves.ray_type(kernel, precision).names),
        "DEPTH_OF_FIELD": "False",
        "ONE_MORE": "np.uint64(1)",
        "INFINITY": "REAL(np.inf)",
        "HIT": str(HIT),
        "SHAPE": dtype_source(shape_type(real)),
        "CAMERA": dtype_source(records.camera_type(real)),
    }
    constants |= any_shape.constants(shapes) | sampling.constants(precision)
    own = (leaf_tests.ask, *any_shape.CALLEES, *sampling.CALLEES, from_camera)
    name = real.__name__
    with refused_in_a_line(kernel, " in the rasteriser"):
        return instantiate(
            named(syntax.typed(syntax.parse(rasterised)), f"{kernel.name}_rasterised"),
            callees=(
                *inside.callees,
                *(named(syntax.typed(syntax.parse(f)), f.__name__) for f in own),
            ),
            constants=constants,
            signature=(
                f"void(TRIANGLE[::1], SHAPE[::1], float64[:, ::1], CAMERA[::1], RAY[::1], "
                f"{name}[:, :, ::1], {name}[:, ::1], int32[:, ::1], int64, int64)"
            ),
            title=f"What primary rays hit, rasterised: {kernel.name} in {precision}",
            forceinline=True,
            outlined=inside.outlined,
            imports=inside.imports,
        )


def first_hits(
    kernel: Kernel, precision: str, made: world.World, camera: np.ndarray, threads: int
) -> np.ndarray:
    """Return where the tree holds what the ray through the middle of each pixel hits.

    Parameters
    ----------
    kernel, precision
    made : World
        One whose ``places`` are known.
    camera : (1,) structured array
    threads : int
        That take bands of rows.

    Returns
    -------
    (H, W, 2) int64 array
        The begin and the end of a leaf that holds it; 0 and 0 where nothing is hit.
    """
    real = REAL_TYPE[precision]
    height, width = int(camera["height"][0]), int(camera["width"][0])
    shapes = made.arrays["shapes"]
    corners = tuple(made.corners[:, k] for k in range(3))
    none = np.zeros((1, 3))
    triangles, _ = fill(kernel, "own", precision, corners, none, none)
    ways = np.empty((height, width, 3), real)
    best, winner = np.full((height, width), np.inf, real), np.full((height, width), -1, np.int32)
    call = rasteriser(kernel, precision, made.kinds).call
    ray_type = leaves.ray_type(kernel, precision)
    places = covered(made.boxes, made.tree_base, camera)

    def band(begin: int, end: int) -> None:
        call(
            triangles,
            shapes,
            places,
            camera,
            np.zeros(1, ray_type),
            ways,
            best,
            winner,
            begin * BAND,
            min(end * BAND, height),
        )

    in_turns(-(-height // BAND), threads, band)
    found = np.zeros((height, width, 2), np.int64)
    hit = winner >= 0
    found[hit, 0] = made.places[winner[hit]]
    found[hit, 1] = found[hit, 0] + 1
    return found
