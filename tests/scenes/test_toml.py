"""The TOML format: what is read is what was written, and what is wrong is told with its line."""

import re
import tomllib

import numpy as np
import pytest

from rtbench.scenes.documentation import EXAMPLE, LINE, documented, toml
from rtbench.scenes.format import FORMAT, HOLDS, OBJECT_KINDS, REQUIRED, keys_of
from rtbench.scenes.model import LIGHT_KINDS, Cone, Plane, SceneError, Sphere, Triangles
from rtbench.scenes.toml_lines import line_of, lines
from rtbench.scenes.toml_objects import rotation, smooth_normals
from rtbench.scenes.toml_scene import linear_pixels, read

# Every whole number in it is the line that it stands in.
NUMBERED = (
    r'''a = 1
"quoted # = [key]" = 2
'single' = 3
dotted . 'in' . "two\u0021" = 4
text = """
  [objects]
  a = 7 \""" # no comment"""""
after = 8
literal = '''
    + "'''\n[[x]] ''\n'''\n"
    + r"""after_literal = 12
array = [ 13, # ] no end
  14, [
  15,
  16],
  { p = 17, q = { r = 17 }, s.t = 17 }, ]
inline = { a = 18, "b}" = [18, 18], c = '}' }
day = 1979-05-27 07:32:00 # a date
after_day = 20

[ table ] # 21
b = 23
[table.sub."a.b"]
b = 25

[[list]]
b = 28
  [list.inner]
  b = 30
  [[list.more]]
  b = 32
  [[list.more]]
  b = 34
[[list]] # another
b = 36
[[list.more]]
b = 38
e = [ ]
f = {}
g = "\"" # "
h = 42
"""
)


def leaves(value, way=()):
    if isinstance(value, dict):
        for name, each in value.items():
            yield from leaves(each, (*way, name))
    elif isinstance(value, list):
        for number, each in enumerate(value):
            yield from leaves(each, (*way, number))
    elif type(value) is int:
        yield way, value


def test_every_key_has_its_line():
    found = lines(NUMBERED)
    numbers = list(leaves(tomllib.loads(NUMBERED)))
    assert len(numbers) == 26
    assert {way: found[way] for way, _ in numbers} == dict(numbers)
    # Tables: their headers; what is not there: the table that it should be in.
    assert found["list", 1] == 35 and found["list", 0, "more", 1] == 33 and found["table",] == 22
    assert line_of(found, ("list", 1, "absent", "deeper")) == 35
    assert line_of(found, ("absent",)) == 1


# A scene that has a table of each sort.
BASE = """name = "base"
background = [0.1, 0.2, 0.3]
[camera]
position = [0, 1, 9]
target = [0, 1, 0]
[settings]
depth = 3
[settings.indirect]
samples = 16
[materials.red]
diffuse = [0.8, 0.1, 0.1]
index = 1.5
texture = {kind = "checker", size = 2}
[[lights]]
kind = "point"
position = [3, 6, 4]
[[lights]]
kind = "spot"
position = [0, 5, 0]
direction = [0, -1, 0]
[[objects]]
kind = "sphere"
material = "red"
center = [0, 1, 0]
radius = 1
[[objects]]
kind = "plane"
material = "red"
point = [0, 0, 0]
normal = [0, 1, 0]
[[objects]]
kind = "polygon"
material = "red"
vertices = [[4, 0, 0], [5, 0, 0],
  [5, 1, 0], [4, 1, 0]]
[[objects]]
kind = "mesh"
material = "red"
model = "scanned:1000"
move = [9, 1, 0]
"""


def refused(tmp_path, text, name="bad.toml"):
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError) as told:
        read(file)
    assert "\n" not in str(told.value)
    return told.value, str(told.value).removeprefix(f"{file}, ")


