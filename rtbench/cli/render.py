"""``rtbench render``: trace a scene, and only the effects that it calls for."""

from __future__ import annotations

import json
import re
from pathlib import Path

import click

from rtbench.cli import options
from rtbench.cli import render_options as checks

EXAMPLES = """\b
Examples:
  rtbench render glass --size 320x240
  rtbench render glass --size 160x120 --out glass.pfm --stats glass.json --threads 2
  rtbench render glass --size 160x120 --without shadows --heat heat.png
  rtbench render glass --size 160x120 --orbit --frames 10 --kernel moller1
"""
OF_SCENE = ("depth", "samples", "threshold")
file_path = click.Path(path_type=Path)


@click.command(epilog=EXAMPLES)
@click.argument("scene")
@click.option("--size", metavar="WxH", help="Pixels.  [the scene's]")
@click.option(
    "--out", type=file_path, metavar="FILE", help="png, or linear floats: npy, pfm.  [NAME.png]"
)
@click.option("--threads", type=int, help="The picture is the same for any number.  [all cores]")
@click.option("--precision", metavar="P", help="float32 or float64.  [float64]")
@click.option(
    "--kernel",
    "-k",
    multiple=True,
    metavar="NAME",
    help="What tests triangles; with --orbit repeatable.  [watertight_safe]",
)
@click.option("--structure", metavar="S", help="bvh or kd.  [bvh; kd for a rule or a builder]")
@click.option("--rule", metavar="RULE", help="sah, or of kd object_median, spatial_median.  [sah]")
@click.option(
    "--builder", metavar="B", help="Of kd by the SAH: nlogn, nlog2n, n2, binned.  [nlogn]"
)
@click.option(
    "--depth", type=int, help="Generations of mirrored and refracted rays.  [the scene's]"
)
@click.option("--samples", type=int, help="Rays a pixel, a square number.  [the scene's]")
@click.option(
    "--threshold",
    type=float,
    help="Rays that could change no pixel by more are not shot.  [the scene's]",
)
@click.option(
    "--without",
    multiple=True,
    metavar="EFFECT",
    help="Leave out what the scene calls for; repeatable.",
)
@click.option(
    "--force",
    multiple=True,
    metavar="EFFECT",
    help="Compile in what the scene does not call for; repeatable.",
)
@click.option(
    "--subsampling",
    metavar="X,Y",
    help="Trace the corners of cells of X by Y pixels, and the rest where they differ.",
)
@click.option(
    "--tolerance", type=float, help="By how much corners may differ, from 0 to 1.  [0.05]"
)
@click.option("--interpolation", metavar="I", help="bilinear or nearest.  [bilinear]")
@click.option(
    "--no-shadow-cache", is_flag=True, help="Do not try each light's last occluder first."
)
@click.option("--first-hit", is_flag=True, help="Find what primary rays hit by rasterising.")
@click.option(
    "--heat",
    type=file_path,
    metavar="FILE.png",
    help="Tree steps and tests of each pixel, as FILE-steps.png and FILE-tests.png.",
)
@click.option(
    "--ledger", is_flag=True, help="Effect by effect: who called for it, and what it costs."
)
@click.option(
    "--stats", type=file_path, metavar="FILE.json", help="Seconds, rays and effects as JSON."
)
@click.option("--orbit", is_flag=True, help="Frames per second of a camera that goes round.")
@click.option("--frames", type=int, help="Of the turn.  [60]")
@click.option(
    "--objects",
    metavar="N,N,...",
    help="With --orbit: time scenes of so many spheres and triangles too.",
)
@click.option(
    "--models",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Where mesh files are looked for.  [RTBENCH_MODELS]",
)
@options.table_format
@options.quiet
@checks.help_scene
def command(scene, models, form, quiet, **asked):
    """Trace SCENE into a picture.

    SCENE is a scene in TOML, an NFF file, a mesh file or a generated model (framed and lit), or the
    name of a scene that comes with rtbench. --help-scene shows the format.

    What the scene does not call for is not compiled: no refraction without glass, no shadow rays
    without lights. Prints what was simulated, the seconds, the rays by kind, and the file. json is
    the object that --stats writes.

    --orbit times one turn of the camera, frame by frame in turns: every kernel, subsampling and
    shading on and off. --ledger traces the scene again for each effect.
    """
    from rtbench.cli.progress import Progress

    checks.must_agree(asked)
    threads = checks.threads_of(asked["threads"])
    size = checks.size_of(asked["size"]) if asked["size"] is not None else None
    progress = Progress(quiet)
    try:
        chosen = _options(asked)
        found = _scene(scene, models, size, asked)
        for remark in found.remarks:
            click.echo(f"rtbench: {remark}", err=True)
        if asked["orbit"]:
            told = _orbit(found, chosen, asked, threads, progress).render(form)
        else:
            told = _render(found, chosen, asked, threads, form, progress)
    finally:
        progress.end()
    click.echo(told)


def _scene(name: str, models: Path | None, size: tuple[int, int] | None, asked: dict):
    """Return the scene, with the settings and the size that were asked for."""
    import dataclasses

    from rtbench.scenes import reading

    found = reading.read(name, models)
    settings = dataclasses.replace(found.settings, **_given(asked, OF_SCENE))
    width, height = size or (found.camera.width, found.camera.height)
    camera = dataclasses.replace(found.camera, width=width, height=height)
    return dataclasses.replace(found, camera=camera, settings=settings)


