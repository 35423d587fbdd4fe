"""The rules of a tree in plain Python: planes and triangles one by one, no sorting, no counting up.

Only the cost of a given plane and the overlap test are the package's own.
"""

import numpy as np

from rtbench.trees import cost
from rtbench.trees.overlap import FITS


def side_of(low, high, plane):
    """Return on which side of a plane an interval lies."""
    if high < plane or (high == plane and low < plane):
        return "left"
    if low > plane or (low == plane and high > plane):
        return "right"
    return "planar" if low == high == plane else "both"


def half(boxes, axis):
    """Return of each box the side nearer to the lower median of their middles."""
    middles = sorted((low + high) * 0.5 for low, high in boxes[:, [axis, axis + 3]])
    median = middles[(len(middles) - 1) // 2]
    return [
        low if abs(low - median) <= abs(high - median) else high
        for low, high in boxes[:, [axis, axis + 3]]
    ]


def planes(cell, boxes, depth, options):
    """Yield (cost, axis, position, planar side) of all planes that are allowed."""
    x, y, z = size = cell[3:] - cell[:3]
    axes = {
        "all": (0, 1, 2),
        "longest": (int(np.argmax(size)),),
        "round_robin": (depth % 3,),
    }[options.axes]
    n = len(boxes)
    for axis in axes:
        low, high = cell[axis], cell[axis + 3]
        found = half(boxes, axis) if options.candidates == "half" else boxes[:, [axis, axis + 3]]
        for plane in set(np.ravel(found)):
            sides = [side_of(*box[[axis, axis + 3]], plane) for box in boxes]
            left = sides.count("left") + sides.count("both")
            right = sides.count("right") + sides.count("both")
            planar = sides.count("planar")
            flat = options.flat_cells and 0 < planar < n and low < high
            for side, below, beyond, edge in (
                (0, left + planar, right, low),
                (1, left, right + planar, high),
            ):
                if low < plane < high or (flat and plane == edge):
                    costs = cost.split_cost(
                        x, y, z, axis, plane - low, below, beyond, cost.model(options)
                    )
                    yield costs, axis, plane, side


def build(geometry, options):
    """Return the nodes, (link, split) each, and the references of a tree."""
    fit, room = FITS[options.overlap][0], np.empty((2, 12, 3))
    triangles = (geometry.corners - geometry.base).astype(np.float64).reshape(-1, 9)
    nodes, refs, deepest = [None], [], options.deepest(len(geometry))

    def cut(node, cell, depth, held):
        n, best = len(held), None
        x, y, z = cell[3:] - cell[:3]
        by_count = options.ending != "automatic" and n <= options.max_leaf
        if not by_count and depth < deepest and n and cost.area(x, y, z) > 0:
            boxes = np.array([box for _, box in held])
            best = min(planes(cell, boxes, depth, options), default=None)
        if best is not None and options.ending != "ad_hoc":
            best = best if best[0] < cost.leaf_cost(n, cost.model(options)) else None
        if best is None:
            nodes[node] = (len(refs) << 2 | 3, float(n))
            refs.extend(i for i, _ in held)
            return
        _, axis, plane, planar = best
        cells = np.array([cell, cell])
        cells[0, axis + 3] = cells[1, axis] = plane
        parts = [], []
        for i, box in held:
            where = side_of(box[axis], box[axis + 3], plane)
            if where == "both":
                for part, of in zip(parts, cells, strict=True):
                    inside, *own = fit(tuple(triangles[i]), tuple(box), tuple(of), room)
                    if inside:
                        part.append((i, np.array(own)))
            else:
                parts[{"left": 0, "right": 1, "planar": planar}[where]].append((i, box))
        child = len(nodes)
        nodes[node] = (child << 2 | axis, plane)
        nodes.extend([None, None])
        cut(child, cells[0], depth + 1, parts[0])
        cut(child + 1, cells[1], depth + 1, parts[1])

    boxes = geometry.boxes.astype(np.float64)
    cut(0, geometry.box.astype(np.float64), 0, list(enumerate(boxes)))
    return nodes, refs


def cells_of(tree):
    """Return the cells (n, 6) and the depths (n,) of a tree's nodes, in float64."""
    cells = np.zeros((len(tree.nodes), 6))
    depths = np.zeros(len(tree.nodes), int)
    cells[0] = tree.box
    for node, (link, split) in enumerate(tree.nodes.tolist()):  # parents come before children
        if link & 3 != 3:
            child, axis = link >> 2, link & 3
            cells[child] = cells[child + 1] = cells[node]
            cells[child, axis + 3] = cells[child + 1, axis] = split
            depths[child] = depths[child + 1] = depths[node] + 1
    return cells, depths


def expected_cost(tree):
    """Return what a ray is expected to pay (equation 3.6), over all nodes."""
    cells, _ = cells_of(tree)
    size = cells[:, 3:] - cells[:, :3]
    areas = (size * np.roll(size, 1, axis=1)).sum(axis=1)
    leaf, options = tree.is_leaf, tree.options
    tests = np.ceil(tree.nodes["split"] / options.block)
    inner = options.traversal_cost * areas[~leaf].sum()
    return (inner + options.intersection_cost * (areas * tests)[leaf].sum()) / areas[0]
