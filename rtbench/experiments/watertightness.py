"""Closed meshes: how many rays that must meet one slip through, for every kernel and every peer.

Rays start inside, aimed at vertices, edges and faces, and meet all triangles, the nearest being
kept, as a user would ask; the mesh lies at the origin and where Embree's own test puts it. Nothing
is timed. A float32 kernel gets a mesh and rays of float32, a float64 kernel a mesh and rays of
float64: those of float32 would never come near to its rounding.

Beside them, the hard cases are put to the peers: what the libraries that Python users have now miss
of what the kernels are judged by.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from rtbench.accuracy.cases import Cases
from rtbench.compiled import packets, packing
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import DATA_TYPE, fill
from rtbench.compiled.loops import loop
from rtbench.compiled.packing import Packing
from rtbench.errors import RtbenchError
from rtbench.experiments import peers
from rtbench.experiments.bench import Bench
from rtbench.experiments.peer_scores import scored_kernel, scored_peer
from rtbench.experiments.peers import PEERS, Peer
from rtbench.kernels import registry
from rtbench.kernels.contract import Kernel
from rtbench.measure import machine
from rtbench.records import schema
from rtbench.workloads.aimed import AIMS, Aimed, aimed_rays
from rtbench.workloads.meshes import Mesh
from rtbench.workloads.solids import icosphere

CELL = ("kernel", "precision")
# Where a sphere of radius 1 is put, and by what it is scaled before. Embree's verify.cpp has its
# watertight spheres there; float32 keeps 7 bits of a radius of 1 there, and whatever is computed
# from so few is exact: a larger sphere is the harder case.
THERE = (148376.0, 1234.0, -223423.0)
PLACES = {
    "at the origin": ((0.0, 0.0, 0.0), 1.0),
    "far away": (THERE, 1.0),
    "far away, 100 times larger": (THERE, 100.0),
}
PORTION = 1 << 23  # tests at once: a fraction of a second
# Beside the peers, of the hard cases: the usual kernel, and what is to be had for more time.
BESIDE = ("moller_trumbore_uv", "watertight_uv", "watertight_safe_uv", "adaptive_exact_uv")


def shares(rays: int) -> dict[str, int]:
    """Return how many of the rays are aimed at what: half at vertices, half at edges; a tenth more
    at faces, where nobody should leak."""
    return {"vertex": rays - rays // 2, "edge": rays // 2, "face": max(1, rays // 10)}


def nearest(
    kernel: Kernel, precision: str, rays: Aimed, progress: Callable[[float], None] | None = None
) -> np.ndarray:
    """Return the nearest triangle of a mesh along each ray as a kernel finds it, -1 for none.

    Parameters
    ----------
    kernel : Kernel
        One that returns t.
    precision : str
        That of the rays.
    rays : Aimed
    progress : callable, optional
        Called now and then with the fraction done.

    Returns
    -------
    (N,) int32 array
    """
    ask_some = _in_lanes(kernel, precision, rays) or _one_by_one(kernel, precision, rays)
    step = max(1, PORTION // len(rays.mesh.faces))
    starts = range(0, len(rays.origins), step)
    found = np.empty(len(rays.origins), np.int32)

    def ask(start: int) -> None:
        part = slice(start, start + step)
        found[part] = ask_some(rays.origins[part], rays.directions[part])

    ask(0)  # what else is to be compiled is compiled by one thread
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for k, _ in enumerate(pool.map(ask, starts[1:])):
            if progress is not None:
                progress((k + 2) / len(starts))
    return found


def _one_by_one(kernel: Kernel, precision: str, rays: Aimed) -> Callable:
    """Return what gives origins and directions their nearest triangle, ray by ray."""
    instance = loop(kernel, precision, "own", kind="nearest")
    corners = tuple(np.ascontiguousarray(rays.mesh.triangles[:, k]) for k in range(3))

    def ask(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        records = fill(kernel, "own", precision, corners, origins, directions, tmax=np.inf)
        return run_once(instance, kernel, precision, *records)[0]

    return ask


def _in_lanes(kernel: Kernel, precision: str, rays: Aimed) -> Callable | None:
    """Return the same in packets of rays, which say the same, five times as fast; or None."""
    chosen = Packing()
    try:
        instance = packets.loop(kernel, precision, chosen)
    except RtbenchError:  # mixed precision, and kernels that branch or take no tmax
        return None
    triangles = packing.fill_triangles(kernel, precision, chosen, rays.mesh.triangles)

    def ask(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        count = len(origins)
        whole = np.minimum(np.arange(-(-count // chosen.width) * chosen.width), count - 1)
        packed = packing.fill_rays(kernel, precision, chosen, origins[whole], directions[whole])
        records = triangles, packed
        found = packets.run_once(instance, kernel, precision, chosen, records, len(whole))[0]
        return found.reshape(-1)[:count]

    return ask


def counts(rays: Aimed, triangle: np.ndarray) -> list[dict[str, object]]:
    """Return by aim how many rays leaked, and how many hit far from what they were aimed at.

    Parameters
    ----------
    rays : Aimed
    triangle : (N,) int array
        -1: none. May be shorter than the rays are many: of those that were asked.

    Returns
    -------
    list of dict
        ``aim``, ``rays``, ``exact`` (that pass through their target exactly), ``leaks`` and, of a
        convex mesh, ``elsewhere``.
    """
    elsewhere = rays.elsewhere(triangle) if rays.convex else None
    found = []
    for number, name in enumerate(AIMS):
        own = rays.aim == number
        row = {"aim": name, "rays": own, "exact": own & rays.exact, "leaks": own & (triangle < 0)}
        row = {key: v if key == "aim" else int(np.count_nonzero(v)) for key, v in row.items()}
        if elsewhere is not None:
            row["elsewhere"] = int(np.count_nonzero(own & elsewhere))
        found.append(row)
    return found


def leaks(
    who: Kernel | Peer,
    precision: str,
    mesh: Mesh,
    rays: int,
    seed: int = 1,
    progress: Callable[[float], None] | None = None,
) -> list[dict[str, object]]:
    """Count the rays from inside a closed mesh that meet nothing.

    Parameters
    ----------
    who : Kernel or Peer
        A kernel must return t.
    precision : str
        Of its arithmetic.
    mesh : Mesh
    rays : int
        See `shares`.
    seed : int
    progress : callable, optional

    Returns
    -------
    list of dict
        As `counts`, a row an aim.
    """
    data = np.dtype(precision).type if isinstance(who, Peer) else DATA_TYPE[precision]
    return _counted(who, precision, aimed_rays(mesh, shares(rays), data, seed), progress)


def _counted(who: Kernel | Peer, precision: str, drawn: Aimed, progress=None) -> list[dict]:
    if isinstance(who, Peer):
        arrays = drawn.mesh.vertices, drawn.mesh.faces, drawn.origins, drawn.directions
        return counts(drawn, peers.nearest(who, *arrays, progress).triangle)
    return counts(drawn, nearest(who, precision, drawn, progress))


def chosen(kernels: Iterable[Kernel]) -> tuple[list[Kernel], list[Kernel]]:
    """Return the kernels that can be asked for the nearest triangle, and those that cannot."""
    able, unable = [], []
    for kernel in kernels:
        (able if "t" in kernel.outputs and kernel.domain is not None else unable).append(kernel)
    return able, unable


def own_forms(kernels: Iterable[Kernel]) -> list[Kernel]:
    """Return each method in its own way to end, t alone."""
    return [kernel for kernel in kernels if kernel.name == kernel.function.__name__]


def build(bench: Bench) -> None:
    """Time nothing: shoot from inside the meshes, kernels first, then put cases to the peers.

    Peers come last, since a library may change how this process computes; where one does, the
    records say so.
    """
    config = bench.config
    every = "*" in config.kernels
    named = registry.select([name for name in config.kernels if name != "*"])
    known = own_forms(registry.all_kernels().values()) if every else []
    able, unable = chosen(dict.fromkeys([*known, *named]))
    if not able:
        raise RtbenchError("no kernel returns t: which triangle is the nearest cannot be said")
    if unable:
        names = ", ".join(kernel.name for kernel in unable if kernel in named)
        bench.remarks += [f"not asked, since they return no t of a ray: {names}"] if names else []
    bench.tables[schema.LEAKS] = rows = []
    bench.tables[schema.PEERS] = table = []
    drawn = _draw(bench)
    present = _present(bench)
    work = [(k, p) for k in able for p in config.precisions if p in k.precisions]
    whole = len(work) + len(present)
    for place, (kernel, precision) in enumerate(work):
        bench.part(place / whole)
        bench.instance(kernel, precision, kind="nearest")
        key = {"kernel": kernel.name, "precision": precision}
        rows += _everywhere(bench, kernel, precision, drawn, key)
    cases = _cases(bench) if present else None
    for name in BESIDE if present else ():
        if name in registry.all_kernels():
            for precision in config.precisions:
                table.append(scored_kernel(registry.find(name), precision, cases))
    for place, (peer, facts) in enumerate(present):
        bench.part((len(work) + place) / whole)
        key = {"kernel": peer.name, "peer": peer.version, "precision": peer.precision}
        try:
            rows += list(_everywhere(bench, peer, peer.precision, drawn, key))
            bench.say(f"hard cases: {peer.name}")
            table.append(scored_peer(peer, cases))
        except Exception as problem:  # a library that fails must not cost the others' answers
            reason = " ".join(str(problem).split()) or type(problem).__name__
            facts["absent"] = f"failed when it was asked: {reason}"
            bench.remarks.append(f"peer {peer.name} {facts['absent']}")
        facts["float_state"] = machine.float_state()


def _draw(bench: Bench) -> dict[tuple[str, type], Aimed]:
    """Return the rays by place and data type."""
    config = bench.config
    subdivisions = _subdivisions(config.triangles)
    found = {}
    for place, (offset, factor) in PLACES.items():
        mesh = icosphere(subdivisions).scaled(factor).moved(offset)
        for data in (np.float32, np.float64):
            bench.say(f"drawing {config.rays} rays {place}")
            drawn = aimed_rays(mesh, shares(config.rays), data, config.seed)
            found[place, data] = drawn
            bench.workloads.append(
                {
                    "place": place,
                    "offset": list(offset),
                    "radius": factor,
                    "data": np.dtype(data).name,
                    "mesh": mesh.name,
                    "triangles": len(mesh.faces),
                    "rays": len(drawn.origins),
                    "exact": int(np.count_nonzero(drawn.exact)),
                }
            )
    return found


def _subdivisions(triangles: int) -> int:
    """Return how often an icosahedron is cut to have so many triangles."""
    sizes = [20 * 4**k for k in range(7)]
    if triangles not in sizes:
        allowed = ", ".join(map(str, sizes))
        raise RtbenchError(f"triangles {triangles} is not allowed (allowed: {allowed})")
    return sizes.index(triangles)


def _everywhere(bench: Bench, who: Kernel | Peer, precision: str, drawn: dict, key: dict):
    data = np.dtype(precision).type if isinstance(who, Peer) else DATA_TYPE[precision]
    for place in PLACES:
        bench.say(f"leaks of {who.name} in {precision}, {place}")
        rays = drawn[place, data]
        if isinstance(who, Peer) and len(rays.origins) > who.most:
            rays = aimed_rays(rays.mesh, shares(who.most), data, bench.config.seed)
        for row in _counted(who, precision, rays):
            yield key | {"place": place} | row


def _present(bench: Bench) -> list[tuple[Peer, dict]]:
    """Return the peers that can be asked; of all, the records say whether, and which version."""
    found, facts = [], bench.facts.setdefault("peers", [])
    for peer in PEERS:
        why = peers.absence(peer)
        told = {"name": peer.name, "title": peer.title, "absent": why}
        if why is None:
            told["version"] = peer.version
            found.append((peer, told))
        facts.append(told)
    absent = [f"{told['name']} ({told['absent']})" for told in facts if told["absent"]]
    if absent:
        bench.remarks.append(f"peers not asked: {'; '.join(absent)}")
    return found


def _cases(bench: Bench) -> Cases:
    from rtbench.workloads import hard_cases

    bench.say("making hard cases and their exact answers")
    return hard_cases.corpus(bench.config.seed)