# What is replaced by what (#! marks the line that the message has to name), the key, and words.
BAD = {
    "unknown key": ("radius = 1\n", "radios = 1 #!\n", "radios", "mean 'radius'"),
    "unknown key at the top": ("background", "backround", "backround", "mean 'background'", 2),
    "unknown camera key": ("target =", "tagret =", "tagret", "mean 'target'", 5),
    "unknown settings key": ("depth = 3", "deep = 3 #!", "deep", "mean 'depth'"),
    "unknown indirect key": ("samples = 16", "sample = 16 #!", "sample", "mean 'samples'"),
    "unknown material key": ("index = 1.5", "idx = 1.5 #!", "idx", "mean 'index'"),
    "unknown texture key": ("size = 2}", "sise = 2} #!", "sise", "mean 'size'"),
    "key of another kind": ("point = [0, 0, 0]", "center = [0, 0, 0] #!", "center", "plane key"),
    "key of another light": ("[3, 6, 4]\n", "[3, 6, 4]\ninner = 3 #!\n", "inner", "point light"),
    "unknown kind": ('"sphere"', '"shpere" #!', "kind", "mean 'sphere'"),
    "unknown light": ('"spot"', '"spto" #!', "kind", "mean 'spot'"),
    "unknown texture": ('"checker", size = 2}', '"cheker", size = 2} #!', "kind", "'checker'"),
    "unknown material": ('"red"\ncenter', '"rde" #!\ncenter', "material", "mean 'red'"),
    "radius missing": (
        '[[objects]]\nkind = "sphere"\nmaterial = "red"\ncenter = [0, 1, 0]\nradius = 1\n',
        '[[objects]] #!\nkind = "sphere"\nmaterial = "red"\ncenter = [0, 1, 0]\n',
        "radius",
        "is missing",
    ),
    "kind missing": ('[[lights]]\nkind = "spot"\n', "[[lights]] #!\n", "kind", "is missing"),
    "material missing": (
        '[[objects]]\nkind = "sphere"\nmaterial = "red"\n',
        '[[objects]] #!\nkind = "sphere"\n',
        "material",
        "is missing",
    ),
    "target missing": (
        "[camera]\nposition = [0, 1, 9]\ntarget = [0, 1, 0]\n",
        "[camera] #!\nposition = [0, 1, 9]\n",
        "target",
        "is missing",
    ),
    "camera missing": (
        "[camera]\nposition = [0, 1, 9]\ntarget = [0, 1, 0]\n",
        "",
        "camera",
        "is missing",
        1,
    ),
    "text for a number": ("radius = 1\n", 'radius = "1" #!\n', "radius", "a finite number"),
    "switch for a number": ("radius = 1\n", "radius = true #!\n", "radius", "a finite number"),
    "number for a text": (
        'material = "red"\ncenter',
        "material = 3 #!\ncenter",
        "material",
        "text",
    ),
    "broken number for a whole one": ("depth = 3", "depth = 3.5 #!", "depth", "whole number"),
    "two numbers for a point": ("[0, 1, 9]", "[0, 9] #!", "position", "three finite numbers"),
    "number for a table": ("[settings]\ndepth = 3\n[settings.indirect]\nsamples = 16\n", "", 0, 0),
    "lights without brackets": ("[[lights]]\nkind", "[[light]] #!\nkind", "light", "'lights'"),
    "NaN": ("radius = 1\n", "radius = nan #!\n", "radius", "nan"),
    "infinite": ("[3, 6, 4]", "[3, -inf, 4] #!", "position", "-Infinity|-inf"),
    "NaN among vertices": (
        "vertices = [[4, 0, 0], [5, 0, 0],",
        "vertices = [[4, 0, 0], [5, nan, 0], #!",
        "vertices",
        "finite",
    ),
    "more digits than floats have": (
        "radius = 1\n",
        f"radius = {10**400} #!\n",
        "radius",
        "\\.\\.\\.",
    ),
    "negative radius": ("radius = 1\n", "radius = -1 #!\n", "radius", "above 0"),
    "index 0": ("index = 1.5", "index = 0 #!", "index", "0.1 to 10"),
    "size 0 of a texture": ("size = 2}", "size = 0} #!", "size", "above 0"),
    "color below 0": ("[0.8, 0.1, 0.1]", "[0.8, -0.1, 0.1] #!", "diffuse", "0 or more"),
    "no pixels": ("[0, 1, 9]\n", "[0, 1, 9]\nwidth = 0 #!\n", "width", "1 to 16384"),
    "no direction": ("target = [0, 1, 0]", "target = [0, 1, 9] #!", "target", "stands"),
    "up along the view": (
        "target = [0, 1, 0]",
        "target = [0, 1, 0]\nup = [0, 0, 2] #!",
        "up",
        "view",
    ),
    "spot without direction": ("[0, -1, 0]", "[0, 0, 0] #!", "direction", "no direction"),
    "camera in a ball": ("[0, 1, 9]", "[0, 1.5, 0.5] #!", "position", "inside object 1 .sphere"),
    "camera on a ball": ("[0, 1, 9]", "[0, 1, 1] #!", "position", "is on object 1 .sphere"),
    "light on a ball": ("[0, 5, 0]", "[0, 2, 0] #!", "position", "light 2 lies on object 1"),
    "light on a plane": ("[3, 6, 4]", "[3, 0, 4] #!", "position", "light 1 lies on object 2"),
    "not planar": ("[5, 1, 0], [4, 1, 0]]", "[5, 1, 0], [4, 1, 1]]", "vertices", "plane", 34),
    "unknown model": ('"scanned:1000"', '"scaned:1000" #!', "model", "'scanned'"),
    "model too small": ('"scanned:1000"', '"scanned:10" #!', "model", "1000 to"),
    "file and model": (
        'model = "scanned:1000"',
        'model = "scanned:1000" #!\nfile = "x.ply"',
        "model",
        "both",
    ),
    "file absent": ('model = "scanned:1000"', 'file = "x.ply" #!', "file", "no such file"),
    "image absent": (
        '{kind = "checker", size = 2}',
        '{kind = "image", file = "no.png"} #!',
        "file",
        "No such file",
    ),
    "samples no square": ("depth = 3", "samples = 5 #!", "samples", "nearest is 4"),
    "syntax": ("radius = 1\n", "radius = 1 2 #!\n", "file", "not TOML"),
    "twice": ("radius = 1\n", "radius = 1\nradius = 1 #!\n", "file", "not TOML"),
}
del BAD["number for a table"]


