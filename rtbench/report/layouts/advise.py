"""The answer to what to take: a sentence, the ranking, and why the others fell out."""

from collections.abc import Sequence

from rtbench.records.statistics import NO_INTERVAL, Estimate
from rtbench.report import machine
from rtbench.report.advise import Advice
from rtbench.report.beside_best import Ranked
from rtbench.report.candidates import Candidate
from rtbench.report.digits import interval, measured
from rtbench.report.tables import Cell, Table

NEARLY = 1.1  # what is not resolved, and measured to be slower than this, is a noisy measurement
MOST_NAMES = 5
_USUAL = {
    "prepared": ("own",),
    "exit": ("none",),
    "layout": ("blocks", "own", "padded", "shared"),
    "axes": ("stored",),
    "reciprocal": ("division",),
}
_RAW = (
    *("rank", "kernel", "precision", "verdict", "ns_per_test", "ci_low", "ci_high", "whole_ns"),
    *("whole_low", "whole_high", "ratio", "ratio_low", "ratio_high", "stored", "bytes"),
    *("preparation_ns", "run"),
)


def sentence(advice: Advice) -> str:
    """Return the advice in plain words.

    Parameters
    ----------
    advice : Advice

    Returns
    -------
    str
        Names every kernel that is not told from the best, which of them asks least of memory, and
        how far the next one is behind.
    """
    level = advice.level
    if not level:
        reasons = list(dict.fromkeys(reason for _, reason, _ in advice.fell_out))
        return f"No measured kernel fits: {'; '.join(reasons)}."
    best, *others = level
    words = [f"Take {name(best.candidate)}: {_time(best.whole)} ns a test"]
    share = advice.question.rays_per_triangle
    if share is not None and best.candidate.preparation:
        words[0] += f", its share of the preparation ({share:g} rays a triangle) in it"
    words[0] += "."
    near = [one for one in others if one.ratio.value <= NEARLY]
    unsure = [one for one in others if one.ratio.value > NEARLY]
    if others and all(one.verdict == NO_INTERVAL for one in others):
        words.append("It was the fastest; a single process gives no interval to tell others by:")
        words.append(f"{_names(others)}.")
    else:
        if near:
            words.append(f"No difference is resolved from {_names(near)}.")
            words += _least([best, *near])
        if unsure:
            words.append(
                f"Measured slower, but too unsurely to tell: {_names(unsure, MOST_NAMES)}."
            )
    words += _price(advice, best)
    slower = [one for one in advice.ranking if not one.level]
    if slower:
        first = slower[0]
        words.append(f"The next, {name(first.candidate)}, takes {_ratio(first.ratio)} times that.")
    elif not others:
        words.append("Nothing else that was measured fits.")
    return " ".join(words)


def _price(advice: Advice, best: Ranked) -> list[str]:
    """Return what the accuracy that was asked for costs beside the fastest without it."""
    word = advice.question.accuracy
    if not word or not advice.free:
        return []
    fastest = advice.free[0]
    if fastest.candidate is best.candidate:
        return [f"To be {word} costs nothing: it is the fastest of all that fit otherwise."]
    own = next(one for one in advice.free if one.candidate is best.candidate)
    beside = f"beside {name(fastest.candidate)}, the fastest that need not be"
    if own.level:
        return [f"To be {word} makes no difference that is resolved {beside}."]
    low, high = own.ratio.interval() or (None, None)
    value, *ends = (None if x is None else 100 * (x - 1) for x in (own.ratio.value, low, high))
    text = f"{measured(value, *ends, most=1).text} % {interval(value, *ends, most=1)}".strip()
    return [f"To be {word} costs {text} {beside}."]


def advice_tables(advice: Advice) -> list[Table]:
    """Return the ranking of what fits, and what fell out by reason; each only if it has rows."""
    return [table for table in (_ranking(advice), _fell_out(advice)) if table.rows]


def name(one: Candidate) -> str:
    """Return the kernel's name, with what else identifies it where that is not the usual."""
    way = dict(one.way)
    form, width = way.pop("form", None), way.pop("width", None)
    words = ["ray by ray" if width == 1 else f"{width} {form}"] if form else []
    words += [f"{k} {v}" for k, v in way.items() if v is not None and v not in _USUAL.get(k, ())]
    return f"{one.kernel} ({', '.join(words)})" if words else one.kernel


