"""What other libraries take and give: each adapter makes a scene and returns who answers for it.

``adapter(vertices, faces)`` takes (V, 3) and (M, 3) arrays and returns a function ``ask(origins,
directions)``, which takes (N, 3) arrays and returns four (N,) arrays: the nearest triangle (-1:
none) and t, u, v, NaN where the library does not tell; t in units of the direction, u the weight of
v1 and v of v2.
The library is imported by the adapter, since it may not be there and may take seconds.
"""

# No postponed annotations: warp reads them as objects.
import functools

import numpy as np


def embree(vertices, faces, robust=False):
    """Embree by embreex, which sets no flag of the scene but ``robust``."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=robust)
    # It is the scene that must live, and it knows nothing of who made the mesh.
    mesh = TriangleMesh(scene, vertices.astype(np.float32), faces.astype(np.int32))

    def ask(origins, directions):
        far = np.full(len(origins), np.inf, np.float32)
        rays = (np.ascontiguousarray(a, np.float32) for a in (origins, directions))
        found = scene.run(*rays, dists=far, output=1)
        return _told(found["primID"], found["tfar"], found["u"], found["v"])

    ask.keeps = mesh
    return ask


def embree_robust(vertices, faces):
    """Embree by embreex with RTC_SCENE_FLAG_ROBUST."""
    return embree(vertices, faces, robust=True)


def trimesh_embree(vertices, faces):
    """trimesh with embreex: it moves and scales the scene and normalises directions."""
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    mesh = RayMeshIntersector(Trimesh(vertices, faces, process=False))
    return lambda origins, directions: _told(mesh.intersects_first(origins, directions))


def trimesh_numpy(vertices, faces):
    """trimesh alone: candidates by an R-tree (rtree), tests in numpy with tolerances."""
    from trimesh import Trimesh
    from trimesh.ray.ray_triangle import RayMeshIntersector

    mesh = RayMeshIntersector(Trimesh(vertices, faces, process=False))

    def ask(origins, directions):
        index, rays, places = mesh.intersects_id(
            origins, directions, return_locations=True, multiple_hits=False
        )
        triangle, t = np.full(len(origins), -1), np.full(len(origins), np.nan)
        triangle[rays] = index
        if len(rays):
            o, d = (np.asarray(a, np.float64)[rays] for a in (origins, directions))
            t[rays] = ((places - o) * d).sum(axis=1) / (d * d).sum(axis=1)
        return _told(triangle, t)

    return ask


def open3d(vertices, faces):
    """open3d's RaycastingScene, which is Embree too."""
    from open3d.core import Tensor
    from open3d.t.geometry import RaycastingScene

    scene = RaycastingScene()
    scene.add_triangles(Tensor(vertices.astype(np.float32)), Tensor(faces.astype(np.uint32)))

    def ask(origins, directions):
        rays = np.concatenate([origins, directions], axis=1).astype(np.float32)
        found = {name: value.numpy() for name, value in scene.cast_rays(Tensor(rays)).items()}
        triangle = found["primitive_ids"].astype(np.int64)
        triangle[triangle == scene.INVALID_ID] = -1
        return _told(triangle, found["t_hit"], *found["primitive_uvs"].T)

    return ask


def mitsuba(vertices, faces):
    """mitsuba in its variant llvm_ad_rgb."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    mesh = mi.Mesh("mesh", len(vertices), len(faces))
    fields = mi.traverse(mesh)
    fields["vertex_positions"] = vertices.astype(np.float32).ravel()
    fields["faces"] = faces.astype(np.uint32).ravel()
    fields.update()
    scene = mi.load_dict({"type": "scene", "mesh": mesh})

    def ask(origins, directions):
        rays = (np.array(a.T, np.float32, order="C") for a in (origins, directions))
        ray = mi.Ray3f(*(kind(a) for kind, a in zip((mi.Point3f, mi.Vector3f), rays, strict=True)))
        found = scene.ray_intersect_preliminary(ray, coherent=False)
        triangle = np.array(found.prim_index).astype(np.int64)
        triangle[~np.array(found.is_valid())] = -1
        return _told(triangle, found.t, *np.array(found.prim_uv))

    return ask


def warp(vertices, faces):
    """warp's mesh_query_ray on the processor."""
    import warp as wp

    wp.config.quiet = True
    here = {"device": "cpu"}
    points = wp.array(vertices.astype(np.float32), dtype=wp.vec3, **here)
    mesh = wp.Mesh(points, wp.array(faces.astype(np.int32).ravel(), dtype=int, **here))

    def ask(origins, directions):
        n = len(origins)
        rays = [
            wp.array(np.ascontiguousarray(a, np.float32), dtype=wp.vec3, **here)
            for a in (origins, directions)
        ]
        face = wp.zeros(n, dtype=int, **here)
        values = [wp.zeros(n, dtype=float, **here) for _ in range(3)]
        wp.launch(_warp_kernel(), n, [mesh.id, *rays], [face, *values], **here)
        t, u, v = (value.numpy().astype(np.float64) for value in values)
        return _told(face.numpy(), t, v, 1 - u - v)  # its u and v weigh v0 and v1

    return ask


@functools.cache
def _warp_kernel():
    import warp as wp

    def nearest(
        mesh: wp.uint64,
        origins: wp.array(dtype=wp.vec3),
        directions: wp.array(dtype=wp.vec3),
        face: wp.array(dtype=int),
        t: wp.array(dtype=float),
        u: wp.array(dtype=float),
        v: wp.array(dtype=float),
    ):
        i = wp.tid()
        found = wp.mesh_query_ray(mesh, origins[i], directions[i], 3.0e38)
        face[i] = -1
        if found.result:
            face[i] = found.face
            t[i] = found.t
            u[i] = found.u
            v[i] = found.v

    return wp.kernel(nearest)


def igl(vertices, faces):
    """libigl's AABB tree, in double precision."""
    import igl

    corners, indices = vertices.astype(np.float64), faces.astype(np.int64)
    tree = igl.AABB()
    tree.init(corners, indices)

    def ask(origins, directions):
        rays = (np.ascontiguousarray(a, np.float64) for a in (origins, directions))
        triangle, t, weights = tree.intersect_ray_first(corners, indices, *rays)
        return _told(triangle, t, *weights.T)

    return ask


def pyvista(vertices, faces):
    """VTK by pyvista's ray_trace: a segment a ray, which must end somewhere; a ray at a time."""
    from pyvista import PolyData

    mesh = PolyData(
        vertices.astype(np.float64), np.insert(faces.astype(np.int64), 0, 3, axis=1).ravel()
    )

    def ask(origins, directions):
        o, d = (np.asarray(a, np.float64) for a in (origins, directions))
        triangle, t = np.full(len(o), -1), np.full(len(o), np.nan)
        for k in range(len(o)):
            beyond = 2 * np.abs(vertices - o[k]).max() * 3 / np.linalg.norm(d[k])
            place, cell = mesh.ray_trace(o[k], o[k] + beyond * d[k], first_point=True)
            if len(cell):
                triangle[k] = cell[0]
                t[k] = (place - o[k]) @ d[k] / (d[k] @ d[k])
        return _told(triangle, t)

    return ask


def _told(triangle, *values):
    """Return what an adapter tells, t, u, v being NaN on a miss and where nothing is told."""
    triangle = np.asarray(triangle).astype(np.int64)
    told = [np.array(value, dtype=np.float64) for value in values]
    told += [np.full(len(triangle), np.nan) for _ in range(3 - len(told))]
    for value in told:
        value[triangle < 0] = np.nan
    return triangle, *told
