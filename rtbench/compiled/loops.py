"""The loop around a kernel, and a kernel made into it.

One loop nest serves every order of the tests, so that the compiler can lift nothing out:
k = first[a] + second[b]. In repeat order ``first`` holds the pairs and ``second`` zeros (each
pair many times in a row, as ray_test.exe of 2007 did it); in sweep order ``first`` holds zeros
and ``second`` the shuffled pairs, or a longer list in which each stands many times.
"""

from __future__ import annotations

import functools

import numpy as np

from rtbench.compiled import embedded, stages, syntax
from rtbench.compiled.elsewhere import instantiate_for
from rtbench.compiled.instantiate import Instance
from rtbench.compiled.layout import record_types
from rtbench.compiled.machine_code import instructions
from rtbench.compiled.sources import named
from rtbench.errors import RtbenchError
from rtbench.kernels.contract import NO_T, TMAX, ZERO, Kernel, kernel

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
TAKES_TMAX = DIVIDED_LAST = SKIPS_NOTHING = RETURNS_T = RETURNS_THREE = False


def test(tri, ray, tmax):  # the kernel
    return 0, 0.0


def one(tri, ray):  # the kernel over one pair
    if TAKES_TMAX:
        return test(tri, ray, ray.tmax)
    return test(tri, ray)


def nest(triangles, rays, first, second, outcome, t, u, v):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            result = one(triangles[k], rays[k])
            # Every output reaches memory: one that nobody reads would be optimised away.
            outcome[k] = result[0]
            if RETURNS_T:
                t[k] = result[1]
            if RETURNS_THREE:
                u[k] = result[2]
                v[k] = result[3]


def chain(triangles, rays, first, second, outcome, t, u, v):
    # No t lies below the limit, but only the result itself tells the processor so: the next pair's
    # address waits for it, as a traversal waits for its tmax.
    limit = -REAL(first.shape[0]) * REAL(1e30)
    late = np.uint64(0)
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b] + late
            result = one(triangles[k], rays[k])
            late = np.uint64(result[1] < limit)
            outcome[k] = result[0]
            t[k] = result[1]
            if RETURNS_THREE:
                u[k] = result[2]
                v[k] = result[3]


def nearest(triangles, rays, first, second, outcome, t, u, v):
    for a in range(first.shape[0]):
        for b in range(second.shape[0]):
            k = first[a] + second[b]
            hit = np.int32(-1)
            tmax = rays[k].tmax
            hit_u = hit_v = ZERO
            for i in range(triangles.shape[0]):
                if TAKES_TMAX:
                    result = test(triangles[i], rays[k], tmax)
                    nearer = result[0] == 0
                    if DIVIDED_LAST:  # t is rounded after tmax let it pass: a tie may have too
                        nearer = nearer and result[1] < tmax
                else:
                    result = test(triangles[i], rays[k])
                    nearer = (result[0] == 0) & (result[1] > ZERO) & (result[1] < tmax)
                if SKIPS_NOTHING:
                    # Else the compiler would branch, and compute what only a hit needs after it.
                    outcome[k] = result[0]
                    t[k] = result[1]
                    if RETURNS_THREE:
                        u[k] = result[2]
                        v[k] = result[3]
                # tmax shrinks to each hit, and a tie is not nearer: it goes to the lower index.
                if nearer:
                    hit = np.int32(i)
                    tmax = result[1]
                    if RETURNS_THREE:
                        hit_u = result[2]
                        hit_v = result[3]
            outcome[k] = hit
            t[k] = tmax
            if RETURNS_THREE:
                u[k] = hit_u
                v[k] = hit_v


LOOPS = {"independent": nest, "dependent": chain, "nearest": nearest}
PAIR_BY_PAIR = ("independent", "dependent")
NEED_T = ("dependent", "nearest")


@kernel(
    title="the loop alone",
    method="empty",
    domain="line",
    outcomes=("hit", "miss"),
    source="what is left of the loop when nothing is tested",
)
def empty(tri, ray):
    return 1, NO_T


@functools.cache
def loop(
    chosen: Kernel,
    precision: str = "float32",
    layout: str = "shared",
    stage: str | None = None,
    kind: str = "independent",
    target: str = "native",
    flags: str = "strict",
) -> Instance:
    """Return the compiled loop over one kernel.

    Parameters
    ----------
    chosen : Kernel
    precision : str
        float32, float64 or mixed.
    layout : str
        shared or own.
    stage : str, optional
        Cut the kernel off where this stage ends.
    kind : str
        ``independent`` tests, or ``dependent`` ones (each waits for the t of the one before), or
        ``nearest``: each ray against all triangles in their order, tmax shrinking.
    target, flags : str
        What it is compiled for and what LLVM may do with floats: `rtbench.compiled.targets`,
        `rtbench.compiled.instantiate.FLAGS`.

    Returns
    -------
    Instance
        ``call(triangles, rays, first, second, outcome, t, u, v)``: records as
        :func:`rtbench.compiled.layout.fill` makes them, uint64 indices (A,) and (B,), and the
        outputs int32 (N,) and three arrays (N,) of the arithmetic's precision: the kernel's
        outputs in their order, of length 0 those it does not return. Runs A x B tests without
        the GIL. With ``nearest`` triangles are (T,), rays (N,), outcome is the index of the
        triangle that is hit (-1: none), t is tmax where there is none, and A x B x T tests run.
    """
    if kind in NEED_T and "t" not in chosen.outputs:
        raise RtbenchError(f"kernel {chosen.name!r} returns no t: {kind} tests need one")
    triangle, ray = record_types(chosen, layout, precision, (TMAX,) if kind == "nearest" else ())
    function = syntax.tree(chosen) if stage is None else stages.cut(chosen, stage)
    entry = f"{chosen.name}_loop"
    inside = embedded.in_numbers(chosen, precision, triangle, ray, ("one", entry), function)
    skips_nothing = chosen.ending is not None and not chosen.ending.early
    what = f"{chosen.name} in {precision}, records: {layout}, tests: {kind}"
    real = inside.constants["REAL"].removeprefix("np.")
    with embedded.refused_in_a_line(chosen):
        return instantiate_for(
            target,
            named(syntax.parse(LOOPS[kind]), entry),
            callees=(*inside.callees, *([] if kind == "nearest" else [one])),
            constants=inside.constants | {"SKIPS_NOTHING": str(skips_nothing)},
            signature=(
                "void(TRIANGLE[::1], RAY[::1], uint64[::1], uint64[::1], int32[::1], "
                f"{real}[::1], {real}[::1], {real}[::1])"
            ),
            title=what if stage is None else f"{what}, cut off after {stage!r}",
            forceinline=True,
            flags=flags,
            imports=inside.imports,
            outlined=inside.outlined,
        )


def machine_code(chosen: Kernel, precision: str, layout: str) -> str:
    """Return the machine code of a kernel's loop as text, written when it was compiled."""
    return "\n".join(instructions(loop(chosen, precision, layout).assembly))