@pytest.mark.parametrize("case", BAD.values(), ids=BAD)
def test_bad_input_is_told_in_one_line_with_file_line_and_key(tmp_path, case):
    old, new, key, words, *line = case
    assert BASE.count(old) >= 1
    text = BASE.replace(old, new, 1)
    wanted = line[0] if line else text[: text.index("#!")].count("\n") + 1
    problem, told = refused(tmp_path, text)
    assert told.startswith(f"line {wanted}: "), (wanted, told)
    assert re.fullmatch(key, problem.key)
    assert re.search(words, told), told
    if problem.key != "file" or "not TOML" not in told:
        assert re.search(rf"\b{problem.key}\b", told)


def test_the_scene_that_the_bad_ones_come_from_is_read(tmp_path):
    file = tmp_path / "base.toml"
    file.write_text(BASE, encoding="utf-8")
    scene = read(file)
    assert scene.name == "base" and scene.source == str(file) and scene.remarks == ()
    assert scene.background == (0.1, 0.2, 0.3) and scene.settings.indirect.samples == 16
    assert [type(each) for each in scene.objects] == [Sphere, Plane, Triangles, Triangles]
    assert scene.materials[0].texture.size == 2.0
    assert scene.objects[2].corners.shape == (2, 3, 3) and scene.objects[3].closed


