"""``rtbench machine``: what this machine is, and whether it is fit to measure on."""

import click


@click.command(
    "machine",
    epilog="Example:  rtbench machine --format json",
)
@click.option(
    "--format",
    "format_",
    type=click.Choice(["plain", "json"]),
    default="plain",
    show_default=True,
    help="How to print it.",
)
@click.option("--strict", is_flag=True, help="Exit with 1 if it is not quiet enough to measure.")
def command(format_: str, strict: bool) -> None:
    """Print what this machine is and what on it disturbs measuring, each with its cure."""
    from dataclasses import asdict

    from rtbench.errors import CheckFailed
    from rtbench.measure import float_control, machine, noise

    # The loop on the clock comes first: it wakes the CPU up, so that its clock can be judged.
    jitter, resolution = noise.jitter(), noise.timer_resolution()
    load, fingerprint = machine.load(), machine.fingerprint()
    floats = float_control.state()
    found = noise.complaints(fingerprint, load, jitter, resolution)
    found += float_control.complaints(floats)
    quiet = noise.quiet_enough(found)
    measured = {"timer_resolution_ns": resolution, "jitter": jitter}
    parts = {
        "machine": fingerprint,
        "software": machine.software(),
        "load": load,
        "float_state": floats,
        "noise": measured,
    }
    if format_ == "json":
        import json

        verdict = {"quiet_enough": quiet, "complaints": [asdict(one) for one in found]}
        click.echo(json.dumps({**parts, **verdict}, indent=2))
    else:
        for name, values in parts.items():
            click.echo(name.replace("_", " "))
            for key, value in values.items():
                click.echo(f"  {key:<20} {_plain(key, value)}")
        click.echo("quiet enough to measure" if quiet else "NOT quiet enough to measure")
        for one in found:
            click.echo(f"- {one.what}{'' if one.serious else ' (a remark)'}: {one.why}")
            click.echo(f"  cure: {one.cure}")
    if strict and not quiet:
        serious = [one.what for one in found if one.serious]
        raise CheckFailed(f"not quiet enough to measure: {'; '.join(serious)}")


def _plain(key: str, value: object) -> str:
    """Return a value in one line; sizes in binary units."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int) and key.startswith("memory"):
        return f"{value / 2**30:.1f} GiB"
    if key == "caches" and isinstance(value, list):
        return ", ".join(_cache(one) for one in value)
    if isinstance(value, list):
        return " ".join(map(str, value))
    if isinstance(value, dict):
        return ", ".join(f"{name} {_plain(name, part)}" for name, part in value.items())
    return str(value)


def _cache(cache: dict) -> str:
    """Return a cache in words, e.g. ``L1 data 48 KiB by 2``."""
    size = cache["size_bytes"]
    told = f"{size // 1024} KiB" if isinstance(size, int) else size
    return f"L{cache['level']} {cache['type']} {told} for {cache['shared_by']}"
