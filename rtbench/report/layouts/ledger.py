"""Tables of the ledger: what each effect costs a scene, and what calls for it."""

import textwrap
from collections.abc import Mapping

from rtbench.report.digits import absent
from rtbench.report.tables import Cell, Table, four_digits

WIDTH = 100
KINDS = {
    "primary": "from the camera",
    "shadow": "to lights",
    "reflection": "mirrored",
    "refraction": "refracted",
    "indirect": "onwards from diffuse surfaces",
}
REASONS = {
    "light_behind": "the light is behind the surface",
    "no_contribution": "the surface would send nothing of the light to the viewer",
    "below_threshold": "the ray's weight in the pixel is not above the threshold",
    "depth": "as many generations of rays went before as the depth allows",
    "interpolated": "the pixel is interpolated from its neighbours",
}


def ledger_tables(record: Mapping) -> list[Table]:
    """Return the ledger of a scene as tables.

    Parameters
    ----------
    record : mapping
        See `rtbench.tracer.ledger.Ledger.record`.

    Returns
    -------
    list of Table
        What each effect does, in numbers; what calls for it, in words. Of both, csv and json are
        the same: all there is to an effect, times in seconds.
    """
    raw_rows = [_raw(each) for each in record["effects"]]
    raw = list(dict.fromkeys(column for row in raw_rows for column in row))
    return [_numbers(record, raw, raw_rows), _reasons(record, raw, raw_rows)]


def _raw(effect: Mapping) -> dict:
    row = {key: value for key, value in effect.items() if key not in ("rays", "saved", "rounds")}
    row["along"] = " ".join(effect["along"])
    row |= {f"rays_{kind}": effect["rays"].get(kind, 0) for kind in KINDS}
    return row | {f"saved_{reason}": effect["saved"].get(reason, 0) for reason in REASONS}


def _numbers(record: Mapping, raw: list[str], raw_rows: list[dict]) -> Table:
    rows = []
    for effect in record["effects"]:
        row = {"effect": effect["title"], "called": effect["called"]}
        for name in ("rays", "saved"):
            count = sum(effect[name].values())
            row[name] = Cell(count, f"{count:,}" if count else "0")
        row["cost"] = _milliseconds(effect["forced_seconds"])
        if not absent(effect["low"]):
            ends = (_milliseconds(effect[end]).text for end in ("low", "high"))
            row["interval"] = "[{}, {}]".format(*ends)
        row["share"] = Cell(effect["share"], f"{100 * effect['share']:.1f}")
        row["change"] = _change(effect)
        rows.append(row)
    columns = ["effect", "called", "rays", "saved", "cost", "interval", "share", "change"]
    if not any("interval" in row for row in rows):
        columns.remove("interval")
    headers = {
        "called": "called",
        "saved": "saved",
        "cost": "ms",
        "interval": "95 %",
        "share": "%",
        "change": "change",
    }
    size = f"{record['width']}x{record['height']}"
    called = sum(effect["called"] for effect in record["effects"])
    title = (
        f"{record['scene']}, {size}: {called} of {len(rows)} effects called for, "
        f"{1e3 * record['seconds']:.1f} ms to trace"
    )
    return Table("ledger", rows, columns, title, raw, raw_rows, headers, _legend(record))


def _legend(record: Mapping) -> list[str]:
    lines = [
        "called: yes: what the effect adds: this scene's tracer beside one without it; no: what it "
        "would add: one with it forced in beside this scene's",
        "rays, saved: more rays shot, and more considered but not shot, of all kinds; ms, %: "
        "more time, median of paired rounds, and in parts of the time without it",
        "change: the largest difference of a pixel, linear; 0: equal to the last bit",
    ]
    for effect in record["effects"]:
        if effect["along"]:
            others = ", ".join(effect["along"]).replace("_", " ")
            lines.append(f"{effect['title']}: comes and goes with {others}")
    lines.append(f"the scene's rays: {_listed(record['rays'], KINDS)}")
    saved = _listed(record["saved"], REASONS)
    lines.append(f"not shot: {saved}" if saved else "not shot: none")
    return [line for each in lines for line in textwrap.wrap(each, WIDTH, subsequent_indent="  ")]


def _listed(counts: Mapping[str, int], words: Mapping[str, str]) -> str:
    return "; ".join(
        f"{count:,} {words.get(key, key)}"
        if words is KINDS
        else f"{count:,}: {words.get(key, key)}"
        for key, count in counts.items()
        if count
    )


def _milliseconds(seconds: float) -> Cell:
    return Cell(1e3 * seconds, f"{1e3 * seconds:.{1 if abs(seconds) >= 0.01 else 2}f}")


def _change(effect: Mapping) -> Cell:
    value = effect["max_difference"]
    if value == 0:
        return Cell(value, "0" if effect["same_bits"] else "only -0")
    return Cell(value, four_digits(value) if value != float("inf") else "not finite")


def _reasons(record: Mapping, raw: list[str], raw_rows: list[dict]) -> Table:
    widest = max(len(effect["title"]) for effect in record["effects"])
    rows = [
        {
            "effect": effect["title"],
            "called": effect["called"],
            "why": Cell(effect["why"], textwrap.fill(effect["why"], WIDTH - widest - 12)),
        }
        for effect in record["effects"]
    ]
    headers = {"called": "called", "why": "because"}
    columns = ["effect", "called", "why"]
    return Table("ledger-reasons", rows, columns, "", raw, raw_rows, headers)
