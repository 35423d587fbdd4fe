"""NFF: every entity as its definition has it, every mistake in one line, the SPD files whole."""

import math
import re

import numpy as np
import pytest

from rtbench.scenes.hither import is_cut
from rtbench.scenes.model import Camera, Cone, SceneError, Sphere, Triangles
from rtbench.scenes.nff import read

VIEW = """v
from 0 -8 1
at 0 0 1
up 0 0 1
angle 30
hither 0.5
resolution 320 200
"""
FILL = "f 1 0.5 0.25 0.8 0.3 20 0 1\n"
SQUARE = "p 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


@pytest.fixture
def scene(tmp_path):
    """Return what is read of a text."""

    def made(text):
        path = tmp_path / "small.nff"
        path.write_text(text)
        return read(path)

    return made


@pytest.fixture
def told(scene):
    """Return the message about a text, without the folder."""

    def made(text):
        with pytest.raises(SceneError) as found:
            scene(text)
        message = str(found.value)
        assert "\n" not in message
        return re.sub(r"^.*small\.nff", "small.nff", message)

    return made


def test_the_view(scene):
    found = scene(VIEW)
    assert found.name == "small" and found.source.endswith("small.nff")
    assert found.camera == Camera(
        position=(0, -8, 1), target=(0, 0, 1), up=(0, 0, 1), angle=30, width=320, height=200
    )
    assert found.background == (0, 0, 0) and not found.objects
    assert [each.split(": ")[1] for each in found.remarks] == ["no light 'l'", "no objects"]


def test_background_and_lights(scene):
    found = scene("b 0.1 0.2 0.3\n" + VIEW + "l 1 2 3\nl 4 5 6 0.5 1 0\nl 7 8 9\nl 1 1 1\n" + FILL)
    assert found.background == (0.1, 0.2, 0.3)
    assert [each.position for each in found.lights] == [(1, 2, 3), (4, 5, 6), (7, 8, 9), (1, 1, 1)]
    # Four lights: 1 / sqrt(4).
    white = (0.5, 0.5, 0.5)
    assert [each.color for each in found.lights] == [white, (0.5, 1, 0), white, white]
    assert all(each.kind == "point" and each.falloff == "none" for each in found.lights)


def test_an_opaque_fill(scene):
    (found,) = scene(VIEW + FILL + "s 0 0 0 1\n").materials
    np.testing.assert_allclose(found.diffuse, (0.8, 0.4, 0.2), rtol=1e-15)
    assert found.specular == found.reflection == (0.3, 0.3, 0.3) and found.exponent == 20
    assert found.highlight == "phong" and found.ambient == found.emission == (0, 0, 0)
    assert not found.transmits and not found.fresnel


def test_a_fill_that_lets_light_through(scene):
    text = VIEW + "f 1 0.5 0.25 0.2 0 100000 0.8 1.1\ns 0 0 0 1\n"
    (found,) = scene(text).materials
    np.testing.assert_allclose(found.transmission, (0.8, 0.4, 0.2), rtol=1e-15)
    # As POV-Ray 3.7 has it: Kd of what does not shine through, 0.2 * 0.2.
    np.testing.assert_allclose(found.diffuse, (0.04, 0.02, 0.01), rtol=1e-14)
    assert found.index == 1.1 and not found.reflects and not found.fresnel
    (found,) = scene(text.replace("0.8 1.1", "0.8 0")).materials
    assert found.index == 1.0


def test_spheres_and_cones(scene):
    found = scene(VIEW + FILL + "s 1 2 3 4\nc 0 0 0 2\n0 0 5 1\nc 1 1 1 0.5 2 2 2 0.5\n")
    ball, cone, cylinder = found.objects
    assert isinstance(ball, Sphere) and ball.center == (1, 2, 3) and ball.radius == 4
    assert isinstance(cone, Cone) and (cone.base, cone.apex) == ((0, 0, 0), (0, 0, 5))
    assert (cone.base_radius, cone.apex_radius) == (2, 1)
    assert cylinder.base_radius == cylinder.apex_radius == 0.5 and cylinder.apex == (2, 2, 2)
    assert [each.split(": ")[1] for each in found.remarks] == ["no light 'l'"]