WRONG = ["nan", "inf", "-1e300", "true", '"x"', "[]", "{}", "[nan, 0, 0]", "[[1, 2], 3]", "10" * 99]


def test_no_value_of_any_key_leads_to_anything_but_one_line(tmp_path):
    whole = BASE.replace("[5, 0, 0],\n  [5", "[5, 0, 0], [5")
    refusals = 0
    for number, line in enumerate(whole.splitlines(), 1):
        name, equals, _ = line.partition(" = ")
        for wrong in WRONG if equals else ():
            text = "\n".join(
                f"{name} = {wrong}" if n == number else each
                for n, each in enumerate(whole.splitlines(), 1)
            )
            file = tmp_path / "wrong.toml"
            file.write_text(text, encoding="utf-8")
            try:
                read(file)
            except SceneError as problem:
                refusals += 1
                told = str(problem)
                # Nothing but a kind makes other keys wrong.
                if name != "kind":
                    assert told.startswith(f"{file}, line {number}: "), (line, wrong, told)
                assert "\n" not in told and len(told) < 300 + len(str(file))
    assert refusals > 150


def filled(table, **other):
    """Return lines for every key of a table that has an example or a default."""
    told, values = [], {}
    for key in keys_of(table).values():
        value = key.example if key.default == REQUIRED else key.default
        value = other.get(key.name, value)
        if value is None or key.holds == "table":
            continue
        told.append(f"{key.name} = {toml(value)}")
        values[key.name] = value
    return "\n".join(told) + "\n", values


HEAD = """[camera]
position = [0, 1, 50]
target = [0, 1, 0]
[materials.red]
"""


@pytest.mark.parametrize("kind", OBJECT_KINDS)
def test_documented_objects_are_read_back(tmp_path, kind):
    other = {"kind": kind, "velocity": (0, 0.5, 0), "model": "scanned:1000"}
    text, values = filled(kind, **other) if kind == "mesh" else filled(kind, kind=kind)
    file = tmp_path / "scene.toml"
    file.write_text(f"{HEAD}[[objects]]\n{text}", encoding="utf-8")
    (each,) = read(file).objects
    assert each.velocity == tuple(values["velocity"])
    if isinstance(each, Triangles):
        assert len(each.corners) and (each.normals is not None) == (kind == "patch")
    else:
        names = {"radius": "base_radius"} if isinstance(each, Cone) else {}
        for key in set(values) - {"kind", "material"}:
            found = np.asarray(getattr(each, names.get(key, key)))
            np.testing.assert_array_equal(found, values[key], err_msg=key)
    if kind == "cylinder":
        assert each.apex_radius == each.base_radius == 0.5


@pytest.mark.parametrize("kind", LIGHT_KINDS)
def test_documented_lights_are_read_back(tmp_path, kind):
    text, values = filled("ball" if kind == "sphere" else kind, kind=kind, shadows=False, grid=3)
    file = tmp_path / "scene.toml"
    file.write_text(f"{HEAD}[[lights]]\n{text}", encoding="utf-8")
    (light,) = read(file).lights
    assert not light.shadows
    for key, value in values.items():
        np.testing.assert_array_equal(np.asarray(getattr(light, key)), np.asarray(value), key)


def test_documented_camera_settings_and_material_are_read_back(tmp_path):
    camera, seen = filled("camera", lens_radius=0.25, focus=3.5, width=40)
    material, made = filled("material", abbe=40.0, roughness=0.5, fresnel=True, diffuse=(0, 0.5, 1))
    settings, how = filled("settings", depth=7, samples=9)
    indirect, paths = filled("indirect", noise=0.25)
    file = tmp_path / "scene.toml"
    file.write_text(
        f"[camera]\n{camera}[settings]\n{settings}[settings.indirect]\n{indirect}"
        f"[materials.red]\n{material}",
        encoding="utf-8",
    )
    scene = read(file)
    pairs = [
        (scene.camera, seen),
        (scene.materials[0], made),
        (scene.settings, {**how, "threshold": pytest.approx(how["threshold"], rel=1e-4)}),
        (scene.settings.indirect, paths),
    ]
    for found, values in pairs:
        for key, value in values.items():
            assert getattr(found, key) == value, key
    assert scene.remarks == (f"{file}: no object has the material 'red'",)


