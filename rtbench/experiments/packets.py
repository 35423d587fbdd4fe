"""What packets gain, and what they cost as their rays spread (Havel 2008, 4.2.2 and 5.1.3).

Every kernel over the same rays: one by one with its early exits (width 1), in packets of rays,
in groups of triangles, and, in form pairs, in blocks of pairs of one ray and one triangle. From
packets of the greatest width one thing at a time is varied: what their rays share, how far they
spread, the exit that is taken when no lane is left, and then layout, axes and reciprocal.
Answers are those of the scalar loop, bit for bit; only those of the estimated reciprocal are its
own, and the records say how far off they are.
"""

from __future__ import annotations

import numpy as np

from rtbench.compiled import packets, packing
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import fill
from rtbench.compiled.packing import Packing
from rtbench.errors import WrongAnswers
from rtbench.experiments import rays
from rtbench.experiments.bench import Bench
from rtbench.experiments.config import Config
from rtbench.kernels.contract import HIT, Kernel
from rtbench.measure.sampler import stopwatch
from rtbench.measure.session import Timed
from rtbench.workloads.bundles import Bundles, bundles
from rtbench.workloads.pairs import Pairs

CELL = (
    *("kernel", "precision", "order", "density", "prepared"),
    *("form", "width", "packet", "angle", "exit", "layout", "axes", "reciprocal"),
)
DENSE = 0.5  # the density of the pairs
VARIED = 3  # kernels, the config's first ones, of which layout, axes and reciprocal are varied


def build(bench: Bench) -> None:
    """Add every kernel in every form that the config asks for."""
    config = bench.config
    widest, first = max(config.widths), config.angles[0]
    for ratio in config.densities:
        aim = rays.draw(bench, ratio)
        made: dict[tuple[str, float], Bundles] = {}
        for kind in config.packets:
            for angle in config.angles:
                bench.say(f"drawing {kind} packets of {widest} rays, {angle:g} degrees wide")
                count = config.rays // widest
                made[kind, angle] = bundles(kind, aim, count, widest, angle, config.seed)
        for precision in config.precisions:
            for kernel in bench.kernels:
                key = _key(Packing(width=widest), config.packets[0], first) | {"width": 1}
                key |= {"layout": config.layout}
                drawn = made[config.packets[0], first].soup
                prepared = config.prepared[0]
                rays.add(bench, kernel, precision, drawn, ratio, prepared, columns=key)
                for (kind, angle), drawn in made.items():
                    given = _scalar(bench, kernel, precision, drawn)
                    varied = kernel in bench.kernels[:VARIED]
                    at_first = angle == first
                    for chosen in _packings(kernel, precision, config, kind, at_first, varied):
                        _add(bench, kernel, precision, ratio, chosen, drawn, given)
    if "pairs" in config.forms:
        _add_pairs(bench, widest)


def _packings(
    kernel: Kernel, precision: str, config: Config, kind: str, at_first: bool, varied: bool
) -> list[Packing]:
    """Return the packings that are tried of packets of a kind, all of them at the first angle."""
    widest = max(config.widths)
    base = Packing(width=widest, packet=kind)
    exits = [base]
    if kernel.ending is not None and kernel.ending.early:
        exits.append(Packing(width=widest, packet=kind, exit="any"))
    if not at_first or kind != config.packets[0]:
        return exits
    forms = [
        Packing(form, width)
        for form in config.forms
        if form != "pairs"
        for width in config.widths
        if (form, width) != ("rays", widest)
    ]
    layouts = [
        Packing(form, widest, layout=layout)
        for form in config.forms
        if form != "pairs"
        for layout in ("soa", "aos")
    ]
    axes = [Packing(width=widest, axes=axes) for axes in ("table", "fixed")]
    estimate = Packing(width=widest, reciprocal="estimate")
    if not varied:
        return [*exits, *forms]
    return [
        *exits,
        *forms,
        *layouts,
        *(axes if packing.axis_fields(kernel) else []),
        *([estimate] if precision == "float32" else []),
    ]


def _key(chosen: Packing, kind: str, angle: float | None) -> dict:
    return {
        "form": chosen.form,
        "width": chosen.width,
        "packet": kind,
        "angle": angle,
        "exit": chosen.exit,
        "layout": chosen.layout,
        "axes": chosen.axes,
        "reciprocal": chosen.reciprocal,
    }


def _scalar(bench: Bench, kernel: Kernel, precision: str, drawn: Bundles) -> list[np.ndarray]:
    """Return what the scalar loop over all triangles says of each ray of the packets."""
    soup, config = drawn.soup, bench.config
    records = fill(
        kernel,
        config.layout,
        precision,
        (soup.v0, soup.v1, soup.v2),
        soup.orig,
        soup.dir,
        tmax=np.inf,
        prepared=config.prepared[0],
    )
    instance = bench.instance(kernel, precision, None, rays.NEAREST)
    return list(run_once(instance, kernel, precision, *records))[: 1 + len(kernel.outputs)]


def _add(
    bench: Bench,
    kernel: Kernel,
    precision: str,
    ratio: float,
    chosen: Packing,
    drawn: Bundles,
    given: list[np.ndarray],
) -> None:
    """Add a cell of packets or groups; ``given`` is what the scalar loop says."""
    soup = drawn.soup
    key = {"density": ratio} | _key(chosen, drawn.kind, drawn.angle)
    name = f"{drawn.digest}|{drawn.kind}|{drawn.angle}"
    tests = len(soup.v0) * (1 if chosen.form == "triangles" else chosen.width)
    _add_cell(
        bench,
        kernel,
        precision,
        chosen,
        name,
        (soup.triangles, soup.orig, soup.dir),
        given,
        key,
        tests,
        bench.config.repetitions,
    )


