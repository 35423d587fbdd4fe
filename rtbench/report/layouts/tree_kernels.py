"""Tables of kernels in trees: every kernel by every way, and what accuracy costs in a tree."""

from rtbench.report import machine
from rtbench.report.digits import absent, interval, measured
from rtbench.report.tables import Cell, Table
from rtbench.report.tree_cells import Timed, clock_note, file_name, tree_name
from rtbench.report.trees import Trees

REFERENCE = "moller_trumbore", "float32"  # what accuracy is bought from
_COUNTS = ("wrong", "rays_judged", "exact_wrong", "exact_judged")


def kernels_tables(trees: Trees) -> list[Table]:
    """Return ns a ray of every kernel in every structure by every way: a table a model.

    Parameters
    ----------
    trees : Trees

    Returns
    -------
    list of Table
        A row a ray set, kernel and precision; a column a tree and way. A model with one kernel in
        one way has no rows.
    """
    return [table for model in trees.models if (table := kernels_table(trees, model)).rows]


def kernels_table(trees: Trees, model: str) -> Table:
    """Return ns a ray of every kernel by every way through every tree of a model."""
    ours = [one for one in trees.of(model) if one.ours]
    heads = dict.fromkeys(head_of(one) for one in ours)
    rows: dict[tuple, dict] = {}
    raw = []
    for one in sorted(ours, key=lambda one: trees.ray_sets(model).index(one.cell["rays"])):
        key = one.cell["rays"], *one.form
        row = rows.setdefault(key, {n: one.cell[n] for n in ("rays", "kernel", "precision")})
        estimate = trees.median(one)
        ends = estimate.interval() or (None, None)
        span = interval(estimate.value, *ends, most=1)
        text = f"{measured(estimate.value, *ends, most=1).text} {span}".strip()
        row[head_of(one)] = Cell(estimate.value, text)
        raw.append(one.cell | {"ns_per_ray": estimate.value, "low": ends[0], "high": ends[1]})
    # With one way there is one column: what accuracy costs tells as much.
    several = len({(one.key, one.cell["way"]) for one in ours}) > len({one.key for one in ours})
    enough = len(heads) > 1 and (trees.only_kernels(model) or several)
    columns = ["rays", "kernel", *(["precision"] if len({r[2] for r in rows}) > 1 else [])]
    return Table(
        f"tree-kernels-{file_name(model)}",
        list(rows.values()) if enough else [],
        [*columns, *heads],
        f"{model}, {trees.triangles(model):,} triangles: ns a ray and 95 % interval, by kernel, "
        "tree and way",
        [*(n for n in trees.run.cell), "ns_per_ray", "low", "high"],
        raw,
        notes=[
            "packets: 16 neighbouring rays together; lanes: 32 rays, each on a way of its own; "
            "blocks: one ray against 8 triangles; stack: one by one; wide: 8 boxes at a time",
            clock_note(ours),
            machine.provenance(trees.run),
        ],
    )


def head_of(timed: Timed) -> str:
    """Return a tree and a way in words: SAH stack; the structure alone where it says enough."""
    name = tree_name(timed.key, endings=False)
    return f"{'k-d' if name == 'SAH' else name}, {timed.cell['way']}"


def accuracy_tables(trees: Trees) -> list[Table]:
    """Return what each kernel's accuracy costs in a tree, and what it gets wrong: a table a model.

    Parameters
    ----------
    trees : Trees

    Returns
    -------
    list of Table
        Only of models of which answers were judged with several kernels or precisions.
    """
    return [table for model in trees.models if (table := accuracy_table(trees, model)).rows]


def accuracy_table(trees: Trees, model: str) -> Table:
    """Return time beside wrong answers: a row a ray set, tree, way, kernel and precision."""
    ours = [one for one in trees.of(model) if one.ours]
    judged = {one.form for one in ours if trees.wrong(one)}
    rows = []
    for rays in trees.ray_sets(model) if len(judged) > 1 else ():
        for one in (one for one in ours if one.cell["rays"] == rays):
            rows.append(_row(trees, one, ours))
    rows += _untimed(trees, model) if rows else []
    columns = ["rays", "tree", "kernel", "precision", "ns_per_ray", "interval"]
    columns += ["ratio", "ratio_interval", "wrong", "exact_wrong"]
    known = {name for row in rows for name, value in row.items() if value}
    columns = [name for name in columns if name in known]
    raw = [n for n in trees.run.cell if n != "rays"]
    raw = ["rays", *raw, "ns_per_ray", "low", "high", "ratio", "ratio_low", "ratio_high", *_COUNTS]
    return Table(
        f"tree-accuracy-{file_name(model)}",
        rows,
        columns,
        f"{model}, {trees.triangles(model):,} triangles: what accuracy costs inside a tree",
        raw,
        headers={
            "ns_per_ray": "ns/ray",
            "interval": "95 %",
            "ratio": f"x {' '.join(REFERENCE)}",
            "ratio_interval": "95 %",
            "wrong": "unlike brute force",
            "exact_wrong": "wrong, exactly",
        },
        notes=[
            "unlike brute force: rays that the kernel answers otherwise without a tree; wrong, "
            "exactly: by the exact oracle",
            *([clock_note(ours)] if ours else []),
            machine.provenance(trees.run),
        ],
    )


def _row(trees: Trees, one: Timed, ours: list[Timed]) -> dict:
    estimate = trees.median(one)
    ends = estimate.interval() or (None, None)
    row = one.cell | {"tree": head_of(one)}
    row |= {"ns_per_ray": measured(estimate.value, *ends, most=1), "low": ends[0]}
    row |= {"interval": interval(estimate.value, *ends, most=1), "high": ends[1]}
    same = one.key, one.cell["way"], one.cell["rays"]
    first = [
        o for o in ours if o.form == REFERENCE and (o.key, o.cell["way"], o.cell["rays"]) == same
    ]
    ratio = trees.ratio(one, first[0]) if first else None
    if first and first[0] is one:
        row["ratio"] = Cell(1.0, "1")
    elif ratio is not None:
        low, high = ratio.interval() or (None, None)
        row["ratio"] = measured(ratio.value, low, high, 2)
        row |= {"ratio_interval": interval(ratio.value, low, high, most=2)}
        row |= {"ratio_low": low, "ratio_high": high}
    return row | _counts(trees.wrong(one))


def _untimed(trees: Trees, model: str) -> list[dict]:
    """Return what was judged of ray sets that were not timed, aimed ones at vertices and edges."""
    timed = set(trees.ray_sets(model))
    rows = []
    for row in trees.run.visits.to_dict("records"):
        known = row["model"] == model and row["rays"] not in timed
        if known and any(not absent(row.get(name)) for name in ("wrong", "exact_wrong")):
            told = {name: None if absent(row[name]) else int(row[name]) for name in _COUNTS}
            names = {name: row[name] for name in ("model", "rays", "kernel", "precision")}
            rows.append(names | {"tree": ""} | _counts(told))
    return rows


def _counts(told: dict) -> dict:
    found = dict(told)
    for name, of in (("wrong", "rays_judged"), ("exact_wrong", "exact_judged")):
        if not absent(told.get(name)):
            whole = told.get(of)
            words = f"{told[name]:,}" + (f" of {whole:,}" if not absent(whole) else "")
            found[name] = Cell(told[name], words)
        else:
            found.pop(name, None)
    return found
