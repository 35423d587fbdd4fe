"""The ray tracer against POV-Ray and tachyon on scenes of the SPD: one thread each, by hand.

    python tests/speed/against_povray.py SCENES [--size 512] [--rounds 5] [--out FOLDER]

Needs povray (3.7), tachyon (0.99) and the folder with the SPD's .nff and .pov files. All take turns
in every round; a ratio is another's time of tracing over rtbench's (its whole call of render,
compiled and built before), round by round: the median and the range of the rounds. No
anti-aliasing, primary rays and DEPTH generations after them, the same threshold of weight where
there is one. tachyon's view is its own (see REMARKS): rtbench renders that view against it.
"""

import argparse
import math
import statistics
import sys
import time
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import povray_likeness as likeness
import povray_runs
import povray_scenes

SCENES = ("balls", "gears", "gears_far_lights", "teapot", "tetra", "jacks")
VOID = ("gears",)  # with tachyon
DEPTH, THRESHOLD = 5, 1 / 255
LONGEST = 5  # samples of one contestant in a round, whose median counts
CHOICES = (("float64", "float32"), ("moller_trumbore", "watertight_safe"), ("bvh", "kd"))

REMARKS = """\
Not comparable, and what is done about it
- The .pov files are made to mean what the .nff files mean: no ambient light, highlight = Ks, glass
  in closed solids (as they are, POV-Ray bends rays at the first face only), 1/sqrt(lights).
- POV-Ray mirrors totally reflected light whole, not tinted (gears); at the rim of smooth patches it
  lets mirrored rays run into the surface (teapot); what is nearer than 0.001 throws no shadow. It
  counts as rays also those it then refuses, and a shadow test for each glass on the way.
- POV-Ray tests the last occluder first; its bounding boxes are made when it reads the scene.
- tachyon draws a light as a sphere: gears, with a light before the eye, is void with it.
- tachyon ignores the NFF angle (half of its picture is 0.5 wide at distance 1) and mirrors x:
  rtbench renders that view against it; its rays go through the corners of pixels.
- tachyon lets light through glass straight on, knows no threshold, has ambient 0.1 and no
  highlights in NFF, and takes polygons that are not convex for fans of triangles. A ray beyond
  the depth brings it the background, POV-Ray and rtbench nothing.
- The seconds of the process hold 0.6 s that povray sleeps, whatever the scene."""


@dataclass
class Contest:
    """What is known of one scene; samples are (seconds by the clock, of the processors)."""

    name: str
    samples: dict[tuple[str, str], list[tuple[float, float]]] = field(default_factory=dict)
    runs: dict[str, povray_runs.Run] = field(default_factory=dict)
    pictures: dict[tuple[str, str], object] = field(default_factory=dict)
    ready: dict[str, float] = field(default_factory=dict)
    alike: list[list[str]] = field(default_factory=list)


def contest(name: str, folder: Path, options) -> Contest:
    """Render a scene with everything, as often as asked for."""
    nff = (folder / f"{name}.nff").read_text()
    pov = (folder / f"{name.removesuffix('_far_lights')}.pov").read_text()
    made = Contest(name)
    who = others(made, povray_scenes.picture(pov, nff, DEPTH, THRESHOLD), nff, options.size)
    if options.peers_only:
        take_turns(who, options, made)
        return made
    from rtbench.scenes.nff import read

    scene = read(folder / f"{name}.nff")
    scene = replace(scene, camera=replace(scene.camera, width=options.size, height=options.size))
    take_turns(who | own(made, scene, options.variants), options, made)
    seen = likeness.seen_by_others(pov, nff, options.size, name not in VOID)
    theirs = made.runs["povray"].pixels
    for variant in options.variants:
        ours = made.pictures[variant, "povray"].pixels
        chosen = replace(options_of(variant), depth=0)
        row = likeness.differences(scene, nff, chosen, seen, ours, theirs)
        made.alike.append([name, variant, *row])
        print(f"{name}: {variant} compared", file=sys.stderr)
    return made


def others(made: Contest, scene: str, nff: str, size: int) -> dict:
    """Return the other programs as functions that give a sample."""
    lights = povray_scenes.for_tachyon(nff)
    renders = {"povray": lambda: povray_runs.povray(scene, size)}
    if made.name not in VOID:
        renders["tachyon"] = lambda: povray_runs.tachyon(lights, size, DEPTH)

    def sample(who):
        made.runs[who] = found = renders[who]()
        return found.trace, found.cpu

    return {(who, ""): partial(sample, who) for who in renders}


def own(made: Contest, scene, variants: list[str]) -> dict:
    """Return rtbench's variants, in POV-Ray's view and in tachyon's, as functions likewise."""
    from rtbench.tracer.render import Renderer

    views = {"povray": scene.camera}
    if made.name not in VOID:
        views["tachyon"] = replace(scene.camera, angle=likeness.TACHYON_ANGLE)

    def sample(renderer, variant, which):
        clock, busy = time.perf_counter(), time.process_time()
        picture = renderer.render(camera=views[which], threads=1)
        taken = time.perf_counter() - clock, time.process_time() - busy
        made.pictures[variant, which] = picture
        return taken

    who = {}
    for variant in variants:
        begin = time.perf_counter()
        renderer = Renderer(scene, options_of(variant))
        made.ready[variant] = time.perf_counter() - begin
        print(f"{made.name}: {variant} ready, {made.ready[variant]:.1f} s", file=sys.stderr)
        for which in views:
            who[variant, which] = partial(sample, renderer, variant, which)
    return who


