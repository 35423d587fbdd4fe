"""The nearest hit over a mesh by brute force, as a renderer asks for it: time a ray.

What makes and judges a scene is apart from how it is timed, so that trees may be timed over it.
"""

from __future__ import annotations

import numpy as np

from rtbench.accuracy import oracle
from rtbench.accuracy.cases import EITHER, MUST_HIT
from rtbench.compiled import lanes
from rtbench.errors import RtbenchError
from rtbench.experiments import typical_cells
from rtbench.experiments.bench import Bench
from rtbench.experiments.typical_cells import Workload
from rtbench.kernels.contract import Kernel
from rtbench.workloads.meshes import Mesh
from rtbench.workloads.solids import icosphere
from rtbench.workloads.typical import from_outside

MESH = "mesh"
SUBDIVISIONS = 2  # of an icosahedron: 320 triangles
HALF = 0.5  # of the rays hit, about


def scene(rays: int, seed: int, mesh: Mesh | None = None) -> tuple[Workload, np.ndarray]:
    """Return rays at a mesh from outside, and whether each must hit it.

    Parameters
    ----------
    rays : int
    seed : int
    mesh : Mesh, optional
        A sphere of 320 triangles if not given.

    Returns
    -------
    Workload
    (R,) int8 array
        1: some triangle must be hit; 0: all must be missed; 2: either, a tie decides.
    """
    mesh = (mesh or icosphere(SUBDIVISIONS)).rounded(np.float32)
    origins, directions = from_outside(mesh, rays, seed)
    corners = mesh.triangles.astype(np.float32)
    expect = np.empty(rays, np.int8)
    for ray in range(rays):
        of_all = oracle.expectations(
            corners,
            np.broadcast_to(origins[ray], (len(corners), 3)),
            np.broadcast_to(directions[ray], (len(corners), 3)),
        )
        ties = EITHER if (of_all == EITHER).any() else 0
        expect[ray] = MUST_HIT if (of_all == MUST_HIT).any() else ties
    return Workload(MESH, HALF, corners, origins, directions, scene=True), expect


def add_forms(
    bench: Bench,
    kernel: Kernel,
    precision: str,
    workload: Workload,
    expect: np.ndarray,
    repetitions: int,
) -> list[dict]:
    """Add a kernel over a mesh, ray by ray and in packets of rays where it can be taken in them.

    Returns
    -------
    list of dict
        A row a form: ``rays`` of which so many are ``decided`` and ``wrong``: they hit and must
        not, or must and do not.
    """
    nearest = typical_cells.add(bench, kernel, precision, workload, repetitions=repetitions)[0]
    found = {typical_cells.SCALAR: nearest}
    if in_packets(kernel, precision):
        found[workload.form] = typical_cells.add_packets(
            bench, kernel, precision, workload, repetitions=repetitions
        )[0]
    return [
        {
            "kernel": kernel.name,
            "precision": precision,
            "form": form,
            "rays": len(each),
            "triangles": len(workload.corners),
            "hits": int(np.count_nonzero(each >= 0)),
            "decided": int(np.count_nonzero(expect != EITHER)),
            "wrong": int(
                np.count_nonzero(((each >= 0) != (expect == MUST_HIT)) & (expect != EITHER))
            ),
        }
        for form, each in found.items()
    ]


def in_packets(kernel: Kernel, precision: str) -> bool:
    """Tell whether a kernel can be taken in lanes."""
    if precision == "mixed":
        return False
    try:
        lanes.must_fit(kernel)
    except RtbenchError:
        return False
    return True
