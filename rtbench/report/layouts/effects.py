"""Tables of the experiment effects: tracers that hold more than a scene calls for, steps, proof."""

from typing import TYPE_CHECKING

from rtbench.records.resampling import Estimate
from rtbench.report import machine
from rtbench.report.digits import absent, interval, measured
from rtbench.report.effects import DELETED, MORE, SPECIALISED, TITLES, Effects
from rtbench.report.tables import Cell, Table

if TYPE_CHECKING:
    from rtbench.records.run import Run

ABSENT_WITHOUT_GLASS = ("refracted", "fresnel")
ALL_SCENES = "geometric mean"


def effects_tables(run: "Run") -> list[Table]:
    """Return the tables of a run of the experiment ``effects``: a kernel and precision, a set.

    Parameters
    ----------
    run : Run

    Returns
    -------
    list of Table
        Ratios of the tracers with more compiled in; steps; proof. As far as there are samples.
    """
    effects = Effects(run)
    found = []
    for number, group in enumerate(effects.groups):
        suffix = "" if len(effects.groups) == 1 else f"-{number + 1}"
        head = f"{group[0]}, {group[1]}"
        found += [
            _tracers(effects, group, f"effects{suffix}", head),
            _steps(effects, group, f"effects-steps{suffix}", head),
            _proof(effects, group, f"effects-proof{suffix}", head),
        ]
    return [table for table in found if table.rows]


def _ends(estimate: Estimate | None) -> tuple[float | None, float | None]:
    return (estimate.interval() if estimate is not None else None) or (None, None)


def _ratio(row: dict, name: str, estimate: Estimate | None) -> None:
    """Put a ratio and its interval into a row."""
    if estimate is None:
        return
    ends = _ends(estimate)
    row[name] = Cell(estimate.value, f"{estimate.value:.3f}")
    row[f"{name}_low"], row[f"{name}_high"] = ends
    row[f"{name}_interval"] = interval(estimate.value, *ends)


def _milliseconds(effects: Effects, scene: str, estimate: Estimate | None) -> Cell:
    if estimate is None:
        return Cell(None, "")
    fact = effects.facts[scene]
    pixels = fact["width"] * fact["height"] / 1e6
    ends = (None if each is None else each * pixels for each in _ends(estimate))
    return measured(estimate.value * pixels, *ends)


def _tracers(effects: Effects, group: tuple[str, str], name: str, head: str) -> Table:
    there = [
        tracer
        for tracer in MORE
        if any(effects.ratio(group, scene, tracer) for scene in effects.scenes(group))
    ]
    rows = []
    for scene in effects.scenes(group) if there else []:
        fact, own = effects.facts[scene], effects.row(group, scene, SPECIALISED)
        row = {"scene": scene, "size": f"{fact['width']}x{fact['height']}"}
        row["ms"] = _milliseconds(effects, scene, effects.median(group, scene, SPECIALISED))
        equal = []
        for tracer in there:
            _ratio(row, tracer, effects.ratio(group, scene, tracer))
            other = effects.row(group, scene, tracer)
            if own and other:
                equal.append(own["picture"] == other["picture"])
        row["equal"] = all(equal) if equal else None
        rows.append(row)
    if len(rows) > 1:
        row = {"scene": ALL_SCENES}
        for tracer in there:
            mean = effects.mean(group, tracer)
            if mean is not None:
                _ratio(row, tracer, mean.estimate)
        rows.append(row)
    intervals = any(row.get(f"{tracer}_interval") for row in rows for tracer in there)
    columns = ["scene", "size", "ms"]
    for tracer in there:
        columns += [tracer, f"{tracer}_interval"] if intervals else [tracer]
    columns.append("equal")
    raw = ["scene", "size", "ms"]
    raw += [f"{tracer}{end}" for tracer in there for end in ("", "_low", "_high")] + ["equal"]
    headers = {"ms": "ms a picture", "equal": "same bits"}
    headers |= {"inner_loop": "inner loop"}
    headers |= {f"{tracer}_interval": "95 %" for tracer in there}
    notes = [
        "times the scene's own tracer takes, paired by rounds, with more compiled in: optical: all "
        "effects;",
        "inner loop: all kinds of primitives, motion, and triangles one by one; everything: both",
        "same bits: whether all these pictures equal that of the scene's own tracer",
        machine.provenance(effects.run),
    ]
    title = f"What is compiled in and not called for; {head}"
    return Table(name, rows, columns, title, raw, [], headers, notes)


