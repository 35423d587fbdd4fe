"""Field cases about edges, corners and closed meshes: where other projects leaked or hit twice."""

from __future__ import annotations

import numpy as np

from rtbench.workloads.hard_cases.field_list import FieldList
from rtbench.workloads.hard_cases.geometry import Format, Geometry, Random, flatness, unit, ways
from rtbench.workloads.hard_cases.shared import FAR, icosahedron

SQUARE = np.array([[-1.0, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0]])
HALVES = np.array([[0, 1, 2], [2, 3, 0]])
SIDES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)


def box(size=1.0, middle=(0.0, 0, 0)) -> np.ndarray:
    """Return the (12, 3, 3) triangles of a box of edges of these lengths."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners = corners * np.asarray(size) / 2 + middle
    return np.concatenate([corners[SIDES[:, [0, 1, 2]]], corners[SIDES[:, [2, 3, 0]]]])


def sphere(random: Random, around: int = 16, down: int = 16) -> tuple[np.ndarray, np.ndarray]:
    """Return corners and faces of a closed sphere whose corners have random radii of 1 to 6.

    Source: pbrt-v4, shapes_test.cpp, Triangle.Watertight; without its triangles of no area.
    """
    theta = np.pi * np.arange(1, down) / down
    phi = 2 * np.pi * np.arange(around) / around
    rings = np.stack(
        [
            np.sin(theta)[:, None] * np.cos(phi),
            np.sin(theta)[:, None] * np.sin(phi),
            np.cos(theta)[:, None] + 0 * phi,
        ],
        axis=2,
    ).reshape(-1, 3)
    corners = np.concatenate([rings, [[0, 0, 1], [0, 0, -1]]])
    corners *= random.uniform(1, 6, (len(corners), 1))
    north, south = len(rings), len(rings) + 1
    faces = []
    for i in range(around):
        j = (i + 1) % around
        faces += [(north, i, j), (south, i + (down - 2) * around, j + (down - 2) * around)]
        for ring in range(down - 2):
            a, b = i + ring * around, j + ring * around
            faces += [(a, a + around, b), (b, a + around, b + around)]
    return corners, np.array(faces)


def closed_around(triangles: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> bool:
    """Whether triangles about the corner that a ray goes through surround the ray once.

    As seen along the ray their edges away from it all turn the same way, each clearly.
    """
    corner = origin + direction
    around = triangles - corner
    nearest = np.abs(around).sum(axis=2).argmin(axis=1)
    rows = np.arange(len(around))
    one, other = around[rows, (nearest + 1) % 3], around[rows, (nearest + 2) % 3]
    turn = flatness(one, other, np.broadcast_to(direction, one.shape))
    return bool((turn > 0.01).all() or (turn < -0.01).all())


def field_shared(random: Random, form: Format, n: int) -> Geometry:
    """Field cases of a ray against all triangles around it; see `field_list`."""
    cases = FieldList(form)
    quad = 5 * SQUARE[[0, 3, 2, 1]]
    cases.group(
        "quad diagonal",
        "Oblikovati #2146",
        quad[[[0, 1, 2], [0, 2, 3]]],
        [0, 0, 10],
        [0.30458447, 0.30458447, -0.9024725],
    )
    cases.group("square diagonal", "trimesh #1766", SQUARE[HALVES], [0, 0, 1], [0, 0, -1])

    turn = (
        1 + np.array([[0, -(3**0.5), 3**0.5], [3**0.5, 0, -(3**0.5)], [-(3**0.5), 3**0.5, 0]])
    ) / 3
    rotated = SQUARE @ turn.T
    for x in np.linspace(-0.9, 0.9, 6):
        for y in np.linspace(-0.9, 0.9, 6):
            origin = form.round(turn @ [x, y, 2.0])
            middle = (form.round(rotated)[0] + form.round(rotated)[2]) / 2
            cases.group(
                "rotated quad, centre of the diagonal",
                "Mitsuba test10",
                rotated[HALVES],
                origin,
                (middle - origin) * random.uniform(0.5, 2),
            )

    inner = random.uniform(-0.4, 0.4, 2)
    split = np.concatenate([SQUARE, [[*inner, 0.0]]])
    for x in np.linspace(-0.7, 0.7, 6):
        for share in (0.0, 0.25, 0.5):
            origin = np.array([x, -0.3 * x, 3.0])
            target = (1 - share) * form.round(split[4]) + share * split[2]
            cases.group(
                "randomly split sheet",
                "VK-CTS ray tracing watertightness",
                split[[[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]],
                origin,
                target - form.round(origin),
            )

    corners, faces = sphere(random)
    corners = form.round(unit(corners) / 2)
    for corner in np.flatnonzero(np.abs(corners[:, 2] - 0.4) < 0.06):
        origin = np.array([0, 0, 2.0])
        own = corners[faces[(faces == corner).any(axis=1)]]
        direction = corners[corner] - origin
        if closed_around(own, origin, direction):
            cases.group("sphere of radius 1/2 seen from (0, 0, 2)", "YAR", own, origin, direction)

    corners, faces = sphere(random)
    corners = form.round(corners)
    for number, corner in enumerate(random.permutation(len(corners) - 2)[:30]):
        origin = form.round(0.5 * random.random() * ways(random) * (number % 2))
        own = corners[faces[(faces == corner).any(axis=1)]]
        direction = corners[corner] - origin
        if closed_around(own, origin, direction):
            cases.group(
                "sphere of random radii, at its corners",
                "pbrt-v4 Triangle.Watertight",
                own,
                origin,
                direction,
            )

    for angle in (0, 1, 2):
        _nested_cylinders(cases, form, angle)
    for i in range(8):
        pixel = np.array([(i + 0.5) / 4 - 1, (i + 0.5) / 4 - 1, 0])
        camera = np.array([0, 0, -3.0])
        name, source = "symmetric camera, pixel centres on the diagonal", "madmann #51, embree #109"
        cases.group(name, source, SQUARE[HALVES], camera, pixel - camera)
    for x in np.linspace(-0.875, 0.875, 8):
        name, source = "one hit on an edge", "embree #188, trimesh #2317"
        cases.group(name, source, SQUARE[HALVES], [x, x, 1 + x], [0, 0, -1])
    plane = form.round(FAR + SQUARE)
    for _ in range(10):
        share = random.uniform(0.1, 0.9)
        origin = form.round(FAR + np.append(random.uniform(-1, 1, 2), 2))
        cases.group(
            "plane far away",
            "embree watertight tests",
            plane[HALVES],
            origin,
            unit((1 - share) * plane[0] + share * plane[2] - origin),
        )
    return cases.geometry()


def _nested_cylinders(cases: FieldList, form: Format, number: int, around: int = 12) -> None:
    """Add ten cylinders, each with the six triangles at the corner that a ray from inside meets."""
    phi = 2 * np.pi * (np.arange(-1, 2) + number) / around
    rings = np.array([[[np.cos(a), np.sin(a), z] for a in phi] for z in (-1.0, 0, 1)])
    low, mid, high = ([(row, i) for i in range(3)] for row in range(3))
    # Of a grid whose squares are split by parallel diagonals, the six at mid[1].
    faces = [
        (low[1], mid[1], mid[0]),
        (low[1], low[2], mid[1]),
        (low[2], mid[2], mid[1]),
        (mid[0], mid[1], high[0]),
        (mid[1], high[1], high[0]),
        (mid[1], mid[2], high[1]),
    ]
    direction = form.round(6 * rings)[1, 1]
    for radius in range(1, 11):
        shell = form.round(radius * rings)
        triangles = np.array([[shell[corner] for corner in face] for face in faces])
        cases.group(
            "ray through a corner of the sixth of ten cylinders",
            "embree #181",
            triangles,
            [0, 0, 0],
            direction,
        )


def field_closed(random: Random, form: Format, n: int) -> Geometry:
    """Field cases of a ray from inside a closed mesh; see `field_list`."""
    cases = FieldList(form)
    room = box((2, 3, 5))
    for corner in np.unique(room.reshape(-1, 3), axis=0):
        cases.group(
            "corner of a box from its centre", "trimesh test_on_vertex", room, [0] * 3, corner
        )
    small = box(40)
    for y in (-30, -15, 0, 15, 30):
        for z in (-30, -15, 0, 15, 30):
            name = "small box, rays to corners of the big one"
            cases.group(name, "trimesh #1496", small, [0, 0, 0], [30, y, z])

    corners, faces = icosahedron()
    for mesh in (corners[faces], box(1)):
        shape = form.round(mesh + random.uniform(-0.5, 0.5, 3))
        centroid = form.round(shape.reshape(-1, 3).mean(axis=0))
        for _ in range(6):
            edge = shape[random.integers(len(shape)), :2]
            target = edge[0] + random.random() * (edge[1] - edge[0])
            name = "centroid to a random point of an edge"
            cases.group(name, "FCPW", shape, centroid, target - centroid)
    for k in range(6):
        shape = form.round(FAR + corners[faces] * random.uniform(1, 3))
        target = shape[random.integers(20), 0]
        origin = form.round(FAR + 0.3 * ways(random))
        name = "sphere far away, at its corners"
        direction = (target - origin) * (1 if k % 2 else random.uniform(0.5, 2))
        cases.group(name, "embree watertight tests", shape, origin, direction)
    return cases.geometry()
