"""The bounding volume hierarchy against embreex: rays per second of one thread, run by hand.

    python tests/speed/bvh_by_hand.py --models bunny dragon

Needs embreex and models (RTBENCH_MODELS, or paths). Rates are of thread CPU time; the ratio is the
median over rounds in which the two take turns. Of every set it is said how many rays the two
disagree about: whether they hit, and by more than 1e-4 how far.
"""

import argparse
import statistics
import time

import numpy as np

SETS = ("primary", "random")


def scene_of(name: str, rays: int):
    """Return triangles, and origins and directions in float32 of each set of rays."""
    from rtbench.workloads.cameras import framing, inside, primary_rays
    from rtbench.workloads.meshes import load_mesh, models
    from rtbench.workloads.ray_sets import INTERIORS, random_rays

    mesh = load_mesh(models().get(name, name))
    look = inside if name in (*INTERIORS, "teapot_in_stadium") else framing
    sets = primary_rays(look(mesh), 1024, 768)[:2], random_rays(mesh, rays)
    return mesh.triangles.astype(np.float32), [
        [np.ascontiguousarray(each, np.float32) for each in given] for given in sets
    ]


def best_build(geometry, options):
    """Return a tree, and the least seconds that it took in three builds after one."""
    from rtbench.trees.bvh.build import build

    made, took = build(geometry, options), []
    for _ in range(3):
        begin = time.thread_time()
        made = build(geometry, options)
        took.append(time.thread_time() - begin)
    return made, min(took)


def contestants(kernel: str, geometry, bvh, embree, origins, directions):
    """Return functions that trace all rays, and in how many answers they disagree."""
    from rtbench.kernels.registry import find
    from rtbench.trees import leaves
    from rtbench.trees.bvh import nodes, wide

    chosen = find(kernel)
    form = leaves.form_of(chosen, "float32")
    read = nodes.leaves_of(chosen, "float32", geometry, bvh, form)
    records = leaves.rays(chosen, "float32", origins, directions)
    scene = np.concatenate([geometry.base, geometry.box, [geometry.reach]])
    n = len(records)
    outcome, t = np.empty(n, np.int32), np.empty(n, np.float32)
    both = len(chosen.outputs) == 3
    u, v = (np.empty(n if both else 0, np.float32) for _ in range(2))
    order = np.zeros(1, np.uint64), np.arange(n, dtype=np.uint64)
    walk = wide.walk(chosen, "float32", "nearest", form).call

    def ours():
        none = np.empty((0, 3), np.int32)
        walk(read.nodes, read.refs, read.triangles, scene, records, *order, outcome, t, u, v, none)

    def theirs():
        return embree.run(origins, directions, output=True)

    ours()
    told = theirs()
    hit, other = outcome >= 0, told["primID"] != -1
    both = hit & other
    far = np.abs(t[both] - told["tfar"][both]) > 1e-4 * np.abs(told["tfar"][both])
    return (ours, theirs), (int((hit != other).sum()), int(far.sum()))


def timed(run) -> float:
    begin = time.thread_time()
    run()
    return time.thread_time() - begin


def main() -> None:
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    from rtbench.trees.bvh.build import DEFAULT
    from rtbench.trees.bvh.quality import quality
    from rtbench.trees.geometry import Geometry

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", nargs="*", default=["bunny", "dragon", "buddha", "sponza"])
    parser.add_argument("--kernels", nargs="*", default=["moller_trumbore"])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--rays", type=int, default=300_000)
    options = parser.parse_args()
    for name in options.models:
        triangles, sets = scene_of(name, options.rays)
        geometry = Geometry.of(triangles)
        bvh, took = best_build(geometry, DEFAULT)
        told = quality(bvh, geometry)
        print(
            f"{name}: {len(geometry):,} triangles, {took:.3f} s, {told['bytes'] / 1e6:.1f} MB, "
            f"expected steps {told['expected_steps']:.2f}, leaves {told['expected_leaves']:.2f}"
        )
        embree = rtcore_scene.EmbreeScene()
        TriangleMesh(embree, triangles)
        for kernel in options.kernels:
            for which, rays in zip(SETS, sets, strict=True):
                runs, differ = contestants(kernel, geometry, bvh, embree, *rays)
                times = [[timed(run) for run in runs] for _ in range(options.rounds)]
                ratio = statistics.median(other / own for own, other in times)
                rates = [
                    len(rays[0]) / statistics.median(each) / 1e6
                    for each in zip(*times, strict=True)
                ]
                print(
                    f"  {kernel:<20}{which:<8} {rates[0]:6.2f} Mray/s, embreex {rates[1]:6.2f}, "
                    f"ratio {ratio:.2f}; {differ[0]} and {differ[1]} of {len(rays[0]):,} differ",
                    flush=True,
                )


if __name__ == "__main__":
    main()