def test_the_documented_scene_is_read(tmp_path):
    file = tmp_path / "example.toml"
    file.write_text(EXAMPLE, encoding="utf-8")
    scene = read(file)
    assert scene.name == "ball" and scene.objects[0].center == (0, 1, 0)
    assert scene.materials[scene.objects[0].material].diffuse == (0.8, 0.1, 0.1)
    assert scene.materials[0].specular == (0.5, 0.5, 0.5)  # one number is grey


def test_the_documentation_tells_every_table_and_key():
    told = documented()
    assert max(map(len, told.splitlines())) <= LINE
    for table in FORMAT.values():
        part = told[told.index(f"{table.heading or '(top)'}   ") :]
        for key in table.keys:
            assert re.search(rf"^  {key.name} +{key.holds}\b", part, re.MULTILINE), key.name
    for held in HOLDS:
        assert re.search(rf"^  {held} ", told, re.MULTILINE)


def test_files_are_included_once_and_without_their_camera(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "colors.toml").write_text("[materials.red]\ndiffuse = 0.5\n")
    (tmp_path / "parts" / "balls.toml").write_text(
        'include = ["../colors.toml"]\n[camera]\nposition = [1, 1, 1]\ntarget = [0, 0, 0]\n'
        '[[objects]]\nkind = "sphere"\nmaterial = "red"\ncenter = [3, 0, 0]\nradius = 1\n'
    )
    main = tmp_path / "main.toml"
    start = 'include = ["colors.toml", "parts/balls.toml"]\n'
    main.write_text(
        f'{start}{HEAD.replace("red", "blue")}[[objects]]\nkind = "sphere"\nmaterial = "blue"\n'
        "center = [0, 0, 0]\nradius = 1\n"
    )
    scene = read(main)
    assert [each.name for each in scene.materials] == ["red", "blue"]
    assert [(each.center[0], each.material) for each in scene.objects] == [(3, 0), (0, 1)]
    assert scene.camera.position == (0, 1, 50) and scene.name == "main"
    # What is wrong in an included file is told of that file.
    (tmp_path / "parts" / "balls.toml").write_text("\n[materials.green]\nidx = 3\n")
    with pytest.raises(SceneError) as told:
        read(main)
    assert str(told.value).startswith(f"{tmp_path / 'parts' / 'balls.toml'}, line 3: unknown")
    # Its objects are named with the file.
    (tmp_path / "parts" / "balls.toml").write_text(
        '[[objects]]\nkind = "sphere"\nmaterial = "red"\ncenter = [0, 0, 50]\nradius = 3\n'
    )
    with pytest.raises(SceneError, match=r"main.toml, line 3: .*object 1 \(sphere\) of .*balls"):
        read(main)
    (tmp_path / "parts" / "balls.toml").write_text("[materials.red]\n")
    with pytest.raises(SceneError, match=r"balls\.toml, line 1: material 'red' is there twice"):
        read(main)


def test_files_that_include_each_other_are_refused_by_name(tmp_path):
    for name, other in (("a", "b"), ("b", "c"), ("c", "b")):
        (tmp_path / f"{name}.toml").write_text(
            f"{HEAD}\n".join(["", ""]) * 0 + f'include = ["{other}.toml"]\n{HEAD}'
        )
    with pytest.raises(SceneError) as told:
        read(tmp_path / "a.toml")
    assert str(told.value) == (
        f'{tmp_path / "c.toml"}, line 1: include "b.toml" leads in a circle: '
        "b.toml > c.toml > b.toml"
    )
    (tmp_path / "self.toml").write_text(f'include = ["./self.toml"]\n{HEAD}')
    with pytest.raises(SceneError, match=r"circle: self\.toml > self\.toml"):
        read(tmp_path / "self.toml")