def _ranking(advice: Advice) -> Table:
    question, rows, place = advice.question, [], 0
    for number, one in enumerate(advice.ranking, start=1):
        place = 1 if one.level else number
        rows.append(_row(one, place))
    shared = question.rays_per_triangle is not None
    several = len({one.candidate.run.name for one in advice.ranking}) > 1
    columns = ["rank", "kernel", "ns_per_test", "interval"]
    columns += ["whole_ns", "whole_interval"] if shared else []
    columns += ["ratio", "ratio_interval", "stored", "bytes", "preparation_ns"]
    columns += ["run"] if several else []
    headers = {
        "ns_per_test": "ns a test",
        "interval": "95 %",
        "whole_ns": "with preparation",
        "whole_interval": "95 %",
        "ratio": "to the best",
        "ratio_interval": "95 %",
        "bytes": "bytes",
        "preparation_ns": "prepared in ns",
    }
    level = [name(one.candidate) for one in advice.level[1:]]
    notes = (
        ["rank 1: the best, and what is not told from it where all are judged at once (Holm)"]
        if level
        else []
    )
    notes += [*advice.remarks, *map(machine.provenance, advice.runs)]
    further = sorted({column for one in advice.ranking for column, _ in one.candidate.way})
    raw = [*_RAW[:3], *further, *_RAW[3:]]
    return Table("advice", rows, columns, _title(advice), raw, headers=headers, notes=notes)


def _row(one: Ranked, place: int) -> dict:
    candidate = one.candidate
    bare, whole, ratio = (each.interval() or (None, None) for each in _estimates(one))
    return dict(candidate.way) | {
        "rank": Cell(place, str(place)),
        "kernel": Cell(candidate.kernel, name(candidate)),
        "precision": candidate.precision,
        "verdict": one.verdict,
        "ns_per_test": measured(one.bare.value, *bare),
        "interval": interval(one.bare.value, *bare),
        "ci_low": bare[0],
        "ci_high": bare[1],
        "whole_ns": measured(one.whole.value, *whole),
        "whole_interval": interval(one.whole.value, *whole),
        "whole_low": whole[0],
        "whole_high": whole[1],
        "ratio": measured(one.ratio.value, *ratio, most=2),
        "ratio_interval": interval(one.ratio.value, *ratio, most=2),
        "ratio_low": ratio[0],
        "ratio_high": ratio[1],
        "stored": candidate.stored,
        "bytes": candidate.bytes,
        "preparation_ns": Cell(candidate.preparation, _preparation(candidate.preparation)),
        "run": candidate.run.name,
    }


def _fell_out(advice: Advice) -> Table:
    rows, raw = [], []
    for candidate, reason, detail in advice.fell_out:
        raw.append({"reason": reason, "kernel": name(candidate), "detail": detail})
    slower = [one for one in advice.ranking if not one.level]
    for one in slower:
        detail = f"{_ratio(one.ratio)} times the best"
        raw.append({"reason": "slower", "kernel": name(one.candidate), "detail": detail})
    last = None
    for row in raw:
        said = " " if row["reason"] == last else row["reason"]  # a reason is said once
        rows.append(row | {"reason": Cell(row["reason"], said)})
        last = row["reason"]
    columns = ["reason", "kernel", "detail"]
    return Table("fell_out", rows, columns, "Why the others fell out", raw_rows=raw)


def _title(advice: Advice) -> str:
    question = advice.question
    words = [f"stored at most: {question.stored}", f"returned: {', '.join(question.outputs)}"]
    words += [f"hit ratio {question.hit_ratio:g}", question.precision]
    words += ["packets"] if question.packets else []
    words += [question.accuracy] if question.accuracy else []
    if question.rays_per_triangle is not None:
        words.append(f"{question.rays_per_triangle:g} rays per triangle")
    if question.memory is not None:
        words.append(f"{question.triangles:,} triangles in {question.memory:,} bytes")
    return "What fits: " + "; ".join(words)


def _least(level: Sequence[Ranked]) -> list[str]:
    """Return what else speaks for one of those that are level, if anything does."""
    needs = [(one.candidate.bytes, one.candidate.preparation) for one in level]
    if any(None in need for need in needs) or len(set(needs)) == 1:
        return []
    size = min(need[0] for need in needs)
    work = min(need[1] for need in needs if need[0] == size)
    chosen = [one for one, need in zip(level, needs, strict=True) if need == (size, work)]
    verb = "asks" if len(chosen) == 1 else "ask"
    prepared = f"prepared in {work:.0f} ns" if work else "nothing to prepare"
    names = _names(chosen)
    return [f"Of these {names} {verb} least: {size} bytes a triangle, {prepared}."]


def _estimates(one: Ranked) -> tuple[Estimate, Estimate, Estimate]:
    return one.bare, one.whole, one.ratio


def _time(found: Estimate) -> str:
    ends = found.interval() or (None, None)
    return f"{measured(found.value, *ends).text} {interval(found.value, *ends)}".strip()


def _ratio(found: Estimate) -> str:
    ends = found.interval() or (None, None)
    text = measured(found.value, *ends, most=2).text
    return f"{text} {interval(found.value, *ends, most=2)}".strip()


def _preparation(ns: float | None) -> str:
    return "" if not ns else f"{ns:.0f}"


def _names(ranked: Sequence[Ranked], most: int | None = None) -> str:
    names = [name(one.candidate) for one in ranked]
    if most is not None and len(names) > most + 1:
        names = [*names[:most], f"{len(names) - most} more of rank 1"]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
