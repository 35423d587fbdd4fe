"""Any kernel that gives t may test the tracer's triangles, whatever it reads of a ray."""

import numpy as np
import pytest
from test_walking import hits_of_triangle, of_camera

from rtbench.scenes.model import Camera, Light, Material, Scene, Triangles
from rtbench.tracer.options import Options
from rtbench.tracer.render import Renderer
from rtbench.workloads.solids import icosphere

# Chirkov's test reads a second point of the ray; Badouel's and Wald's what they stored.
QUICK = ("chirkov",)
OTHERS = ("badouel", "wald", "adaptive_exact", "half_open", "moller1_uv")


def scene():
    found = icosphere(2)
    corners = np.asarray(getattr(found, "triangles", found), float)
    camera = Camera(position=(0.3, 0.7, 4.0), target=(0, 0, 0), width=48, height=40)
    return Scene(
        "ball",
        camera,
        (Light(position=(3.0, 4.0, 5.0)),),
        (Material(diffuse=(0.8, 0.8, 0.8), emission=(0.1, 0.1, 0.1)),),
        (Triangles(corners=corners),),
    )


@pytest.mark.parametrize(
    "kernel", [*QUICK, *(pytest.param(k, marks=pytest.mark.full) for k in OTHERS)]
)
def test_the_ball_is_where_it_is(kernel):
    ball = scene()
    start, ways = of_camera(ball.camera)
    corners = ball.objects[0].corners
    hit = np.isfinite(np.min([hits_of_triangle(c, start, ways) for c in corners], axis=0))
    picture = Renderer(ball, Options(kernel=kernel, force=("shadows",))).render().pixels
    assert 0.2 < hit.mean() < 0.8
    assert ((picture > 0).any(axis=2) == hit).all()