def test_files_that_cannot_be_read_are_told(tmp_path):
    (tmp_path / "bytes.toml").write_bytes(b"name = '\xff'")
    for name, words in (
        ("absent.toml", "No such file"),
        ("", "cannot be read"),
        ("bytes.toml", "UTF-8"),
    ):
        with pytest.raises(SceneError, match=words) as told:
            read(tmp_path / name)
        assert told.value.key == "file" and str(tmp_path / name) in str(told.value)
    problem, told = refused(tmp_path, f'include = ["absent.toml"]\n{HEAD}')
    assert problem.key == "include" and told.startswith("line 1: ") and "absent.toml" in told
    problem, told = refused(tmp_path, "a = " + "[" * 5000)
    assert "not TOML" in str(problem)


def test_images_are_read_beside_the_scene_and_made_linear(tmp_path):
    from PIL import Image

    pixels = np.zeros((2, 3, 3), np.uint8)
    pixels[0, 0] = (255, 128, 10)
    Image.fromarray(pixels).save(tmp_path / "tiny.png")
    file = tmp_path / "scene.toml"
    text = f'{HEAD}texture = {{kind = "image", file = "tiny.png"}}\n[[objects]]\n'
    flat = 'kind = "triangle"\nmaterial = "red"\nvertices = [[0,0,0],[1,0,0],[0,1,0]]\n'
    file.write_text(text + flat + "coordinates = [[0, 0], [1, 0], [0, 1]]\n")
    scene = read(file)
    texture = scene.materials[0].texture
    assert texture.pixels.shape == (2, 3, 3) and texture.pixels.dtype == np.float32
    # IEC 61966-2-1: 128 is 0.21586; 10 is on the straight part, 10 / 255 / 12.92.
    np.testing.assert_allclose(texture.pixels[0, 0], (1, 0.21586050, 0.00303527), rtol=1e-5)
    assert not texture.pixels[1:].any() and scene.remarks == ()
    np.testing.assert_array_equal(scene.objects[0].coordinates, [[[0, 0], [1, 0], [0, 1]]])
    file.write_text(text + flat)
    assert "coordinates" in read(file).remarks[0]
    problem, told = refused(tmp_path, text + flat + "coordinates = [[0, 0], [1, 0]]\n")
    assert problem.key == "coordinates" and told.startswith("line 10: ")
    (tmp_path / "tiny.png").write_bytes((tmp_path / "tiny.png").read_bytes()[:50])
    problem, told = refused(tmp_path, text + flat)
    assert problem.key == "file" and told.startswith("line 5: ") and "tiny.png" in told
    (tmp_path / "tiny.png").write_text("no image")
    with pytest.raises(SceneError, match="is no image"):
        linear_pixels(tmp_path / "tiny.png")


def volume(corners):
    """Of what triangles enclose, above 0 if they are counter-clockwise seen from outside."""
    return np.linalg.det(corners).sum() / 6


def test_a_box_is_closed_and_faces_outwards(tmp_path):
    file = tmp_path / "scene.toml"
    for turn in ((0, 0, 0), (30, 50, -20)):
        file.write_text(
            f'{HEAD}[[objects]]\nkind = "box"\nmaterial = "red"\ncorner = [2, 5, 1]\n'
            f"opposite = [-1, 3, 1.5]\nrotate = {toml(turn)}\n"
        )
        (box,) = read(file).objects
        assert box.closed and box.corners.shape == (12, 3, 3)
        assert volume(box.corners) == pytest.approx(3 * 2 * 0.5)
        np.testing.assert_allclose(box.corners.mean(axis=(0, 1)), (0.5, 4, 1.25), atol=1.5)
        middle = np.unique(box.corners.reshape(-1, 3).round(9), axis=0)
        assert len(middle) == 8
        np.testing.assert_allclose(middle.mean(axis=0), (0.5, 4, 1.25))
    problem, told = refused(
        tmp_path,
        f'{HEAD}[[objects]]\nkind = "box"\nmaterial = "red"\ncorner = [2, 5, 1]\n'
        "opposite = [0, 5, 0]\n",
    )
    assert problem.key == "opposite" and told.startswith("line 9: ")


