"""Meshes: files are read as they stand, bad ones are told in a line, what is invalid is dropped."""

import os
import struct
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.workloads import meshes
from rtbench.workloads.meshes import Mesh, load_mesh, without_area
from rtbench.workloads.solids import cube, icosphere, random_sphere, tetrahedron

FAR = (148376.0, 1234.0, -223423.0)
GENERATED = {
    "tetrahedron": tetrahedron,
    "cube": cube,
    "icosphere 0": lambda: icosphere(0),
    "icosphere 2": lambda: icosphere(2),
    "random sphere 16": random_sphere,
    "random sphere 3": lambda: random_sphere(3),
}
HEAD = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face {faces}
property list uchar int vertex_indices
end_header
"""
CORNERS = "0 0 0\n1 0 0\n0 1 0\n"


@pytest.fixture(params=GENERATED)
def mesh(request):
    return GENERATED[request.param]()


def test_what_is_done_to_a_mesh_keeps_its_vertices_shared(mesh):
    moved = mesh.scaled(3).moved(FAR).rounded(np.float32)
    assert moved.closed and moved.faces is mesh.faces
    np.testing.assert_array_equal(moved.vertices, moved.vertices.astype(np.float32))
    np.testing.assert_allclose(moved.vertices, 3 * mesh.vertices + FAR, atol=2.0**-7)
    np.testing.assert_array_equal(moved.centre, FAR)
    # The corner of a triangle is, bit for bit, that of its neighbours.
    for corner in np.unique(moved.faces)[:5]:
        same = moved.triangles[moved.faces == corner]
        assert len(same) >= 3 and (same == same[0]).all()


def test_open_edges_are_counted():
    whole = icosphere(1)

    def changed(faces):
        return Mesh("changed", whole.vertices, faces, whole.centre)

    assert changed(whole.faces[1:]).open_edges == 3
    assert changed(np.concatenate([whole.faces, whole.faces[:1]])).open_edges == 6
    turned = whole.faces.copy()
    turned[0] = turned[0, ::-1]
    assert changed(turned).open_edges == 6  # now three stand twice, and have no opposite


def test_files_are_read_as_they_stand(tmp_path):
    numbers = np.float32([[0.1, 0, 0], [1, 0, 1e-3], [0, 1, 7], [9, 9, 9]])
    faces = np.array([[2, 1, 0], [0, 1, 2], [0, 0, 1]])  # turned, doubled, without area: kept
    head = HEAD.format(faces=3).replace("ascii", "binary_little_endian")
    head = head.replace("vertex 3", "vertex 4")
    rows = b"".join(struct.pack("<Biii", 3, *map(int, face)) for face in faces)
    file = tmp_path / "thing.PLY"
    file.write_bytes(head.encode() + numbers.tobytes() + rows)
    found = load_mesh(file)
    assert found.name == "thing" and found.vertices.dtype == np.float64
    np.testing.assert_array_equal(found.vertices, numbers)
    np.testing.assert_array_equal(found.faces, faces)
    assert found.triangles.shape == (3, 3, 3)
    np.testing.assert_array_equal(found.triangles[0], numbers[[2, 1, 0]])
    np.testing.assert_array_equal(found.centre, (numbers.min(axis=0) + numbers.max(axis=0)) / 2)
    assert not found.closed


def test_polygons_are_cut(tmp_path):
    file = tmp_path / "quad.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", encoding="utf-8")
    triangles = load_mesh(str(file)).triangles
    assert triangles.shape == (2, 3, 3)
    edges = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
    assert areas == pytest.approx([0.5, 0.5])


BAD = {
    "empty.ply": (b"", "is empty"),
    "words.ply": (b"hello", "is damaged or no ply file: Not a ply file!"),
    "head.ply": (HEAD[:50].encode(), "is damaged or no ply file"),
    "short.ply": (
        (HEAD.format(faces=4) + CORNERS + "3 0 1 2\n").encode(),
        "is cut off: 1 of the 4 faces that it promises",
    ),
    "half.ply": (
        HEAD.format(faces=2).replace("ascii", "binary_little_endian").encode() + b"\0" * 40,
        "is damaged or no ply file: PLY is unexpected length!",
    ),
    "half.stl": (b"\0" * 80 + struct.pack("<I", 5) + b"\0" * 70, "has no triangles"),
    "none.ply": ((HEAD.format(faces=0) + CORNERS).encode(), "has no triangles"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\n", "has no triangles"),
    "beyond.ply": (
        (HEAD.format(faces=2) + CORNERS + "3 0 1 7\n3 0 1 2\n").encode(),
        r"1 of 2 triangles name vertices that are not there, the first vertex 7 "
        r"\(allowed: 0 to 2\) in triangle 0; --drop-invalid",
    ),
    "below.ply": ((HEAD.format(faces=1) + CORNERS + "3 0 1 -1\n").encode(), "first vertex -1"),
    "nan.ply": (
        (HEAD.format(faces=1) + "0 0 0\nnan 0 0\n0 inf 0\n3 0 1 2\n").encode(),
        r"2 of 3 vertices are not finite, the first vertex 1 \(nan, 0, 0\), used by 1 of 1 "
        "triangles, the first triangle 0; --drop-invalid",
    ),
    "mesh.txt": (b"hello", "unknown mesh format 'txt'.*allowed: .*ply"),
    "mesh.pyl": (b"hello", "unknown mesh format 'pyl'.*ply"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_told_in_one_line(tmp_path, name):
    content, words = BAD[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(RtbenchError, match=words) as caught:
        load_mesh(tmp_path / name)
    text = str(caught.value)
    assert "\n" not in text and text.startswith(f"mesh {str(tmp_path / name)!r}")


MIXED = """ply
format ascii 1.0
element vertex 7
property float x
property float y
property float z
element face 7
property list uchar int vertex_indices
end_header
0 0 0
nan 0 0
1 0 0
0 1 0
0 inf 0
2 0 0
0 0 3
3 0 2 3
3 0 1 2
3 0 2 7
3 0 4 -2
3 0 2 5
3 3 2 4
3 3 6 2
"""


def test_invalid_triangles_are_dropped_if_asked(tmp_path):
    file = tmp_path / "mixed.ply"
    file.write_text(MIXED, encoding="ascii")
    with pytest.raises(RtbenchError, match=r"2 of 7 triangles name.* in triangle 2; --drop-inv"):
        load_mesh(file)
    found = load_mesh(file, drop_invalid=True)
    # Left are the triangles 0, 4 and 6 of the file, of its vertices 0, 2, 3, 5, 6.
    corners = [[(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 0), (1, 0, 0), (2, 0, 0)]]
    corners.append([(0, 1, 0), (0, 0, 3), (1, 0, 0)])
    np.testing.assert_array_equal(found.triangles, corners)
    assert np.isfinite(found.vertices).all() and found.faces.max() < len(found.vertices)
    np.testing.assert_array_equal(found.centre, (1, 0.5, 1.5))
    assert found.dropped == 4 and found.degenerate == 1
    assert found.remark == (
        f"mesh {str(file)!r}: 4 of 7 triangles dropped: 2 with vertices that are not there, the "
        "first triangle 2; 2 with vertices not finite, the first triangle 1"
    )
    less = load_mesh(file, drop_invalid=True, drop_degenerate=True)
    np.testing.assert_array_equal(less.triangles, [corners[0], corners[2]])
    assert less.dropped == 5 and less.degenerate == 0
    assert less.remark.endswith("; 1 with no area, the first triangle 4")


def test_nothing_is_left(tmp_path):
    for name in ("nan.ply", "below.ply"):
        (tmp_path / name).write_bytes(BAD[name][0])
        with pytest.raises(RtbenchError, match="1 of 1 triangles dropped") as caught:
            load_mesh(tmp_path / name, drop_invalid=True)
        assert "\n" not in str(caught.value) and str(caught.value).endswith("; none is left")


def test_a_file_without_faults_says_nothing(tmp_path):
    file = tmp_path / "three.ply"
    file.write_text(HEAD.format(faces=1) + CORNERS + "3 0 1 2\n", encoding="ascii")
    for found in (load_mesh(file), load_mesh(file, True, True)):
        assert (found.dropped, found.remark, len(found.faces)) == (0, "", 1)


def test_files_larger_than_the_memory(tmp_path, monkeypatch):
    file = tmp_path / "large.ply"
    file.write_text(HEAD.format(faces=1) + CORNERS + "3 0 1 2\n", encoding="ascii")
    size = file.stat().st_size
    monkeypatch.setattr(meshes, "available_memory", lambda: 20 * size - 1)
    with pytest.raises(RtbenchError, match=r"^mesh '.*large.ply' is too large: 0\.0 MB take up"):
        load_mesh(file)
    for enough in (20 * size, None):
        monkeypatch.setattr(meshes, "available_memory", lambda enough=enough: enough)
        assert len(load_mesh(file).faces) == 1

    def exhausted(*_, **__):
        raise MemoryError

    monkeypatch.setattr("trimesh.load_mesh", exhausted)
    with pytest.raises(RtbenchError, match="asks for more memory than there is"):
        load_mesh(file)


def test_memory_that_can_be_had(tmp_path, monkeypatch):
    told = tmp_path / "meminfo"
    monkeypatch.setattr(meshes, "MEMINFO", told)
    assert meshes.available_memory() is None
    told.write_text("MemTotal:  9 kB\n", encoding="ascii")
    assert meshes.available_memory() is None
    told.write_text("MemTotal:  9 kB\nMemAvailable:   7 kB\n", encoding="ascii")
    assert meshes.available_memory() == 7168


def exactly_flat(triangle):
    a, b, c = ([Fraction(float(x)) for x in corner] for corner in triangle)
    e, f = ([x - y for x, y in zip(p, a, strict=True)] for p in (b, c))
    return all(e[i] * f[j] == e[j] * f[i] for i, j in ((0, 1), (1, 2), (2, 0)))


def test_area_is_decided_exactly():
    random = np.random.default_rng(5)
    start, way = random.integers(-50, 51, (2, 300, 3)).astype(float)
    part = random.integers(-4, 5, (300, 2))
    flat = np.stack([start, start + part[:, :1] * way, start + part[:, 1:] * way], axis=1)
    scale = 2.0 ** random.integers(-900, 900, (300, 1, 1))
    nearly = (flat + np.array([7e3, -1e4, 3.0])) / 7  # rounded: mostly not on a line any more
    wide = random.normal(size=(300, 3, 3)) * 10.0 ** random.integers(-300, 300, (300, 3, 3))
    tiny = random.integers(-3, 4, (300, 3, 3)) * 2.0**-1074
    for triangles in (flat, flat * scale, nearly, wide, tiny, np.concatenate([flat, wide])):
        expected = [exactly_flat(triangle) for triangle in triangles]
        np.testing.assert_array_equal(without_area(triangles), expected)
    assert without_area(flat).all() and 0 < np.count_nonzero(without_area(nearly)) < 150
    assert (
        without_area(np.zeros((0, 3, 3))).shape == (0,) and without_area(np.zeros((2, 3, 3))).all()
    )


def test_what_is_no_file(tmp_path):
    with pytest.raises(RtbenchError, match="cannot be read: no such file"):
        load_mesh(tmp_path / "nothing.ply")
    with pytest.raises(RtbenchError, match="cannot be read: is a folder"):
        load_mesh(tmp_path)


def test_trimesh_is_imported_by_who_reads_a_file_only():
    code = (
        "import sys; from rtbench.workloads.solids import cube; cube(); "
        "print('trimesh' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_models_of_a_folder(tmp_path, monkeypatch):
    monkeypatch.delenv(meshes.MODELS, raising=False)
    assert meshes.models() == {}
    for name in ("b.ply", "a.ply", "notes.md"):
        (tmp_path / name).touch()
    assert list(meshes.models(tmp_path)) == ["a", "b"]
    monkeypatch.setenv(meshes.MODELS, str(tmp_path / "nowhere"))
    assert meshes.models() == {}


# Triangles, open edges (None: they take seconds) and triangles without area, as the makers of the
# files counted them.
KNOWN = {
    "armadillo": (86_482, 0, 0),
    "fandisk": (12_946, 0, 0),
    "bunny": (69_451, 223, 0),
    "teapot": (6_320, 1_036, 0),
    "dragon": (871_414, None, 108),
    "buddha": (1_087_716, None, 30_997),
}


@pytest.mark.parametrize("name", KNOWN)
def test_known_models(name):
    there = meshes.models()
    if name not in there:
        pytest.skip(f"no {name}.ply: {meshes.MODELS} is {os.environ.get(meshes.MODELS)!r}")
    found = load_mesh(there[name])
    triangles, open_edges, degenerate = KNOWN[name]
    assert (len(found.faces), found.degenerate) == (triangles, degenerate)
    assert open_edges is None or found.open_edges == open_edges
