"""The models of a tree experiment, and the rays that are sent at them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.experiments.config import Config
from rtbench.experiments.tree_config import MODELS
from rtbench.measure.arrays import Arrays
from rtbench.workloads import aimed, cameras, ray_sets
from rtbench.workloads.generated_models import MODELS as GENERATED
from rtbench.workloads.generated_models import find_model
from rtbench.workloads.meshes import Mesh, models


@dataclass(frozen=True)
class Model:
    """A model whose arrays lie with `rtbench.measure.arrays.Arrays`.

    Attributes
    ----------
    name : str
        As the records name it.
    triangles : int
    message : dict
        What a worker must know: paths of ``vertices`` and ``faces``, and of the rays by set.
    facts : dict
        For the records.
    ray_sets : tuple of str
        That it has; shadow rays are made by the worker.
    remarks : tuple of str
    """

    name: str
    triangles: int
    message: dict
    facts: dict
    ray_sets: tuple[str, ...]
    remarks: tuple[str, ...]


def names(config: Config) -> list[str]:
    """Return the models of a config that there are.

    Raises
    ------
    RtbenchError
        Where none is.
    """
    there = models()
    found = [
        each.removesuffix("?")
        for each in config.models or MODELS
        if not each.endswith("?") or each[:-1] in there or os.path.isfile(each[:-1])
    ]
    if not found:
        raise RtbenchError(
            f"none of the models {', '.join(config.models)} is there: RTBENCH_MODELS names their "
            "folder"
        )
    return found


def mesh_of(name: str, config: Config) -> Mesh:
    """Return the mesh of a name as float32 can hold it."""
    mesh = find_model(name, config.triangles, config.drop_invalid)
    with np.errstate(over="ignore"):
        mesh = mesh.rounded(np.float32)
    if not np.isfinite(mesh.vertices).all():
        raise RtbenchError(f"model {name!r} has coordinates that float32 cannot hold")
    return mesh


def load(name: str, config: Config, arrays: Arrays) -> Model:
    """Load or generate a model and draw its rays."""
    mesh = mesh_of(name, config)
    generated = name.partition(":")[0] in GENERATED and not os.path.isfile(name)
    label = name if generated or name in models() else Path(name).stem
    camera = cameras.recommended(mesh)
    light = ray_sets.light_of(mesh)
    paths, remarks = {}, [mesh.remark] if mesh.remark else []
    for which in config.ray_sets:
        if which == "shadow":
            continue
        try:
            drawn = _DRAWN[which](mesh, config, camera)
        except RtbenchError as problem:
            if which != "aimed":
                raise
            remarks.append(f"no aimed rays: {problem}")
            continue
        paths[which] = {
            part: arrays.paths[arrays.add(f"{label}|{which}|{part}", values)]
            for part, values in drawn.items()
        }
    parts = {"vertices": mesh.vertices.astype(np.float32), "faces": mesh.faces.astype(np.int32)}
    stored = {
        part: arrays.paths[arrays.add(f"{label}|{part}", values)] for part, values in parts.items()
    }
    facts = {
        "model": label,
        "triangles": len(mesh.faces),
        "source": "generated" if generated else "file",
        "camera": {
            "position": list(camera.position),
            "target": list(camera.target),
            "up": list(camera.up),
            "field_of_view": camera.field_of_view,
        },
        "light": light.tolist(),
        "closed": mesh.closed,
        "degenerate": mesh.degenerate,
        "dropped": mesh.dropped,
        "bounds": [corner.tolist() for corner in cameras.bounds(mesh)],
    }
    message = stored | {"rays": paths, "light": light.tolist()}
    message |= {"width": config.width, "height": config.height}
    sets = tuple(each for each in config.ray_sets if each in paths or each == "shadow")
    if not paths:
        raise RtbenchError(f"model {label!r}: {'; '.join(remarks)}")
    return Model(label, len(mesh.faces), message, facts, sets, tuple(remarks))


def _primary(mesh: Mesh, config: Config, camera: cameras.Camera) -> dict[str, np.ndarray]:
    rays = cameras.primary_rays(camera, config.width, config.height)
    return dict(zip(("origins", "directions", "pixels"), rays, strict=True))


def _random(mesh: Mesh, config: Config, camera: cameras.Camera) -> dict[str, np.ndarray]:
    rays = ray_sets.random_rays(mesh, config.rays, config.seed)
    return dict(zip(("origins", "directions"), rays, strict=True))


def _aimed(mesh: Mesh, config: Config, camera: cameras.Camera) -> dict[str, np.ndarray]:
    vertices = config.rays // 2
    shares = {"vertex": vertices, "edge": config.rays - vertices}
    drawn = aimed.aimed_rays(mesh, shares, np.float32, config.seed)
    # Mixed, so that a sample from the beginning has both.
    order = np.random.default_rng(config.seed).permutation(config.rays)
    return {
        "origins": drawn.origins[order].astype(np.float64),
        "directions": drawn.directions[order].astype(np.float64),
    }


_DRAWN = {"primary": _primary, "random": _random, "aimed": _aimed}