def test_negative_radii_are_remarked(scene):
    found = scene(VIEW + FILL + "s 0 0 0 -20\nc 0 0 0 -2 0 0 1 -2\n")
    assert found.objects[0].radius == 20 and found.objects[1].apex_radius == 2
    assert "2 spheres or cones have negative radii" in found.remarks[0]


def test_polygons_of_a_fill_are_one_object(scene):
    found = scene(
        VIEW + FILL + SQUARE + "s 0 0 5 1\n" + SQUARE + "f 1 1 1 1 0 1 0 1\n" + SQUARE
    ).objects
    assert [type(each) for each in found] == [Sphere, Triangles, Triangles]
    assert [each.material for each in found] == [0, 0, 1]
    assert [len(each.corners) for each in found[1:]] == [4, 2]
    corners = found[2].corners
    assert corners.dtype == np.float64 and found[2].normals is None
    # Counter-clockwise stays so: seen from above, the normal points up.
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_array_equal(normals, [(0, 0, 1), (0, 0, 1)])


def test_a_concave_polygon_is_cut_along_its_inside(scene):
    (found,) = scene(VIEW + FILL + "p 4\n0 0 0\n4 0 0\n1 1 0\n0 4 0\n").objects
    sides = found.corners[:, 1:] - found.corners[:, :1]
    area = np.cross(sides[:, 0], sides[:, 1])[:, 2] / 2
    assert (area > 0).all() and area.sum() == 4


def test_patches_keep_their_normals(scene):
    vertices = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
    normals = [(0, 0, 1), (0.1, 0, 1), (0.1, 0.1, 1), (0, 0.1, 3)]
    lines = [" ".join(map(str, v + n)) for v, n in zip(vertices, normals, strict=True)]
    patch, flat = scene(VIEW + FILL + SQUARE + "pp 4\n" + "\n".join(lines)).objects[::-1]
    assert flat.normals is None and patch.corners.shape == patch.normals.shape == (2, 3, 3)
    of = dict(zip(vertices, normals, strict=True))
    for corner, normal in zip(
        *(a.reshape(-1, 3) for a in (patch.corners, patch.normals)), strict=True
    ):
        assert of[tuple(corner)] == tuple(normal)


def test_comments_and_line_ends_mean_nothing(scene):
    text = "# a scene\n" + VIEW.replace("\n", " # so\n") + FILL + SQUARE
    found = scene(text.replace("\n", "\r\n"))
    one_line = scene(re.sub(r"#.*", "", text).replace("\n", " "))
    assert found.camera == one_line.camera
    np.testing.assert_array_equal(found.objects[0].corners, one_line.objects[0].corners)


def test_fills_without_objects_are_left_out(scene):
    found = scene(VIEW + FILL + "f 1 0 0 1 0 1 0.5 1.5\n" + SQUARE + FILL)
    assert len(found.materials) == 1 and found.materials[0].index == 1.5
    assert found.materials[0].name == "fill of line 9"


def test_objects_without_a_fill_are_remarked(scene):
    found = scene(VIEW + "l 0 0 9\n" + SQUARE + FILL + "s 0 0 5 1\n")
    assert [each.material for each in found.objects] == [0, 1]
    assert "before the first fill" in found.remarks[0]