TETRAHEDRON = "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def test_a_mesh_is_fitted_scaled_turned_and_moved(tmp_path):
    (tmp_path / "tetra.obj").write_text(TETRAHEDRON)
    file = tmp_path / "scene.toml"
    mesh = f'{HEAD}[[objects]]\nkind = "mesh"\nmaterial = "red"\nfile = "tetra.obj"\n'
    file.write_text(mesh)
    (plain,) = read(file).objects
    assert plain.closed and volume(plain.corners) == pytest.approx(2 / 6) and plain.normals is None
    file.write_text(mesh + "fit = 4\nscale = 1.5\nrotate = [0, 0, 90]\nmove = [10, 0, 0]\n")
    (moved,) = read(file).objects
    # By hand: sides 2, 1, 1 become 6, 3, 3 about 0; then x goes to y, y to -x; then 10 along x.
    corners = moved.corners.reshape(-1, 3)
    np.testing.assert_allclose(corners.min(axis=0), (8.5, -3, -1.5))
    np.testing.assert_allclose(corners.max(axis=0), (11.5, 3, 1.5))
    assert volume(moved.corners) == pytest.approx(2 / 6 * 27)
    (tmp_path / "tetra.obj").write_text(TETRAHEDRON.replace("f 1 4 3\n", ""))
    assert not read(file).objects[0].closed
    # A triangle without area is left out, and said to be.
    (tmp_path / "tetra.obj").write_text(TETRAHEDRON + "f 1 1 2\n")
    scene = read(file)
    assert len(scene.objects[0].corners) == 4 and "1 of 5 triangles dropped" in scene.remarks[0]


def test_a_mesh_without_shared_vertices_is_closed_and_smooth(tmp_path):
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.export(tmp_path / "ball.stl")  # binary: each triangle has corners of its own
    (tmp_path / "scene.toml").write_text(
        f'{HEAD}[[objects]]\nkind = "mesh"\nmaterial = "red"\nfile = "ball.stl"\nsmooth = true\n'
    )
    (each,) = read(tmp_path / "scene.toml").objects
    assert each.closed and len(each.corners) == 320
    # The normals of a ball about 0 are its points.
    np.testing.assert_allclose(each.normals, each.corners, atol=0.03)


def test_smooth_normals_are_weighted_by_area():
    # A triangle of area 1/2 that faces z, one of area 3/2 that faces y; they share the x axis.
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [0, 0, 0], [0, 0, -3.0]]])
    corners[1, 0, 1] = -0.0
    for size, offset in ((1, 0), (1e-200, 0), (1e5, 1e6)):
        found = smooth_normals(corners * size + offset)
        mean = np.array([0, -3, 1]) / np.sqrt(10)
        wanted = [[mean, mean, (0, 0, 1)], [mean, mean, (0, -1, 0)]]
        np.testing.assert_allclose(found, wanted, atol=1e-9)
    # Two sides of one sheet: no mean, so each its own.
    sheet = np.array([corners[0], corners[0][::-1]])
    np.testing.assert_allclose(smooth_normals(sheet)[:, :, 2], [[1] * 3, [-1] * 3])
    assert np.isfinite(smooth_normals(np.zeros((1, 3, 3)))).all()