def _options(asked: dict):
    """Return the options of the tracer; what was not asked for stays as it is there."""
    from rtbench.kernels import registry
    from rtbench.scenes.model import Settings
    from rtbench.tracer.options import Options, Subsampling
    from rtbench.trees import options as trees
    from rtbench.trees.leaves import must_be_fit

    for name in asked["kernel"]:
        must_be_fit(registry.find(name))
    of_tree = _given(asked, ("structure", "rule", "builder"))
    trees.Options(**of_tree)
    of_tree["structure"] = checks.structure_of(**of_tree)
    Settings(**_given(asked, OF_SCENE))  # found out before the scene is read
    given = _given(asked, ("precision",)) | of_tree
    if asked["kernel"]:
        given["kernel"] = asked["kernel"][0]
    if asked["subsampling"] is not None:
        more = _given(asked, ("tolerance", "interpolation"))
        given["subsampling"] = Subsampling(grid=checks.grid_of(asked["subsampling"]), **more)
    return Options(
        without=asked["without"],
        force=asked["force"],
        shadow_cache=not asked["no_shadow_cache"],
        first_hit=asked["first_hit"],
        counted=asked["heat"] is not None,
        **given,
    )


def _given(asked: dict, names: tuple[str, ...]) -> dict:
    return {name: asked[name] for name in names if asked[name] is not None}


def _render(scene, chosen, asked, threads, form, progress) -> str:
    """Write the picture and what else was asked for; return what is printed."""
    from rtbench.images.writing import SUFFIXES, write
    from rtbench.records.tabular import replace
    from rtbench.report.layouts import picture as layout
    from rtbench.tracer.effects import called_for
    from rtbench.tracer.render import Renderer

    out = asked["out"] or Path(f"{_file_name(scene.name)}.png")
    heats = _heat_files(asked["heat"])
    files = [("--out", out, SUFFIXES), *(("--heat", path, (".png",)) for path in heats.values())]
    if asked["stats"] is not None:
        files.append(("--stats", asked["stats"], (".json",)))
    checks.must_be_writable(files)
    progress.say("compiling and building")
    renderer = Renderer(scene, chosen)
    camera = scene.camera
    progress.plan(f"{scene.name}, {camera.width} x {camera.height}, {_threads(threads)}")
    done = renderer.render(threads=threads, progress=progress.progress)
    progress.end()
    head = f"{scene.name}: {camera.width} x {camera.height}, {_traced_with(chosen)}"
    held = write(out, done.pixels, head)
    if held.not_numbers:
        click.echo(f"rtbench: {held.not_numbers:,} pixels are not numbers", err=True)
    told = layout.stats(done.seconds, done.rays, done.effects)
    if asked["stats"] is not None:
        replace(asked["stats"], json.dumps(told, indent=2) + "\n")
    if heats:
        progress.say("drawing heat maps")
        _write_heats(heats, done.heat, head)
    ledger = _ledger(scene, chosen, threads, progress) if asked["ledger"] else []
    progress.end()
    if form == "json":
        if ledger:
            told["ledger"] = json.loads(ledger[0].render(form))
        return json.dumps(told, indent=2, ensure_ascii=False)
    rays = layout.table(told, done.saved)
    if form == "csv":
        return (ledger or [rays])[0].render(form)
    lines = layout.lines(told, called_for(scene), chosen.without, chosen.force)
    parts = [head, *lines, "", rays.render(form), ""]
    for table in ledger:
        parts += [table.render(form), ""]
    if held.clipped:
        parts.append(f"{held.clipped:,} pixels are too bright for a png: npy and pfm keep them")
    parts.append(f"written: {', '.join(str(path) for _, path, _ in files)}")
    return "\n".join(parts)


def _heat_files(path: Path | None) -> dict[str, Path]:
    if path is None:
        return {}
    return {what: path.with_name(f"{path.stem}-{what}{path.suffix}") for what in ("steps", "tests")}


def _write_heats(files: dict[str, Path], heat: dict, remark: str) -> None:
    from rtbench.report.charts import style
    from rtbench.report.charts.picture_heat import heat_figure

    for what, path in files.items():
        figure = heat_figure(heat[what], what, "a pixel", remark=remark)
        style.save(figure, path.with_suffix(""), ("png",))


def _ledger(scene, chosen, threads, progress) -> list:
    """Return the tables of the ledger: numbers, and what calls for each effect."""
    from rtbench.report.layouts.ledger import ledger_tables
    from rtbench.tracer.ledger import ledger

    progress.plan(f"the ledger of {scene.name}: with and without each effect, in turns")
    found = ledger(scene, chosen, progress=progress.progress, threads=threads)
    return ledger_tables(found.record())


def _orbit(scene, chosen, asked, threads, progress):
    from rtbench.report.layouts.orbit import table
    from rtbench.tracer import orbit

    counts = checks.counts_of(asked["objects"]) if asked["objects"] is not None else ()
    width, height = scene.camera.width, scene.camera.height
    scenes = [scene, *(orbit.crowd(count, width, height) for count in counts)]

    def prepared(fraction: float) -> None:
        progress.progress(fraction)
        if fraction == 1:
            progress.plan("going round")

    progress.plan("compiling and building every variant")
    rows = orbit.orbit(
        scenes,
        chosen,
        asked["kernel"] or orbit.KERNELS,
        orbit.FRAMES if asked["frames"] is None else asked["frames"],
        threads,
        progress.progress,
        prepared,
    )
    frames = rows[0]["frames"]
    title = f"{frames} frames of {width} x {height}, {_threads(threads)}, {chosen.precision}"
    return table(rows, title)


def _traced_with(chosen) -> str:
    return f"{chosen.precision}, {chosen.structure}, {chosen.kernel}"


def _threads(count: int) -> str:
    return f"{count} thread{'s' * (count > 1)}"


def _file_name(name: str) -> str:
    return re.sub(r"[^\w.+-]+", "-", name).strip("-.") or "picture"