def _steps(effects: Effects, group: tuple[str, str], name: str, head: str) -> Table:
    rows, kinds = [], ("primary", "shadow", "reflection", "refraction", "indirect")
    for scene in effects.scenes(group):
        for step in effects.steps(group, scene):
            row = {"scene": scene, "step": ("+ " if step.more else "") + step.name}
            row["ms"] = _milliseconds(effects, scene, step.time)
            _ratio(row, "times", step.more)
            told = effects.row(group, scene, step.tracer) or {}
            counts = {kind: told.get(f"rays_{kind}") for kind in kinds}
            row |= {f"rays_{k}": None if absent(n) else int(n) for k, n in counts.items()}
            rays = sum(int(count) for count in counts.values() if not absent(count))
            if rays:
                row["rays"] = rays
                ns = step.time.value * told["width"] * told["height"] / rays
                row["ns_per_ray"] = Cell(ns, f"{ns:.0f}")
            rows.append(row)
    if not any(row.get("times") for row in rows):
        rows = []  # one step alone says nothing
    intervals = any(row.get("times_interval") for row in rows)
    columns = ["scene", "step", "ms", "times", *(["times_interval"] if intervals else [])]
    columns += ["rays", "ns_per_ray"]
    raw = ["scene", "step", "ms", "times", "times_low", "times_high"]
    raw += ["rays", *(f"rays_{kind}" for kind in kinds)]
    headers = {"ms": "ms a picture", "times": "times before", "times_interval": "95 %"}
    headers |= {"ns_per_ray": "ns a ray"}
    notes = [
        "plain: rays from the camera, Lambert's law, no shadows; each step has one effect more",
        machine.provenance(effects.run),
    ]
    return Table(name, rows, columns, f"Effects, one by one; {head}", raw, [], headers, notes)


def _proof(effects: Effects, group: tuple[str, str], name: str, head: str) -> Table:
    rows = []
    for scene in effects.scenes(group):
        own, other = (effects.row(group, scene, tracer) for tracer in (SPECIALISED, DELETED))
        if not own or not other or absent(own["code"]) or absent(other["code"]):
            continue
        row = {"scene": scene, "instructions": int(own["instructions"])}
        row["instructions_deleted"] = int(other["instructions"])
        row["equal"] = own["code"] == other["code"]
        row["code"], row["code_deleted"] = own["code"], other["code"]
        _ratio(row, "times", effects.ratio(group, scene, DELETED))
        functions = str(own["functions"]).split()
        row["functions"] = len(functions)
        row["refraction"] = any(each in functions for each in ABSENT_WITHOUT_GLASS)
        row["called"] = "refraction" in effects.facts[scene]["effects"]
        rows.append(row)
    intervals = any(row.get("times_interval") for row in rows)
    columns = ["scene", "instructions", "instructions_deleted", "equal", "times"]
    columns += ["times_interval"] if intervals else []
    columns += ["functions", "refraction", "called"]
    raw = ["scene", "instructions", "instructions_deleted", "equal", "code", "code_deleted"]
    raw += ["times", "times_low", "times_high", "functions", "refraction", "called"]
    headers = {
        "instructions": "instructions",
        "instructions_deleted": TITLES[DELETED],
        "equal": "same code",
        "times": "times",
        "times_interval": "95 %",
        "refraction": "refracts",
        "called": "glass",
    }
    notes = [
        "instructions of LLVM's intermediate code of the scene's own tracer, and of one from "
        "sources out of",
        "whose syntax the blocks of absent effects and kinds were deleted; same code: equal but "
        "for names,",
        "numbers and the order in which blocks stand; times: its time over the own tracer's",
        "functions: compiled of the generated module; refracts: refracted or fresnel is among "
        "them;",
        "glass: whether the scene calls for refraction",
        machine.provenance(effects.run),
    ]
    title = f"What is not called for is not there; {head}"
    return Table(name, rows, columns, title, raw, [], headers, notes)
