"""A mesh as a scene: framed, matte, in the light of one lamp."""

from __future__ import annotations

import os

import numpy as np

from rtbench.errors import RtbenchError, unknown
from rtbench.scenes.model import Camera, Light, Material, Scene, SceneError, Triangles
from rtbench.workloads import cameras
from rtbench.workloads.generated_models import MODELS, find_model
from rtbench.workloads.meshes import Mesh, load_mesh
from rtbench.workloads.meshes import models as files_of

SIDE = 512  # pixels
GREY = Material(ambient=(0.12, 0.12, 0.12), diffuse=(0.75, 0.75, 0.75), name="grey")
SKY = (0.62, 0.68, 0.75)
ASIDE, UP = 0.45, 0.6  # of the way to the middle: where the light is, seen from the camera
NEARBY = 0.25  # of the smallest side of a room, which takes the place of the way there
WITHIN = 0.02  # of a room, how far from its walls the light stays


def read(name: str | os.PathLike, models: str | os.PathLike | None = None) -> Scene:
    """Return a mesh as a scene with a camera, a light and a material.

    Parameters
    ----------
    name : str or path
        A mesh file; a name among the models; or that of a generated one, as `find_model` takes it:
        ``robots:20000``.
    models : path, optional
        The folder of mesh files; what RTBENCH_MODELS names if not given.

    Returns
    -------
    Scene
        One object. Triangles that are invalid or have no area are left out, and that is remarked.

    Raises
    ------
    SceneError
        ``scene``: unknown names, with the nearest one; files that are no meshes.
    """
    text = os.fspath(name)
    try:
        mesh = _found(text, models)
        camera = camera_of(mesh)
        return Scene(
            name=mesh.name,
            camera=camera,
            lights=(Light(position=_light(camera, mesh), color=(1.0, 1.0, 1.0)),),
            materials=(GREY,),
            # The mesh's own array: a model of many millions is in memory once.
            objects=(Triangles(corners=mesh.triangles, name=mesh.name),),
            background=SKY,
            source=text,
            remarks=(mesh.remark,) if mesh.remark else (),
        )
    except SceneError as problem:
        raise SceneError("scene", f"mesh {text!r}: {problem}") from None
    except RtbenchError as problem:
        raise SceneError("scene", str(problem)) from None


def _found(text: str, models: str | os.PathLike | None) -> Mesh:
    if models is not None and not os.path.isfile(text):
        there = files_of(models)
        if text in there:
            return load_mesh(there[text], drop_invalid=True, drop_degenerate=True)
        kind = text.partition(":")[0]
        if kind not in MODELS and not os.path.splitext(text)[1]:
            raise RtbenchError(unknown("model", kind, [*there, *MODELS]))
    return find_model(text, drop_invalid=True, drop_degenerate=True)


def camera_of(mesh: Mesh) -> Camera:
    """Return the camera that is recommended for a mesh, for a square picture.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    Camera
        Wide pictures show more at the sides.
    """
    special = mesh.name in cameras.RECOMMENDED or cameras.dense_part(mesh) is not None
    found = cameras.recommended(mesh) if special else cameras.framing(mesh, 1.0)
    # Across the shorter side, which in a square picture is any.
    return Camera(found.position, found.target, found.up, found.field_of_view, SIDE, SIDE)


def _light(camera: Camera, mesh: Mesh) -> tuple[float, float, float]:
    """Return a place above the camera and beside it, that shadows fall to be seen."""
    right, up, _ = camera.axes
    here = np.asarray(camera.position)
    lower, upper = cameras.bounds(mesh)
    size = upper - lower
    indoors = bool(((lower < here) & (here < upper)).all())
    # Indoors what is further away may be behind a wall.
    far = min(camera.distance, NEARBY * float(size.min())) if indoors else camera.distance
    place = here + far * (UP * up - ASIDE * right)
    if indoors:
        place = np.clip(place, lower + WITHIN * size, upper - WITHIN * size)
    x, y, z = place.tolist()
    return x, y, z