def options_of(variant: str):
    """Return what a variant's name stands for."""
    from rtbench.tracer.options import Options

    chosen = dict(zip(("precision", "kernel", "structure"), variant.split("/"), strict=True))
    return Options(**chosen, depth=DEPTH, threshold=THRESHOLD)


def take_turns(who: dict, options, made: Contest) -> None:
    """Warm everyone, then let all take turns."""
    # A picture of some hundredths of a second is timed more than once in each round.
    often = {}
    for key, run in who.items():
        seconds = max(run()[0], 1e-6)
        often[key] = min(LONGEST, max(1, math.ceil(options.least / seconds)))
        made.samples[key] = []
    keys = list(who)
    for number in range(options.rounds):
        turn = number * len(keys) // options.rounds
        for key in keys[turn:] + keys[:turn]:
            taken = zip(*(who[key]() for _ in range(often[key])), strict=True)
            made.samples[key].append(tuple(statistics.median(each) for each in taken))
        print(f"{made.name}: round {number + 1} of {options.rounds}", file=sys.stderr)


def spread(values, form: str = ".3f") -> str:
    """Return the median and the range."""
    values = sorted(values)
    return f"{statistics.median(values):{form}} ({values[0]:{form}}..{values[-1]:{form}})"


def rows_of(made: Contest, clock: int) -> list[list[str]]:
    """Return a row a variant: seconds, and ratios paired round by round."""

    def times(key):
        return [sample[clock] for sample in made.samples[key]]

    def against(who, variant):
        if (who, "") not in made.samples:
            return []
        pairs = zip(times((who, "")), times((variant, who)), strict=True)
        return [theirs / ours for theirs, ours in pairs]

    rows = []
    for variant in made.ready or [""]:
        row = [made.name, variant]
        ratios = [against(who, variant) if variant else [] for who in ("povray", "tachyon")]
        for who, ratio in zip(("povray", "tachyon"), ratios, strict=True):
            there = (who, "") in made.samples
            row += [spread(times((who, ""))) if there else "void"]
            row += [spread(times((variant, who))) if there and variant else "-"]
            row += [spread(ratio, ".2f") if ratio else "-"]
        known = [ratio for ratio in ratios if ratio]
        lesser = [min(pair) for pair in zip(*known, strict=True)] if known else []
        rows.append([*row, spread(lesser, ".2f") if lesser else "-"])
    return rows


def wholes_of(made: Contest) -> list[list[str]]:
    """Return of everyone the trace, with all around it, and the rays."""

    def counted(rays):
        return ", ".join(f"{key} {count:,}" for key, count in rays.items() if count) or "-"

    rows = [
        [made.name, who, f"{run.trace:.3f}", f"{run.process:.3f}", "process", counted(run.rays)]
        for who, run in made.runs.items()
    ]
    for variant, ready in made.ready.items():
        trace = made.samples[variant, "povray"][-1][0]
        rays = counted(made.pictures[variant, "povray"].rays)
        rows.append(
            [
                made.name,
                variant,
                f"{trace:.3f}",
                f"{ready + trace:.3f}",
                "with compile, build",
                rays,
            ]
        )
    return rows


def show(made: list[Contest]) -> None:
    """Print the tables."""
    from tabulate import tabulate

    def table(title, heads, rows):
        print(f"\n{title}\n{tabulate(rows, headers=heads, disable_numparse=True)}")

    heads = ["scene", "rtbench", "povray", "rtbench", "ratio", "tachyon", "rtbench", "ratio"]
    for clock, what in enumerate(("by the clock", "of the processor")):
        table(
            f"Seconds {what}: median (least..greatest); the other's over rtbench's",
            [*heads, "to the better"],
            [row for each in made for row in rows_of(each, clock)],
        )
    heads = ["scene", "who", "trace", "all", "of what", "counted"]
    table("The last round, seconds", heads, [row for each in made for row in wholes_of(each)])
    alike = [row for each in made for row in each.alike]
    if alike:
        table("Pixels that differ from povray's", likeness.HEADS, alike)
    print(f"\n{REMARKS}")


def save(made: Contest, folder: Path) -> None:
    """Write all pictures as they are compared: no curve, 8 bits."""
    from PIL import Image

    pictures = {who: run.pixels for who, run in made.runs.items()}
    for (variant, which), picture in made.pictures.items():
        pictures[f"{variant.replace('/', '_')}-{which}_view"] = picture.pixels
    folder.mkdir(parents=True, exist_ok=True)
    for who, pixels in pictures.items():
        steps = np.rint(np.clip(pixels, 0, 1) * 255).astype(np.uint8)
        Image.fromarray(steps).save(folder / f"{made.name}-{who}.png")


def main() -> None:
    everything = ["/".join(each) for each in product(*CHOICES)]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with the .nff and .pov files")
    parser.add_argument("--scenes", nargs="*", default=list(SCENES), choices=SCENES)
    parser.add_argument("--size", type=int, default=512, help="of the square picture, pixels")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--least", type=float, default=0.3, help="seconds of samples a round")
    parser.add_argument("--variants", nargs="*", default=everything, help=everything[0])
    parser.add_argument("--out", type=Path, help="write the pictures to this folder")
    parser.add_argument("--peers-only", action="store_true", help="leave rtbench out")
    options = parser.parse_args()
    if options.size % 2:
        parser.error(f"size {options.size} is not allowed (allowed: even numbers)")
    made = []
    for name in options.scenes:
        made.append(contest(name, options.folder, options))
        if options.out:
            save(made[-1], options.out)
    show(made)


if __name__ == "__main__":
    main()
