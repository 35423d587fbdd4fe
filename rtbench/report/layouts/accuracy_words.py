"""What accuracy costs in one paragraph, every number of it from the records of a run."""

from collections.abc import Sequence

from rtbench.records.statistics import NO_INTERVAL
from rtbench.report import machine
from rtbench.report.accuracy import PAIRS, RANDOM, SCALAR, Accuracy
from rtbench.report.accuracy_steps import STEPS, Price, Step, cost_word, gains, prices

_FORM = {SCALAR: "one by one", PAIRS: "in packets"}


def paragraph(accuracy: Accuracy, found: Sequence[Price] | None = None) -> str:
    """Return what each step of accuracy costs on a run's machine.

    Parameters
    ----------
    accuracy : Accuracy
    found : sequence of Price, optional
        The steps' prices; found out if not given.

    Returns
    -------
    str
        One paragraph: over tests of which half hit, what a step costs or saves, or that no
        difference is resolved, with 95 % intervals, and what it buys.
    """
    known = prices(accuracy) if found is None else found
    here = [price for price in known if price.workload == RANDOM]
    words = [
        f"On {machine.processor(accuracy.run)}, of ray/triangle tests of which half hit (t, u and "
        "v; 95 % intervals):"
    ]
    told = []
    for step in STEPS:
        own = {price.form: price for price in here if price.step == step}
        if own and not step.leave:
            told.append(sentence(accuracy, step, own))
    told += _leave(accuracy, here)
    if not told:
        return f"{words[0]} no step of accuracy has both of its ends in this run."
    return " ".join([*words, *told])


def sentence(accuracy: Accuracy, step: Step, own: dict[str, Price]) -> str:
    """Return what one step costs, one by one and in packets, and what it buys.

    Parameters
    ----------
    accuracy : Accuracy
    step : Step
    own : dict of str to Price
        By form.
    """
    costs = _joined([cost(own[form], words) for form, words in _FORM.items() if form in own])
    # What a step buys in packets differs by nothing but how their kernels end.
    changes = next((words for form in own if (words := _bought(accuracy, own[form]))), "")
    subject = step.words[0].upper() + step.words[1:]
    return f"{subject} {costs}{f' ({changes})' if changes else ''}."


def cost(price: Price, form: str) -> str:
    """Return ``costs 12 % [10, 14] one by one``, or that no difference is resolved."""
    word = cost_word(price)
    value, low, high = price.percent
    if price.verdict == NO_INTERVAL:
        verb = "costs" if value > 0 else "saves"
        return f"{verb} {abs(value):.0f} % {form} (no interval)"
    places = 0 if high - low >= 3 else 1
    if not word:
        ends = f"[{low:+.{places}f}, {high:+.{places}f}]"
        return f"{UNRESOLVED_WORDS} {form} {ends} %"
    ends = sorted((low, high)) if value > 0 else sorted((-low, -high))
    between = f"[{ends[0]:.{places}f}, {ends[1]:.{places}f}]"
    return f"{word} {abs(value):.{places}f} % {between} {form}"


UNRESOLVED_WORDS = "makes no resolved difference"


def _joined(parts: list[str]) -> str:
    """Return two costs in one sentence; words that both begin with are said once."""
    if len(parts) == 2:
        for same in ("costs ", "saves ", f"{UNRESOLVED_WORDS} "):
            if all(part.startswith(same) for part in parts):
                parts = [parts[0], parts[1].removeprefix(same)]
                break
    return " and ".join(parts)


def _bought(accuracy: Accuracy, price: Price) -> str:
    """Return what a step changes of hard cases, nothing where that stays as it is."""
    found = gains(accuracy, price.start, price.end)
    words = []
    if _changed(found, "wrong"):
        before, after = found["wrong"]
        words.append(f"hard cases wrong {_plain(before)} > {_plain(after)} %")
    if _changed(found, "leaks"):
        before, after = found["leaks"]
        words.append(f"leaks {before:.0f} > {after:.0f}")
    if _changed(found, "ppm"):
        before, after = found["ppm"]
        words.append(f"typical tests wrong {_plain(before)} > {_plain(after)} ppm")
    for name, unit in (("p99_t", " roundoffs"), ("relative_t", "")):
        if name == "relative_t" and "p99_t" in found:
            continue
        if _changed(found, name) and _far(*found[name]):
            before, after = found[name]
            kind = "error" if unit else "relative error"
            words.append(f"99 % {kind} of t {_plain(before)} > {_plain(after)}{unit}")
    return ", ".join(words)


def _changed(found: dict, name: str) -> bool:
    return name in found and _plain(found[name][0]) != _plain(found[name][1])


def _far(before: float, after: float) -> bool:
    """Tell whether an error changes by half: both are 99th percentiles of other hits."""
    return max(before, after) > 1.5 * min(before, after)


def _plain(value: float) -> str:
    if value and value < 1e-3:
        return f"{value:.1e}"
    if value >= 10_000:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def _leave(accuracy: Accuracy, here: Sequence[Price]) -> list[str]:
    """Return what leave to the compiler brings, and which kernels leak or are wrong by it."""
    found = []
    for flags, words in LEAVE.items():
        own = [p for p in here if p.step.leave and p.end.flags == flags and p.form == SCALAR]
        if not own:
            continue
        told = [f"{_short(p)} in {_named(p)}" for p in own if _told(p)]
        rest = [p for p in own if not _told(p)]
        if rest and not told:
            told = [f"{UNRESOLVED_WORDS} in any of {len(rest)} kernels"]
        elif rest:
            told.append(f"{UNRESOLVED_WORDS} in {_and([_named(p) for p in rest])}")
        broken = []
        for price in own:
            changes = gains(accuracy, price.start, price.end)
            for name, what in (("leaks", "leaks"), ("ppm", "ppm of typical tests wrong")):
                if changes.get(name, (0, 0))[1] > changes.get(name, (0, 0))[0] == 0:
                    broken.append(f"{_named(price)} 0 > {_plain(changes[name][1])} {what}")
        harm = f", and breaks {'; '.join(broken)}" if broken else ""
        found.append(f"{words}, one by one, {'; '.join(told)}{harm}.")
    return found


LEAVE = {"contract": "Contraction", "fast": "Fastmath"}


def _told(price: Price) -> bool:
    return bool(cost_word(price)) or price.verdict == NO_INTERVAL


def _short(price: Price) -> str:
    return " ".join(cost(price, "").split())


def _named(price: Price) -> str:
    return price.start.kernel.removesuffix("_uv")


def _and(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
