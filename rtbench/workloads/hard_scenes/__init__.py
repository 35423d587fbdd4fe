"""Small scenes that trees get wrong, each with the rays that find it out."""

from rtbench.workloads.hard_scenes.catalogue import SCENES, scenes
from rtbench.workloads.hard_scenes.scene import Scene

__all__ = ["SCENES", "Scene", "scenes"]
