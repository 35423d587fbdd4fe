"""Which kernel is faster on each machine, and which pairs of kernels change places."""

from collections.abc import Sequence
from itertools import combinations

from rtbench.records.schema import EMPTY, MEAN
from rtbench.records.statistics import (
    NO_INTERVAL,
    Estimate,
    holm,
    kendall_tau,
    mean,
    p_value,
    ranking,
    ratio,
)

# A run's cells: the values of the cell's columns to the time of a test.
Cells = dict[tuple, Estimate]


def rank_runs(names: Sequence[str], columns: Sequence[str], tables: Sequence[Cells]) -> list[dict]:
    """Rank the kernels of each run over the densities that all of them have in all runs.

    Parameters
    ----------
    names : sequence of str
        The runs.
    columns : sequence of str
        The columns of a cell's key, kernel among them.
    tables : sequence of dict
        The cells of each run.

    Returns
    -------
    list of dict
        A dict a group (what is left of the cell without kernel and density: precision, order):
        ``group`` (dict), ``densities`` (list), ``kernels`` ({run: names, fastest first}), ``ns``
        ({run: {kernel: mean over the densities}}), ``tau`` ({run: Kendall's tau to the first run}),
        ``turnovers`` (list of dict, see `turnovers`). Groups with one kernel are left out.
    """
    groups = _groups(columns, tables)
    ranked = []
    for group, kernels in groups.items():
        densities = _shared_densities(kernels)
        if len(kernels) < 2 or not densities:
            continue
        keys = {name: [kernels[name][density] for density in densities] for name in kernels}
        means = [
            {name: mean([table[key] for key in keys[name]]) for name in keys} for table in tables
        ]
        orders = [ranking({name: one[name].value for name in one}) for one in means]
        first = [means[0][name].value for name in keys]
        ranked.append(
            {
                "group": dict(group),
                "densities": densities,
                "kernels": dict(zip(names, orders, strict=True)),
                "ns": {
                    run: {name: one[name].value for name in order}
                    for run, one, order in zip(names, means, orders, strict=True)
                },
                "tau": {
                    run: kendall_tau(first, [one[name].value for name in keys])
                    for run, one in zip(names[1:], means[1:], strict=True)
                },
                "turnovers": turnovers(names, means),
            }
        )
    return ranked


def turnovers(names: Sequence[str], means: Sequence[dict[str, Estimate]]) -> list[dict]:
    """Return every pair of kernels that changes places between two runs.

    Parameters
    ----------
    names : sequence of str
        The runs.
    means : sequence of dict of Estimate
        The time of each kernel in each run.

    Returns
    -------
    list of dict
        ``faster, slower`` (kernels, as on ``run``), ``run``, ``ratio`` (slower / faster there,
        above 1), ``other_run``, ``other_ratio`` (below 1), and ``resolved``: yes
        if both ratios are told from 1 (Holm over all pairs of a run), no, or no interval.
    """
    pairs = list(combinations(means[0], 2))
    ratios = [[ratio(one[a], one[b], paired=True) for a, b in pairs] for one in means]
    sure = [holm([p_value(found) for found in row]) for row in ratios]
    rows = []
    for (i, run), (j, other) in combinations(enumerate(names), 2):
        for place, (a, b) in enumerate(pairs):
            here, there = ratios[i][place], ratios[j][place]
            if (here.value - 1) * (there.value - 1) >= 0:
                continue
            if None in (here.interval(), there.interval()):
                resolved = NO_INTERVAL
            else:
                resolved = "yes" if sure[i][place] and sure[j][place] else "no"
            faster, slower = (b, a) if here.value > 1 else (a, b)
            turn = 1 if here.value > 1 else -1
            rows.append(
                {
                    "faster": faster,
                    "slower": slower,
                    "run": run,
                    "ratio": here.value**turn,
                    "other_run": other,
                    "other_ratio": there.value**turn,
                    "resolved": resolved,
                }
            )
    return rows


def _groups(columns: Sequence[str], tables: Sequence[Cells]) -> dict[tuple, dict[str, dict]]:
    """Return group -> kernel -> density -> key, of the cells that all runs have."""
    groups: dict[tuple, dict[str, dict]] = {}
    for key in tables[0]:
        cell = dict(zip(columns, key, strict=True))
        if cell["kernel"] == EMPTY or not all(key in table for table in tables):
            continue
        group = tuple((name, cell[name]) for name in columns if name not in ("kernel", "density"))
        kernel = groups.setdefault(group, {}).setdefault(cell["kernel"], {})
        kernel[cell.get("density")] = key
    return groups


def _shared_densities(kernels: dict[str, dict]) -> list:
    """Return the densities of all kernels; the mean counts only where nothing else is shared."""
    first, *others = kernels.values()
    shared = [density for density in first if all(density in other for other in others)]
    plain = [density for density in shared if density != MEAN]
    return plain or shared
