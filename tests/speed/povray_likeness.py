"""Whether rtbench's pictures are those of POV-Ray and tachyon; used by against_povray.py."""

import math
from dataclasses import replace

import numpy as np
import povray_runs
import povray_scenes

RANKS = {"s": 0, "c": 0, "p": 1, "pp": 2}  # the order in which rtbench's reader gathers a fill
TACHYON_ANGLE = math.degrees(2 * math.atan(0.5))  # whatever the file says

HEADS = ["scene", "rtbench", "other object %", "hit or not %", "tachyon's hits %"]
HEADS += ["colour > 2/255 %", "greatest / 255", "SSIM"]


def seen_by_others(pov: str, nff: str, size: int, with_tachyon: bool):
    """Return the number of the object in each pixel by POV-Ray, and what tachyon hits."""
    theirs = codes(povray_runs.povray(povray_scenes.objects(pov, nff), size, flat=True).pixels)
    if not with_tachyon:
        return theirs, None
    lone = povray_scenes.for_tachyon(nff)
    return theirs, povray_runs.tachyon(lone, size, 0, flat=True).pixels[..., 0] > 0


def differences(scene, nff: str, chosen, seen, ours, theirs) -> list[str]:
    """Return in how many pixels the pictures of a variant differ, for HEADS."""
    from rtbench.images.comparison import compare
    from rtbench.tracer.render import Renderer

    objects, hit = seen
    renderer = Renderer(numbered(scene, nff), chosen)
    own = codes(renderer.render().pixels)
    fanned = "-"
    if hit is not None:
        fanned = f"{100 * np.mean(by_corners(renderer, scene.camera) != hit[1::2, 0:-1:2]):.3f}"
    told = compare(np.clip(np.asarray(ours, np.float64), 0, 1), theirs, "linear")
    return [
        f"{100 * np.mean(own != objects):.3f}",
        f"{100 * np.mean((own > 0) != (objects > 0)):.3f}",
        fanned,
        f"{100 * told.above_two_steps:.3f}",
        f"{255 * told.greatest:.1f}",
        f"{told.structural_similarity:.5f}",
    ]


def by_corners(renderer, camera) -> np.ndarray:
    """Return whether something is hit, in every other row and column of tachyon's picture.

    tachyon's rays go through the corners of its pixels, not through their middles: in a picture
    one and a half times as large there is the middle of a pixel on every other corner.
    """
    size = camera.width * 3 // 2
    finer = replace(camera, angle=TACHYON_ANGLE, width=size, height=size)
    mirrored = codes(renderer.render(camera=finer).pixels)[:, ::-1] > 0
    return mirrored[1::3, 1::3]


def numbered(scene, nff: str):
    """Return the scene with each of the file's objects sending its number as a colour."""
    from rtbench.scenes.model import BLACK, Material, Triangles

    entities = povray_scenes.entities(nff)
    order = sorted(range(len(entities)), key=lambda n: (entities[n][0], RANKS[entities[n][1]], n))
    numbers = iter(order)
    objects = []
    for each in scene.objects:
        if not isinstance(each, Triangles):
            objects.append(replace(each, material=next(numbers)))
            continue
        at = 0
        while at < len(each.corners):
            number = next(numbers)
            part = slice(at, at + entities[number][2])
            normals = None if each.normals is None else each.normals[part]
            objects.append(
                replace(each, corners=each.corners[part], normals=normals, material=number)
            )
            at = part.stop
    if next(numbers, None) is not None or len(objects) != len(entities):
        raise SystemExit("rtbench's reader gathers the file's objects in another way than expected")
    materials = tuple(
        Material(diffuse=BLACK, emission=tuple(part / 255 for part in povray_scenes.code(number)))
        for number in range(1, len(entities) + 1)
    )
    return replace(scene, lights=(), background=BLACK, materials=materials, objects=tuple(objects))


def codes(pixels: np.ndarray) -> np.ndarray:
    """Return the number that each pixel's colour stands for."""
    return np.rint(np.asarray(pixels, np.float64) * 255).astype(np.int64) @ [65536, 256, 1]