# What is wrong, and what is told of it after "small.nff": VIEW has seven lines, so 8 follows it.
BAD = {
    "": ": there is no view 'v'",
    "v\nfrom 0 0 1\n": ", line 1: the view 'v' has no 'at'",
    VIEW.replace("angle", "angel"): ", line 5: unknown part of the view 'angel'; did you mean 'an",
    VIEW.replace("angle 30\n", ""): ", line 1: the view 'v' has no 'angle'",
    VIEW.replace("angle 30", "angle 180"): ", line 5: angle 180 is not allowed (allowed: above 0,",
    VIEW.replace("angle 30", "angle 0"): ", line 5: angle 0 is not allowed",
    VIEW.replace("angle 30", "angle nan"): ", line 5: angle: 'nan' is not a finite number",
    VIEW.replace("320 200", "0 200"): ", line 7: width 0 is not allowed",
    VIEW.replace("320 200", "3.5 200"): ", line 7: resolution 3.5 is no whole number",
    VIEW.replace("320 200", "320"): ", line 1: resolution needs 2 numbers, 1 found",
    VIEW.replace("at 0 0 1", "at 0 -8 1"): ", line 3: target (0.0, -8.0, 1.0) is where the camera",
    VIEW.replace("up 0 0 1", "up 0 1 0"): ", line 4: up (0.0, 1.0, 0.0) lies along the view",
    VIEW.replace("up 0 0 1", "up 0 0 0"): ", line 4: up (0.0, 0.0, 0.0) has no direction",
    VIEW.replace("up 0 0 1", "from 0 0 1"): ", line 4: 'from' is there twice",
    VIEW + VIEW: ", line 8: a second view 'v'",
    "f 1 1 1 1 0 1 0 1\ns 0 0 0 1\n": ", line 2: object 's' before the view 'v'",
    VIEW + "b 1 1\n": ", line 8: b needs 3 numbers, 2 found",
    VIEW + "b 1 -1 0\n": ", line 8: b -1 is not allowed",
    VIEW + "l 1 2 x\n": ", line 8: l: 'x' is not a number",
    VIEW + "l 1 2 3 0.5\n": ", line 8: l needs 3 numbers, 1 found",
    VIEW + "l 1 2 1e30\n": ", line 8: position 1e+30 is not allowed",
    VIEW + "q 1 2 3\n": ", line 8: unknown entity 'q' (allowed: #, b, c, f, l, p, pp, s, v)",
    VIEW + FILL + "s 0 0 0 1 7\n": ", line 9: '7' is one number too many for 's'",
    VIEW + FILL + "s 0 0 0\n" + FILL: ", line 9: s needs 4 numbers, 3 found",
    VIEW + FILL + "s 0 0 0 inf\n": ", line 9: s: 'inf' is not a finite number",
    VIEW + FILL + "s 0 0 0 0\n": ", line 9: radius 0 is not allowed",
    VIEW + FILL + "c 0 0 0 1 0 0 0 1\n": ", line 9: apex (0.0, 0.0, 0.0) is where the base is",
    VIEW + FILL + "c 0 0 0 1 0 0 1 -1\n": ", line 9: c has radii 1 and -1",
    VIEW + FILL + "p 2\n0 0 0\n1 1 1\n": ", line 9: p 2 is not allowed (allowed: 3 to 1000000",
    VIEW + FILL + "p 3.5\n": ", line 9: p 3.5 is not allowed (allowed: whole numbers)",
    VIEW + FILL + "p 4\n0 0 0\n1 0 0\n1 1\n": ", line 9: p needs 12 numbers, 8 found",
    VIEW + FILL + "p 3\n0 0 0\n1 0 0\n1 y 0\n": ", line 12: p: 'y' is not a number",
    VIEW + FILL + "p 3\n0 0 0\n1 0 0\n2 0 0\n": ", line 9: the polygon has no area",
    VIEW + FILL + "p 4\n0 0 0\n1 0 0\n1 1 1\n0 1 0\n": ", line 9: the polygon is not flat",
    VIEW + FILL + "p 4\n0 0 0\n9 0 0\n1 3 0\n3 3 0\n": ", line 9: the polygon crosses itself",
    VIEW + FILL + "pp 3\n0 0 0 0 0 1\n1 0 0 0 0 0\n0 1 0 0 0 1\n": ", line 9: a normal of the pat",
    VIEW + FILL + "pp 3\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0\n": ", line 9: pp needs 18 numbers",
    VIEW + FILL.replace("0.3", "1.3"): ", line 8: Ks 1.3 is not allowed (allowed: from 0 to 1)",
    VIEW + FILL.replace("0.5", "5"): ", line 8: color 5 is not allowed (allowed: from 0 to 1)",
    VIEW + FILL.replace("0.8", "-0.8"): ", line 8: Kd -0.8 is not allowed",
    VIEW + FILL.replace("20 0 1", "20 1.5 1"): ", line 8: T 1.5 is not allowed",
    VIEW + FILL.replace("20 0 1", "20 0.5 -1"): ", line 8: index -1 is not allowed",
    VIEW
    + FILL
    + "s 0 -8 1 2\n": ", line 2: position (0.0, -8.0, 1.0): the camera is inside the sphe",
    VIEW
    + "l 0 0 3\n"
    + FILL
    + "s 0 0 0 3\n": ", line 8: position (0.0, 0.0, 3.0): light 1 lies on",
}


