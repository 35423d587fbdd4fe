"""What a run was made on, in the words that stand under a table or over a plot."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rtbench.records.run import Run

UNKNOWN = "unknown"
_VERSIONS = (("python", "Python"), ("numba", "numba"), ("llvm", "LLVM"), ("numpy", "numpy"))


def processor(run: "Run") -> str:
    """Return the name of the run's processor; the run's own name where nothing is known."""
    machine = run.info.get("machine") or {}
    for key in ("cpu_model", "label"):
        name = machine.get(key)
        if name and name != UNKNOWN:
            return " ".join(str(name).replace("(R)", "").replace("(TM)", "").split())
    return run.name


def data_caches(run: "Run") -> list[tuple[str, int]]:
    """Return the name and size in bytes of each cache that holds data, smallest first."""
    caches = (run.info.get("machine") or {}).get("caches")
    found = {}
    for cache in caches if isinstance(caches, list) else []:
        kind = str(cache.get("type", "")).lower()
        size = cache.get("size_bytes")
        if isinstance(size, int) and size > 0 and kind != "instruction":
            name = f"L{cache.get('level')}" + ("d" if kind == "data" else "")
            found[name] = size
    return sorted(found.items(), key=lambda cache: cache[1])


def provenance(run: "Run") -> str:
    """Return one line: processor, versions, seed and name of a run."""
    software = run.info.get("software") or {}
    versions = [
        f"{word} {software[key]}"
        for key, word in _VERSIONS
        if software.get(key) and software[key] != UNKNOWN
    ]
    seed = run.info.get("seed")
    parts = [processor(run), ", ".join(versions), "" if seed is None else f"seed {seed}"]
    if run.published:
        source = run.info.get("source")
        known = [source.get("author"), source.get("year")] if isinstance(source, dict) else [source]
        parts.append("published, " + " ".join(str(word) for word in known if word))
    return "; ".join(dict.fromkeys(part for part in [*parts, run.name] if part))


def storage(run: "Run") -> str:
    """Return one line: what each kernel stores of a triangle and what preparing that takes."""
    told: dict[str, list[str]] = {}
    for kernel, forms in (run.info.get("kernels") or {}).items():
        for facts in forms.values():
            size, prepare = (
                facts.get(k) for k in ("bytes_per_triangle", "prepare_ns_per_triangle")
            )
            if size is not None:
                words = f"{size} bytes" + (f", prepared in {prepare:.0f} ns" if prepare else "")
                told.setdefault(kernel, []).append(words)
    if not told:
        return ""
    parts = [f"{kernel} {words[0]}" for kernel, words in told.items()]
    return f"read of a triangle (float32, packed): {'; '.join(parts)}"


def work(run: "Run") -> str:
    """Return the amount of work in words ("25,000 pairs x 20,000 repetitions"), or nothing."""
    config = run.info.get("config") or {}
    pairs, repetitions = config.get("triangles"), config.get("repetitions")
    if not isinstance(pairs, int) or not isinstance(repetitions, int):
        return ""
    return f"{pairs:,} pairs x {repetitions:,} repetitions"