def test_rotation_is_about_x_then_y_then_z():
    np.testing.assert_array_equal(rotation((0, 0, 90)) @ (1, 0, 0), (0, 1, 0))
    np.testing.assert_array_equal(rotation((90, 0, 0)) @ (0, 1, 0), (0, 0, 1))
    np.testing.assert_array_equal(rotation((0, 90, 0)) @ (0, 0, 1), (1, 0, 0))
    np.testing.assert_array_equal(rotation((90, 90, 0)) @ (0, 1, 0), (1, 0, 0))
    np.testing.assert_array_equal(rotation((0, -450, 720)), rotation((0, 270, 0)))
    turn = rotation((10, 200, -77))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    root = np.sqrt(0.5)
    np.testing.assert_allclose(rotation((0, 0, 45)) @ (1, 0, 0), (root, root, 0))


PLACED = {
    # What the camera and a light may do, and may not, beside a ball of radius 1 about 0.
    "through a moving ball": ("[0, 0, 5]", "[9, 9, 9]", "velocity = [0, 0, 9]", "camera is inside"),
    "where the ball comes to": ("[0, 0, 5]", "[9, 9, 9]", "velocity = [0, 0, 4]", "camera is on"),
    "beside a moving ball": ("[0, 1.01, 5]", "[9, 9, 9]", "velocity = [0, 0, 9]", None),
    "beyond its end": ("[0, 0, 5]", "[9, 9, 9]", "velocity = [0, 0, 3.9]", None),
    "light on a slanted radius": ("[0, 0, 5]", "[0.6, 0.8, 0]", "", "light 1 lies on object 1"),
    "light in the ball": ("[0, 0, 5]", "[0.6, 0.79, 0]", "", None),
}


@pytest.mark.parametrize("case", PLACED.values(), ids=PLACED)
def test_where_camera_and_lights_may_be(tmp_path, case):
    position, light, more, words = case
    text = (
        f"[camera]\nposition = {position}\ntarget = [1, 0, -9]\n[materials.red]\n"
        f'[[lights]]\nkind = "point"\nposition = {light}\n'
        f'[[objects]]\nkind = "sphere"\nmaterial = "red"\ncenter = [0, 0, 0]\nradius = 1\n{more}\n'
    )
    if words is None:
        (tmp_path / "good.toml").write_text(text)
        assert len(read(tmp_path / "good.toml").objects) == 1
    else:
        assert words in refused(tmp_path, text)[1]


@pytest.mark.parametrize(
    ("edge", "height", "object", "bad"),
    [
        ("[1, 0, 0]", 2, 'kind = "plane"\npoint = [7, 2, 7]\nnormal = [0, 1e-200, 0]', True),
        ("[1, 0.1, 0]", 2, 'kind = "plane"\npoint = [7, 2, 7]\nnormal = [0, 1, 0]', False),
        ("[1, 0, 0]", 2.001, 'kind = "plane"\npoint = [7, 2, 7]\nnormal = [0, 1, 0]', False),
        ("[1, 0, 0]", 2, 'kind = "disc"\ncenter = [1, 2, 0]\nnormal = [0, 3, 0]\nradius = 2', True),
        (
            "[1, 0, 0]",
            2,
            'kind = "disc"\ncenter = [9, 2, 0]\nnormal = [0, 3, 0]\nradius = 2',
            False,
        ),
    ],
)
def test_a_rectangle_of_light_must_not_lie_in_a_surface(tmp_path, edge, height, object, bad):
    text = (
        f'{HEAD}[[lights]]\nkind = "rectangle"\nposition = [0, {height}, 0]\nedge_u = {edge}\n'
        f'edge_v = [0, 0, 1]\n[[objects]]\nmaterial = "red"\n{object}\n'
    )
    if bad:
        problem, told = refused(tmp_path, text)
        assert problem.key == "position" and told.startswith("line 7: ")
    else:
        (tmp_path / "good.toml").write_text(text)
        assert len(read(tmp_path / "good.toml").lights) == 1