@pytest.mark.parametrize("text", BAD, ids=range(len(BAD)))
def test_a_mistake_is_told_with_its_line(told, text):
    assert told(text).startswith("small.nff" + BAD[text])


def test_files_that_cannot_be_read(tmp_path):
    for path in (tmp_path / "none.nff", tmp_path):
        with pytest.raises(SceneError, match="cannot be read: "):
            read(path)
    binary = tmp_path / "binary.nff"
    binary.write_bytes(bytes(range(256)) * 4)
    with pytest.raises(SceneError, match="line 1: unknown entity"):
        read(binary)


def test_hither_is_remarked_where_it_would_cut(scene):
    near = VIEW + "l 0 0 9\n" + FILL
    assert not scene(near + "s 0 -6 1 1\n").remarks
    assert "hither 0.5 would cut" in scene(near + "s 0 -6.6 1 1\n").remarks[0]
    camera = Camera(position=(0, 0, 0), target=(0, 0, -1), angle=90)
    for center, cut in (((0, 0, -3), False), ((0, 0, -2.5), True), ((0, 0, 2), False)):
        assert is_cut(camera, 2.0, [Sphere(center=center)]) is cut
    # In view from 45 degrees below the view on: a sphere beside it is seen in part, or not.
    edge = math.sqrt(2)
    assert is_cut(camera, 2.0, [Sphere(center=(1 + 0.99 * edge, 0, -1))])
    assert not is_cut(camera, 2.0, [Sphere(center=(1 + 1.01 * edge, 0, -1))])
    assert is_cut(camera, 2.0, [Cone(base=(0, 0, -1.5), apex=(0, 0, -9))])


def area(corners):
    sides = corners[:, 1:] - corners[:, :1]
    return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2


def kinds(found):
    objects = found.objects
    triangles = [each for each in objects if isinstance(each, Triangles)]
    smooth = sum(len(each.corners) for each in triangles if each.normals is not None)
    return (
        sum(isinstance(each, Sphere) for each in objects),
        sum(isinstance(each, Cone) for each in objects),
        sum(len(each.corners) for each in triangles) - smooth,
        smooth,
    )


@pytest.mark.parametrize(
    "name, counts, lights, materials",
    [
        ("balls", (7381, 0, 2, 0), 3, 2),
        ("teapot", (0, 0, 72, 2256), 2, 3),
        ("tetra", (0, 0, 4096, 0), 1, 1),
        ("jacks", (6, 3, 0, 0), 1, 1),
        ("gears", (0, 0, 36610, 0), 5, 65),
        ("gears_far_lights", (0, 0, 36610, 0), 4, 65),
    ],
)
def test_spd_files(spd, name, counts, lights, materials):
    """How many of each there are, by the SPD's own lists and POV-Ray files."""
    found = read(spd(f"{name}.nff"))
    assert kinds(found) == counts
    assert len(found.lights) == lights and len(found.materials) == materials
    assert found.camera.width == found.camera.height == (256 if name == "jacks" else 512)
    np.testing.assert_allclose([each.color for each in found.lights], 1 / math.sqrt(lights))
    assert not found.remarks


def test_the_triangles_of_gears_fill_its_polygons(spd):
    path = spd("gears.nff")
    words = iter(path.read_text().split("\n"))
    whole, polygons = 0.0, 0
    for line in words:
        if line.startswith("p "):
            way = np.array([next(words).split() for _ in range(int(line[2:]))], dtype=float)
            way -= way[0]
            whole += np.linalg.norm(np.cross(way, np.roll(way, -1, axis=0)).sum(axis=0)) / 2
            polygons += 1
    assert polygons == 9345
    found = np.concatenate([each.corners for each in read(path).objects])
    assert area(found) == pytest.approx(whole, rel=1e-12)
