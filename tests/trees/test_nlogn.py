"""The O(N log N) builder against the rules, in plain Python, and what any tree must keep."""

import math

import numpy as np
import pytest

from rtbench.trees.builders import nlogn
from rtbench.trees.cost import model, split_cost
from rtbench.trees.geometry import Geometry
from rtbench.trees.nodes import LEAF, NODE, KdTree
from rtbench.trees.options import Options
from rtbench.trees.overlap import FITS


class ByTheRules:
    """A tree built cell after cell, every plane judged by counting all references."""

    def __init__(self, geometry, options):
        self.geometry, self.options = geometry, options
        self.model = model(options)
        self.fit = FITS[options.overlap][0]
        self.room = np.empty((2, 12, 3))
        self.nodes, self.refs, self.depth = [None], [], 0
        local = geometry.corners.astype(float) - geometry.base
        self.triangles = [tuple(map(float, each.ravel())) for each in local]
        held = {i: box.astype(float) for i, box in enumerate(geometry.boxes)}
        self.cut(0, 0, geometry.box.astype(float), held)

    def tree(self):
        nodes = np.array(self.nodes, NODE)
        refs = np.array(self.refs, np.int32)
        return KdTree(nodes, refs, self.geometry.box, self.depth, self.options)

    def cut(self, node, depth, cell, held):
        plane = self.plane(depth, cell, held)
        if plane is None:
            self.nodes[node] = (len(self.refs) << 2 | LEAF, len(held))
            self.refs += sorted(held)
            self.depth = max(self.depth, depth)
            return
        axis, position, planar_left = plane
        child = len(self.nodes)
        self.nodes[node] = (child << 2 | axis, position)
        self.nodes += [None, None]
        cells = [cell.copy(), cell.copy()]
        cells[0][axis + 3] = cells[1][axis] = position
        parts = {}, {}
        for i, box in held.items():
            low, high = box[axis], box[axis + 3]
            if low < position < high:
                for part, its_cell in zip(parts, cells, strict=True):
                    box_of = (tuple(map(float, box)), tuple(map(float, its_cell)))
                    inside, *fitted = self.fit(self.triangles[i], *box_of, self.room)
                    if inside:
                        part[i] = np.array(fitted)
            elif low == position == high:
                parts[0 if planar_left else 1][i] = box
            else:
                parts[0 if high <= position else 1][i] = box
        self.cut(child, depth + 1, cells[0], parts[0])
        self.cut(child + 1, depth + 1, cells[1], parts[1])

    def plane(self, depth, cell, held):
        options, n = self.options, len(held)
        x, y, z = cell[3:] - cell[:3]
        if n == 0 or depth >= options.deepest(len(self.geometry)):
            return None
        if x * y + y * z + z * x == 0 or (options.ending != "automatic" and n <= options.max_leaf):
            return None
        best = (math.inf, None)
        for axis in self.axes(depth, (x, y, z)):
            for cost, *plane in self.judged(axis, cell, np.array(list(held.values()))):
                if cost < best[0]:
                    best = cost, (axis, *plane)
        uncut = options.intersection_cost * math.ceil(n / options.block)
        return None if options.ending != "ad_hoc" and best[0] >= uncut else best[1]

    def axes(self, depth, extents):
        if self.options.axes == "all":
            return range(3)
        return [depth % 3 if self.options.axes == "round_robin" else int(np.argmax(extents))]

    def judged(self, axis, cell, boxes):
        low, high = boxes[:, axis], boxes[:, axis + 3]
        extents, n = cell[3:] - cell[:3], len(boxes)
        for position in self.candidates(low, high):
            left, right = (low < position).sum(), (high > position).sum()
            planar = ((low == position) & (high == position)).sum()
            inner = cell[axis] < position < cell[axis + 3]
            flat = self.options.flat_cells and 0 < planar < n and extents[axis] > 0
            at = (*map(float, extents), axis, float(position - cell[axis]))
            if inner or (flat and position == cell[axis]):
                yield split_cost(*at, int(left + planar), int(right), self.model), position, True
            if (inner and planar) or (flat and position == cell[axis + 3]):
                yield split_cost(*at, int(left), int(right + planar), self.model), position, False

    def candidates(self, low, high):
        if self.options.candidates == "all":
            return np.unique([low, high])
        median = np.sort((low + high) * 0.5)[(len(low) - 1) // 2]
        return np.unique(np.where(abs(low - median) <= abs(high - median), low, high))


def soup(n, size, seed=5):
    draw = np.random.default_rng(seed)
    return draw.random((n, 1, 3)) + size * (draw.random((n, 3, 3)) - 0.5)


def field(n):  # abutting triangles: each plane between two squares is shared
    x, y = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    z = (x * y) % 3 / 2.0
    corner = np.stack([x, y, z], axis=-1).reshape(-1, 1, 3)
    lower, upper = np.eye(3)[[2, 0, 1]] * [1, 1, 0], np.eye(3)[[2, 0, 1]] * [1, 1, 0.5]
    upper[0, :2] = 1
    return np.concatenate([corner + lower, corner + upper])


def walls():  # axis-parallel triangles in a few planes, many of them in sides of the scene
    flat = np.random.default_rng(8).integers(0, 5, (60, 3, 3)).astype(float)
    for i, triangle in enumerate(flat):
        triangle[:, i % 3] = triangle[0, i % 3]
    return flat


def degenerate():
    points = np.repeat(np.random.default_rng(9).integers(0, 4, (20, 1, 3)), 3, axis=1)
    lines = np.random.default_rng(10).integers(0, 4, (20, 3, 3))
    lines[:, :, :2] = lines[:, :1, :2]
    return np.concatenate([points, lines]).astype(float)


SCENES = {
    "soup": soup(80, 0.3),
    "large triangles": soup(60, 3.0),
    "field": field(7),
    "walls": walls(),
    "duplicates": np.repeat(soup(25, 0.5), 4, axis=0),
    "degenerate": degenerate(),
    "coplanar": soup(60, 0.3) * [1, 1, 0],
    "on a line": soup(20, 0.3) * [0, 1, 0],
    "one": soup(1, 1.0),
}
CHOICES = {
    "defaults": {},
    "cost alone": {"ending": "automatic", "traversal_cost": 0.5},
    "ad hoc": {"ending": "ad_hoc", "max_leaf": 3, "traversal_cost": 30.0},
    "shallow": {"ending": "ad_hoc", "max_depth": 4},
    "longest": {"axes": "longest", "empty_bonus": 1.0},
    "round robin": {"axes": "round_robin", "traversal_cost": 1.0},
    "no flat cells": {"flat_cells": False, "traversal_cost": 1.0},
    "blocks": {"block": 8, "max_leaf": 8},
    "blocks of 3": {"block": 3, "intersection_cost": 3.0},
    "free": {"empty_bonus": 0.0, "traversal_cost": 0.3},
}


def same(geometry, options):
    made, wanted = nlogn.build(geometry, options), ByTheRules(geometry, options).tree()
    np.testing.assert_array_equal(made.nodes, wanted.nodes)
    np.testing.assert_array_equal(made.refs, wanted.refs)
    assert (made.digest, made.depth) == (wanted.digest, wanted.depth)
    return made


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("overlap", ["box", "clipped"])
def test_trees_are_those_of_the_rules(scene, overlap):
    geometry = Geometry.of(SCENES[scene])
    trees = [same(geometry, Options(overlap=overlap, **chosen)) for chosen in CHOICES.values()]
    if len(geometry) > 20:
        assert len({tree.digest for tree in trees}) > 3  # the options do something


@pytest.mark.parametrize("scene", SCENES)
def test_trees_of_half_the_candidates_are_those_of_the_rules(scene):
    geometry = Geometry.of(SCENES[scene] + 1e6, "float64")
    for chosen in ({}, {"axes": "longest", "traversal_cost": 1.0}, {"flat_cells": False}):
        same(geometry, Options(candidates="half", **chosen))


def cells(tree):
    """Yield node, depth and box of all leaves; each node must be met once."""
    met = np.zeros(len(tree.nodes), int)
    waiting = [(0, 0, tree.box)]
    while waiting:
        node, depth, cell = waiting.pop()
        met[node] += 1
        link, split = int(tree.nodes["link"][node]), tree.nodes["split"][node]
        axis, child = link & 3, link >> 2
        if axis == LEAF:
            yield tree.refs[child : child + int(split)], depth, cell
            continue
        below, above = cell.copy(), cell.copy()
        below[axis + 3] = above[axis] = split
        waiting += [(child, depth + 1, below), (child + 1, depth + 1, above)]
    assert (met == 1).all()


@pytest.mark.parametrize("overlap", ["box", "clipped"])
def test_leaves_have_all_that_lies_in_them(overlap):
    triangles = np.concatenate([soup(1500, 0.1), soup(50, 1.0, 6), walls() / 4, field(6) / 6])
    geometry = Geometry.of(triangles)
    weights = np.random.default_rng(3).dirichlet(np.ones(3), (len(geometry), 20))
    points = weights @ (geometry.corners.astype(float) - geometry.base)
    points = np.clip(points, geometry.boxes[:, None, :3], geometry.boxes[:, None, 3:])
    covered = np.zeros(points.shape[:2], bool)
    tree = nlogn.build(geometry, Options(overlap=overlap, traversal_cost=1.0))
    deepest, found = 0, 0
    for refs, depth, cell in cells(tree):
        assert (np.diff(refs) > 0).all()
        deepest, found = max(deepest, depth), found + len(refs)
        covered[refs] |= ((points[refs] >= cell[:3]) & (points[refs] <= cell[3:])).all(axis=2)
        if overlap == "box" and (cell[:3] < cell[3:]).all():
            inside = (geometry.boxes[:, :3] < cell[3:]) & (geometry.boxes[:, 3:] > cell[:3])
            assert set(np.flatnonzero(inside.all(axis=1))) <= set(refs)
    assert found == len(tree.refs) and deepest == tree.depth <= tree.options.deepest(len(geometry))
    assert covered.all()


def test_arrays_grow_and_steps_are_reported(monkeypatch):
    geometry = Geometry.of(soup(1000, 1.0))
    options = Options(overlap="box", ending="ad_hoc", max_depth=6)
    grown, reported = [], []
    longer = nlogn.longer
    monkeypatch.setattr(nlogn, "longer", lambda *args: grown.append(args[1]) or longer(*args))
    whole = nlogn.build(geometry, options)
    assert len(grown) > 3
    monkeypatch.setattr(nlogn, "WORK", 1)
    assert nlogn.build(geometry, options, reported.append).digest == whole.digest
    assert len(reported) > 30 and reported[-1] > 0.9
    assert all(0 <= fraction <= 1 for fraction in reported)


def test_builds_can_be_interrupted(monkeypatch):
    def interrupt(fraction):
        raise KeyboardInterrupt

    monkeypatch.setattr(nlogn, "WORK", 1)
    with pytest.raises(KeyboardInterrupt):
        nlogn.build(Geometry.of(soup(1000, 0.1)), Options(overlap="box"), interrupt)
