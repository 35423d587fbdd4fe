"""A scene as the compiled tracer reads it: arrays of records, and the tree over what is in it.

Positions are local: taken, in float64, from near the middle of the scene, and then rounded. So a
scene far from (0, 0, 0) loses nothing but what its own file rounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rtbench.compiled.layout import REAL_TYPE
from rtbench.kernels.contract import Kernel
from rtbench.scenes.model import Cone, Disc, Plane, Scene, Sphere, Triangles
from rtbench.shapes import records as shape_records
from rtbench.tracer import leaf_table, records
from rtbench.tracer.options import Options
from rtbench.trees import leaves, ways
from rtbench.trees.building import build
from rtbench.trees.geometry import Geometry, outward
from rtbench.trees.traversal import entering

LIGHT_CODES = {"point": 0, "directional": 1, "spot": 2, "rectangle": 3, "sphere": 4}
SAMPLED = ("antialiasing", "glossy", "dispersion", "depth_of_field", "motion_blur")
MARGIN = 16  # roundings of a coordinate that a point computed from a primitive may be off by


@dataclass(frozen=True, eq=False)
class World:
    """A scene's arrays: those of the tree, and those of what is in it.

    Attributes
    ----------
    base : (3,) float64 array
        From where local positions are taken.
    arrays : dict of str to array
        By the names by which the compiled tracer knows them, in its order.
    kinds : frozenset of str
        What there is: triangles, spheres, cones, discs, planes, motion, fresnel.
    form : str
        How triangles lie in leaves, see `rtbench.trees.leaves`.
    structure : str
        kd or bvh.
    planes : int
        Shapes without an end, which no tree holds; they come last.
    waiting : int
        How many rays may wait at once.
    corners : (T, 3, 3) array
        Of the triangles, local.
    boxes : (P, 6) float32 array
        Of all that the tree holds, taken from ``tree_base``, (3,) float64.
    places : (P,) int64 array
        Where the tree holds each of them.
    parts : (n, 6) float32 array
        Boxes of groups of neighbours, no more than PARTS, that hold all of them.
    """

    base: np.ndarray
    arrays: dict[str, np.ndarray]
    kinds: frozenset[str]
    form: str
    structure: str
    planes: int
    waiting: int
    corners: np.ndarray
    boxes: np.ndarray
    tree_base: np.ndarray
    places: np.ndarray
    parts: np.ndarray


PARTS = 512
KIND_NAMES = {Sphere: "spheres", Cone: "cones", Disc: "discs", Plane: "planes"}


def world_of(
    scene: Scene, options: Options, kernel: Kernel, effects: dict[str, bool], progress=None
) -> World:
    """Return a scene as the compiled tracer reads it.

    Parameters
    ----------
    scene : Scene
    options : Options
    kernel : Kernel
        What tests triangles.
    effects : dict of str to bool
        Which are compiled in.
    progress : callable, optional
        Called with the fraction of the tree that is built.

    Raises
    ------
    RtbenchError, ValueError
        What trees refuse.
    """
    real = REAL_TYPE[options.precision]
    meshes = [each for each in scene.objects if isinstance(each, Triangles) and len(each.corners)]
    shapes = [each for each in scene.objects if isinstance(each, (Sphere, Cone, Disc))]
    planes = [each for each in scene.objects if isinstance(each, Plane)]
    moving = effects["motion_blur"] and any(any(each.velocity) for each in scene.objects)
    base = _base(scene, meshes, shapes)
    corners = [np.asarray(each.corners, np.float64) - base for each in meshes]
    corners = np.concatenate([np.zeros((0, 3, 3)), *corners]).astype(real)
    bounded = _shapes([*shapes, *planes], base, real)
    counts = [len(each.corners) for each in meshes]
    owners = [*meshes, *shapes, *planes]
    each_has = np.array([*counts, *(1 for _ in (*shapes, *planes))], np.int64)
    material_of = np.repeat(np.array([o.material for o in owners], np.int32), each_has)
    velocities = np.repeat(
        np.array([o.velocity for o in owners], real).reshape(-1, 3), each_has, axis=0
    )
    if not moving:
        velocities = np.zeros((len(material_of) if "motion" in options.kinds else 1, 3), real)
    geometry = _geometry(
        corners, bounded[: len(shapes)], velocities if moving else None, options.precision
    )
    kinds = {KIND_NAMES[type(each)] for each in (*shapes, *planes)} | set(options.kinds)
    kinds |= {"triangles"} if len(corners) else set()
    kinds |= {"motion"} if moving else set()
    used = (scene.materials[each.material] for each in owners)
    kinds |= {"fresnel"} if any(each.fresnel and each.reflects for each in used) else set()
    form = leaves.form_of(kernel, options.precision)
    # Of one ray, a filter's lanes cost more than its few triangles one by one (measured: 0.73 to
    # 0.95 of the time of blocks; of Möller-Trumbore 1.08 to 1.36).
    if "motion" in kinds or not len(corners) or kernel.fallback is not None:
        form = leaves.ONE_BY_ONE
    given = {"structure": options.structure, "rule": options.rule, "builder": options.builder}
    if shapes or moving:
        given["overlap"] = "box"  # a shape is as large as its box, and what moves is everywhere
    chosen = ways.options(form, **given)
    built = build(geometry, chosen, progress)
    among = bool(kinds & {"spheres", "cones", "discs"})
    table = leaf_table.table_of(
        kernel, options.precision, geometry, built, len(corners), form, among
    )
    normals, coordinates, smooth = _of_corners(meshes, counts, effects, real)
    textures, texels, texture_of = _textures(scene, base, real)
    extent = 2.0 * float(np.abs(geometry.box).max())
    known = entering.margins(extent, geometry.reach, options.precision)
    tree = np.concatenate([geometry.base, geometry.box, [geometry.reach], known])
    tree = tree.astype(np.float64)
    arrays = {
        "nodes": table.nodes,
        "refs": table.refs,
        "triangles": table.triangles,
        "leaves": table.leaves,
        "scene": tree,
        "faces": _faces(corners, smooth, real),
        "normals": normals,
        "coordinates": coordinates,
        "shapes": bounded,
        "material_of": material_of,
        "velocities": velocities,
        "materials": _materials(scene, texture_of, real),
        "lights": _lights(scene, base, effects, real),
        "textures": textures,
        "texels": texels,
    }
    grids = int(np.sum(arrays["lights"]["grid"] ** 2))
    # Each generation leaves two rays waiting, or four where colours part, and those through glass.
    generations = max(_depth(scene, options), 1)
    if effects["indirect"] and scene.settings.indirect is not None:
        generations = max(generations, scene.settings.indirect.depth)
    most = 64 + (4 + grids) * (generations + 2)
    return World(
        base,
        arrays,
        frozenset(kinds),
        form,
        options.structure,
        len(planes),
        most,
        corners,
        geometry.boxes,
        geometry.base,
        table.places,
        _parts(geometry.boxes, built.refs),
    )


def settings_of(
    scene: Scene, options: Options, effects: dict[str, bool], planes: int
) -> np.ndarray:
    """Return the settings as the compiled tracer reads them, (1,)."""
    record = np.zeros(1, records.settings_type(REAL_TYPE[options.precision]))
    settings, indirect = scene.settings, scene.settings.indirect
    record["background"], record["planes"] = scene.background, planes
    record["threshold"] = settings.threshold if options.threshold is None else options.threshold
    record["depth"] = _depth(scene, options)
    samples = settings.samples if options.samples is None else options.samples
    if indirect is not None and effects["indirect"]:
        samples = indirect.samples if options.samples is None else options.samples
        record["bounces"] = indirect.depth
        record["noise"] = indirect.noise or 0.0
    elif not any(effects[name] for name in SAMPLED):
        samples = 1
    side = max(1, int(np.sqrt(samples)))
    record["samples"], record["side"] = side * side, side
    record["stride"] = _stride(side * side)
    if options.subsampling is not None:
        chosen = options.subsampling
        record["grid_x"], record["grid_y"] = chosen.grid
        record["tolerance"] = chosen.tolerance
        record["bilinear"] = chosen.interpolation == "bilinear"
    return record


def _depth(scene: Scene, options: Options) -> int:
    return scene.settings.depth if options.depth is None else options.depth


def _stride(count: int) -> int:
    """Return a number without a common factor with ``count``, near its golden section."""
    stride = max(1, round(0.618 * count))
    while np.gcd(stride, count) != 1:
        stride += 1
    return stride


def _base(scene: Scene, meshes: list, shapes: list) -> np.ndarray:
    """Return the middle of what has an end, else of where the camera looks."""
    points = [np.asarray(each.corners, np.float64).reshape(-1, 3) for each in meshes]
    low = [each.min(axis=0) for each in points]
    high = [each.max(axis=0) for each in points]
    for each in shapes:
        box = shape_records.boxes(_shapes([each], np.zeros(3), np.float64))[0]
        low.append(box[:3])
        high.append(box[3:])
    if not low:
        return np.asarray(scene.camera.target, np.float64)
    return np.min(low, axis=0) / 2 + np.max(high, axis=0) / 2


def _shapes(shapes: list, base: np.ndarray, real: type) -> np.ndarray:
    made = [np.zeros(0, shape_records.shape_type(real))]
    for each in shapes:
        if isinstance(each, Sphere):
            record = shape_records.sphere(np.subtract(each.center, base), each.radius, real)
        elif isinstance(each, Cone):
            ends = np.subtract(each.base, base), np.subtract(each.apex, base)
            record = shape_records.cone(*ends, each.base_radius, each.apex_radius, real)
        elif isinstance(each, Disc):
            middle = np.subtract(each.center, base)
            record = shape_records.disc(middle, each.normal, each.radius, real)
        else:
            record = shape_records.plane(np.subtract(each.point, base), each.normal, real)
        made.append(np.atleast_1d(record))
    return np.concatenate(made)


def _geometry(corners, shapes, velocities, precision) -> Geometry:
    """Return the boxes of triangles and shapes, wherever they are while the shutter is open."""
    if not len(shapes) and velocities is None:
        return Geometry.of(corners, precision)
    boxes = np.concatenate(
        [
            np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1),
            shape_records.boxes(shapes),
        ]
    ).astype(np.float64)
    if velocities is not None:
        way = velocities[: len(boxes)].astype(np.float64)
        slack = np.abs(way) * 2.0**-20
        boxes[:, :3] += np.minimum(way, 0) - slack
        boxes[:, 3:] += np.maximum(way, 0) + slack
    # Only the boxes are looked at: what stands for the corners lies in them.
    instead = np.stack([boxes[:, :3], boxes[:, 3:], boxes[:, 3:]], axis=1)
    made = Geometry.of(instead, "float64")
    low = outward(boxes[:, :3] - made.base, -np.inf)
    high = outward(boxes[:, 3:] - made.base, np.inf)
    return Geometry(
        corners,
        made.base,
        np.ascontiguousarray(np.concatenate([low, high], axis=1)),
        made.box,
        made.reach,
    )


def _faces(corners: np.ndarray, smooth: np.ndarray, real: type) -> np.ndarray:
    """Return what shading reads of triangles: normals, and bounds of what is rounded."""
    faces = np.zeros(len(corners), records.face_type(real))
    double = corners.astype(np.float64)
    for k, name in enumerate(("v0", "v1", "v2")):
        faces[name] = corners[:, k]
    e, f = double[:, 1] - double[:, 0], double[:, 2] - double[:, 0]
    normal = np.cross(e, f)
    twice = np.linalg.norm(normal, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = normal / twice[:, None]
    unit[~(twice > 0)] = (0.0, 0.0, 1.0)  # nothing hits it
    faces["normal"] = unit
    rounding = MARGIN * float(np.finfo(real).eps)
    reach = np.abs(double).max(axis=(1, 2), initial=0.0)
    faces["margin"] = rounding * reach
    longest = np.sqrt(np.maximum.reduce([_square(e), _square(f), _square(f - e)]))
    with np.errstate(invalid="ignore", divide="ignore"):
        height = twice / longest
        inset = 2 * rounding * reach / height
    faces["inset"] = np.where(inset < 0.25, inset, 0.25)
    faces["smooth"] = smooth
    return faces


def _square(vectors: np.ndarray) -> np.ndarray:
    return (vectors * vectors).sum(axis=1)


def _parts(boxes: np.ndarray, refs: np.ndarray) -> np.ndarray:
    """Return what is around groups of boxes that a tree holds side by side."""
    if not len(refs):
        return np.zeros((0, 6), np.float32)
    begin = np.unique(np.linspace(0, len(refs), PARTS, endpoint=False).astype(np.int64))
    held = boxes[refs]
    low = np.minimum.reduceat(held[:, :3], begin)
    return np.concatenate([low, np.maximum.reduceat(held[:, 3:], begin)], axis=1)


def _of_corners(meshes, counts, effects, real):
    """Return normals (T, 3, 3), image coordinates (T, 3, 2) and whether normals are given (T,)."""
    total = sum(counts)
    has = np.repeat([each.normals is not None for each in meshes], counts).astype(np.int64)
    normals, coordinates = np.zeros((1, 3, 3), real), np.zeros((1, 3, 2), real)
    begin = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    if effects["smooth_normals"]:
        normals = np.zeros((max(1, total), 3, 3), real)
        for k, each in enumerate(meshes):
            if each.normals is not None:
                given = np.asarray(each.normals, np.float64)
                length = np.linalg.norm(given, axis=2, keepdims=True)
                with np.errstate(invalid="ignore", divide="ignore"):
                    normals[begin[k] : begin[k + 1]] = np.where(length > 0, given / length, 0.0)
    if effects["texture"]:
        coordinates = np.zeros((max(1, total), 3, 2), real)
        for k, each in enumerate(meshes):
            if each.coordinates is not None:
                coordinates[begin[k] : begin[k + 1]] = each.coordinates
    return normals, coordinates, has


def _materials(scene: Scene, texture_of: list[int], real: type) -> np.ndarray:
    made = np.zeros(len(scene.materials), records.material_type(real))
    for record, each, texture in zip(made, scene.materials, texture_of, strict=True):
        record["ambient"] = np.multiply(each.ambient, scene.ambient)
        for name in ("diffuse", "specular", "reflection", "transmission", "emission"):
            record[name] = getattr(each, name)
        record["diffuse_roughness"] = np.radians(each.diffuse_roughness)
        for name in ("exponent", "index", "roughness"):
            record[name] = getattr(each, name)
        record["abbe"] = 0.0 if each.index == 1.0 else each.abbe or 0.0
        record["is_blinn"] = each.highlight == "blinn_phong"
        record["fresnel"], record["transmits"] = each.fresnel, each.transmits
        record["texture"] = texture
    return made


def _lights(scene: Scene, base: np.ndarray, effects: dict[str, bool], real: type) -> np.ndarray:
    made = np.zeros(len(scene.lights), records.light_type(real))
    for record, each in zip(made, scene.lights, strict=True):
        record["position"] = np.subtract(each.position, base)
        length = np.linalg.norm(each.direction)
        record["direction"] = np.asarray(each.direction) / (length or 1.0)
        for name in ("color", "edge_u", "edge_v", "radius", "shadows"):
            record[name] = getattr(each, name)
        record["kind"] = LIGHT_CODES[each.kind]
        record["falls_off"] = each.falloff == "inverse_square"
        record["cos_inner"], record["cos_outer"] = np.cos(np.radians([each.inner, each.outer]))
        record["area"] = each.is_area
        record["grid"] = each.grid if each.is_area and effects["soft_shadows"] else 1
    return made


def _textures(scene: Scene, base: np.ndarray, real: type):
    """Return the textures (n,), the images' numbers in a row, and each material's texture or -1."""
    distinct = list({id(m.texture): m.texture for m in scene.materials if m.texture}.values())
    made = np.zeros(max(1, len(distinct)), records.texture_type(real))
    texels = [np.zeros(3, np.float32)]
    for record, each in zip(made, distinct, strict=False):
        record["color"], record["other"], record["size"] = each.color, each.other, each.size
        record["origin"] = np.mod(base, 2 * each.size)
        if each.pixels is not None:
            record["is_image"] = 1
            record["offset"] = sum(len(t) for t in texels)
            record["height"], record["width"] = each.pixels.shape[:2]
            texels.append(np.ascontiguousarray(each.pixels, np.float32).reshape(-1))
    places = {id(each): k for k, each in enumerate(distinct)}
    texture_of = [places[id(m.texture)] if m.texture else -1 for m in scene.materials]
    return made, np.concatenate(texels), texture_of
