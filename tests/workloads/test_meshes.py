"""Meshes: generated ones are closed, files are read as they stand, bad files are told in a line."""

import math
import os
import struct
import subprocess
import sys

import numpy as np
import pytest

from rtbench.errors import RtbenchError
from rtbench.workloads import meshes
from rtbench.workloads.meshes import (
    Mesh,
    cube,
    icosphere,
    load_mesh,
    random_sphere,
    tetrahedron,
)

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


def directed_edges(mesh):
    return [(int(f[i]), int(f[(i + 1) % 3])) for f in mesh.faces for i in range(3)]


def volume(mesh):
    return float(np.linalg.det(mesh.triangles).sum() / 6)


def test_generated_meshes_are_closed_and_face_outward(mesh):
    edges = directed_edges(mesh)
    assert len(set(edges)) == len(edges) and {(b, a) for a, b in edges} == set(edges)
    assert mesh.closed and mesh.open_edges == 0
    corners, sides = len(np.unique(mesh.faces)), len(edges) // 2
    assert corners == len(mesh.vertices)
    assert corners - sides + len(mesh.faces) == 2  # a sphere, by Euler
    assert (np.linalg.det(mesh.triangles) > 0).all()  # each side is seen from the centre


def test_sizes_and_volumes():
    assert len(random_sphere().faces) == 2 * 16 + 2 * 16 * 13
    assert len(icosphere(3).faces) == 1280 and len(cube().faces) == 12
    assert volume(cube()) == pytest.approx(8)
    assert volume(tetrahedron()) == pytest.approx(8 / (9 * math.sqrt(3)))
    # Volumes of inscribed polyhedra come near to that of the sphere from below.
    found = [volume(icosphere(k)) for k in range(5)]
    assert found == sorted(found) and found[-1] < 4 / 3 * math.pi < 1.005 * found[-1]
    for k in range(3):
        np.testing.assert_allclose(np.linalg.norm(icosphere(k).vertices, axis=1), 1, rtol=1e-14)
    radius = np.linalg.norm(random_sphere(radii=(1, 6)).vertices, axis=1)
    assert 1 <= radius.min() < 2 and 5 < radius.max() <= 6


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


def test_not_allowed():
    for wrong in (-1, 9):
        with pytest.raises(RtbenchError, match=f"subdivisions {wrong} is not allowed"):
            icosphere(wrong)
    with pytest.raises(RtbenchError, match="rings 2 is not allowed"):
        random_sphere(2)


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
        r"1 of 2 triangles name vertices that are not there, the first vertex 7 \(allowed: 0 to 2",
    ),
    "below.ply": ((HEAD.format(faces=1) + CORNERS + "3 0 1 -1\n").encode(), "first vertex -1"),
    "nan.ply": (
        (HEAD.format(faces=1) + "0 0 0\nnan 0 0\n0 inf 0\n3 0 1 2\n").encode(),
        "2 of 3 vertices are not finite, the first vertex 1",
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


def test_what_is_no_file(tmp_path):
    with pytest.raises(RtbenchError, match="cannot be read: no such file"):
        load_mesh(tmp_path / "nothing.ply")
    with pytest.raises(RtbenchError, match="cannot be read: is a folder"):
        load_mesh(tmp_path)


def test_trimesh_is_imported_by_who_reads_a_file_only():
    code = "import sys, rtbench.workloads.meshes as m; m.cube(); print('trimesh' in sys.modules)"
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


# Triangles and open edges as the makers of the files counted them.
KNOWN = {
    "armadillo": (86_482, 0),
    "fandisk": (12_946, 0),
    "bunny": (69_451, 223),
    "teapot": (6_320, 1_036),
}


@pytest.mark.parametrize("name", KNOWN)
def test_known_models(name):
    there = meshes.models()
    if name not in there:
        pytest.skip(f"no {name}.ply: {meshes.MODELS} is {os.environ.get(meshes.MODELS)!r}")
    found = load_mesh(there[name])
    assert (len(found.faces), found.open_edges) == KNOWN[name]