def _add_pairs(bench: Bench, widest: int) -> None:
    """Add every kernel over pairs, one by one and in blocks."""
    config = bench.config
    drawn = bench.at_density(DENSE, config.rays * config.triangles // 16)
    order = in_blocks(drawn.pairs, widest)
    pairs = drawn.pairs
    corners = np.stack([v[order] for v in (pairs.v0, pairs.v1, pairs.v2)], axis=1)
    arrays = corners, pairs.orig[order], pairs.dir[order]
    repetitions = config.repetitions * -(-config.rays * config.triangles // len(order))
    for precision in config.precisions:
        for kernel in bench.kernels:
            key = _key(Packing("pairs", widest), "", None) | {"width": 1, "layout": config.layout}
            key |= {"prepared": config.prepared[0]}
            bench.add(kernel, precision, drawn, "sweep", repetitions, group=order, **key)
            outputs = bench.answers(kernel, precision, drawn).outputs
            given = [values[order] for values in outputs[: 1 + len(kernel.outputs)]]
            given[0] = (given[0] != HIT).astype(np.int32)
            chosen = [Packing("pairs", width) for width in config.widths]
            chosen += [Packing("pairs", widest, layout=layout) for layout in ("soa", "aos")]
            for each in chosen:
                key = {"density": DENSE} | _key(each, "", None)
                _add_cell(
                    bench,
                    kernel,
                    precision,
                    each,
                    f"pairs in blocks of {widest}",
                    arrays,
                    given,
                    key,
                    each.width,
                    repetitions,
                )


def in_blocks(pairs: Pairs, width: int) -> np.ndarray:
    """Return the indices of pairs so that each W share an axis of projection, a few left out."""
    normals = np.cross(pairs.v1 - pairs.v0, pairs.v2 - pairs.v0)
    axis = np.abs(normals).argmax(axis=1)
    parts = (np.flatnonzero(axis == each) for each in range(3))
    return np.concatenate([part[: len(part) // width * width] for part in parts])


def _add_cell(
    bench: Bench,
    kernel: Kernel,
    precision: str,
    chosen: Packing,
    name: str,
    drawn: tuple[np.ndarray, np.ndarray, np.ndarray],
    given: list[np.ndarray],
    key: dict,
    tests: int,
    repetitions: int,
) -> None:
    """Add a cell: fill the records, compile, compare with what is given."""
    corners, orig, dir = drawn
    prepared = bench.config.prepared[0]
    triangles = packing.fill_triangles(kernel, precision, chosen, corners, prepared)
    packed = packing.fill_rays(kernel, precision, chosen, orig, dir)
    bench.say(f"compiling {kernel.name} in {precision}, {chosen.form} of {chosen.width}")
    held = packing.held(chosen, triangles, packed)
    instance = packets.loop(kernel, precision, chosen, held)
    what = instance, kernel, precision, chosen, (triangles, packed), len(orig)
    outputs = packets.run_once(*what)
    _, seconds = stopwatch(lambda: packets.run_once(*what))
    found = key | {"kernel": kernel.name, "precision": precision}
    if chosen.reciprocal == "division":
        must_be_equal(found, outputs, given)
    else:
        bench.facts.setdefault("estimates", []).append(found | _difference(outputs, given))
    label = f"{name}|{kernel.name}|{precision}|{prepared}|{chosen}"
    arrays = bench.arrays
    places = np.arange(len(outputs[0]), dtype=np.uint64)
    bench.cells.append(
        Timed(
            key={"kernel": kernel.name, "precision": precision, "order": "sweep"}
            | {"density": key["density"], "prepared": prepared}
            | key,
            instance=instance,
            triangles=arrays.add(f"{label}|triangles", triangles),
            rays=arrays.add(f"{label}|rays", packed),
            pairs=arrays.add(f"rays {len(places)}", places),
            expected=tuple(
                arrays.add(f"{label}|{place}", values) for place, values in enumerate(outputs)
            ),
            order="sweep",
            count=len(places),
            repetitions=repetitions,
            nanoseconds=seconds * 1e9 / (len(places) * tests),
            tests=tests,
        )
    )


def must_be_equal(found: dict, outputs: tuple[np.ndarray, ...], given: list[np.ndarray]) -> None:
    """Raise WrongAnswers where lanes say something else than the scalar loop, in any bit.

    NaN counts as NaN, whatever its bits: whoever has two to multiply may return either.
    """
    for name, lanes, scalar in zip(("outcome", "t", "u", "v"), outputs, given, strict=False):
        lanes = lanes.reshape(-1)
        same = (lanes.view(np.uint8) == scalar.view(np.uint8)).reshape(len(lanes), -1).all(axis=1)
        different = np.flatnonzero(~(same | ((lanes != lanes) & (scalar != scalar))))
        if len(different):
            at = different[0]
            what = ", ".join(f"{column} {value}" for column, value in found.items())
            raise WrongAnswers(
                f"lanes and scalar loop differ in {name} of {len(different)} rays ({what}); the "
                f"first is ray {at}: {lanes[at]} and {scalar[at]}"
            )


def _difference(outputs: tuple[np.ndarray, ...], given: list[np.ndarray]) -> dict:
    """Return how many rays found another triangle, and the relative error of t, median and most."""
    found, t = outputs[0].reshape(-1), outputs[1].reshape(-1).astype(float)
    same = (found == given[0]) & (found >= 0)
    error = np.abs(t[same] - given[1][same]) / np.abs(given[1][same])
    return {
        "rays": len(found),
        "differ": int(np.count_nonzero(found != given[0])),
        "median": float(np.median(error)) if len(error) else None,
        "most": float(error.max()) if len(error) else None,
    }
