"""Machine code as text: what is measured, all of it, and nothing around it."""

import platform

import pytest

from rtbench.accuracy.bounds import compiled_filter
from rtbench.compiled import instantiate as door
from rtbench.compiled.layout import LAYOUTS, PRECISIONS
from rtbench.compiled.loops import LOOPS, loop, machine_code
from rtbench.compiled.machine_code import digest, instructions
from rtbench.kernels.registry import all_kernels

KERNELS = {
    name: each
    for name, each in all_kernels().items()
    if not each.ending or (name.startswith("wald") and name.endswith("_uv"))
}
x86 = pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="names instructions of x86"
)


def test_every_loop_has_machine_code_of_its_own():
    """No two kernels, and no two forms of one, run the same code."""
    digests = {
        (name, p): loop(kernel, p, "own").code_digest
        for name, kernel in KERNELS.items()
        for p in PRECISIONS
    }
    assert len(set(digests.values())) == len(digests)
    kinds = {kind: loop(KERNELS["moller1"], kind=kind).code_digest for kind in LOOPS}
    assert len(set(kinds.values())) == 3
    layouts = {layout: loop(KERNELS["moller1"], "float32", layout) for layout in LAYOUTS}
    assert len({made.code_digest for made in layouts.values()}) == 3


@x86
def test_the_digest_sees_each_instruction_and_each_constant():
    assembly = loop(KERNELS["moller1"]).assembly
    assert digest(assembly.replace("divss", "mulss")) != digest(assembly)
    assert "0x358637bd" in assembly  # 1e-6 in float32
    assert digest(assembly.replace("0x358637bd", "0x3727c5ac")) != digest(assembly)


@x86
def test_machine_code_is_the_loop_and_nothing_around_it():
    shown = machine_code(KERNELS["badouel"], "float32", "shared").splitlines()
    divisions = [line for line in shown if "divss" in line]
    # t, beta and alpha where u1 = 0 or not: 3 or, the first shared by both, 5.
    assert 3 <= len(divisions) <= 5
    for line in shown:
        assert "PyArg" not in line and "NRT_" not in line and "cfi" not in line
        assert "rtbench" not in line


@pytest.mark.parametrize("name", KERNELS)
def test_nothing_is_reference_counted_in_a_loop(name):
    """_nrt=False, an undocumented option of numba, still does what it is there for."""
    for precision in PRECISIONS:
        code = "\n".join(instructions(loop(KERNELS[name], precision, "own").assembly))
        if KERNELS[name].fallback:  # once a call then, and not in the loop
            code = code[code.index("vmul" if "vmul" in code else "mul") :]
        assert "ret" in code and "NRT" not in code and "decref" not in code


def functions(made):
    """Return the lines of each function of a module's machine code: the entry, then callees."""
    found = []
    for line in instructions(made.assembly):
        if line.endswith(":") and "CPI" not in line and not line.startswith(".L"):
            found.append([])
        if found:
            found[-1].append(line)
    return found


def test_callees_that_take_arrays_are_not_reference_counted():
    """The entry counts once before its loop and once after it, whatever it calls in between."""
    entry, *callees = functions(compiled_filter("float32"))
    assert callees
    assert not any("NRT" in line for callee in callees for line in callee)
    labels = [i for i, line in enumerate(entry) if line.startswith(".L")]
    increments = [i for i, line in enumerate(entry) if "NRT_incref" in line]
    assert all(i < labels[0] for i in increments)


# Callees too large to be inlined, one of which hands its arrays on.
LARGE = "def {name}(rows, i):\n    x = rows[i, 0]\n" + "".join(
    f"    if x > {k}:\n        x = x * rows[i, {k % 3}] - {k}\n" for k in range(60)
)
CALLEES = (
    LARGE.format(name="deep") + "    return x\n",
    LARGE.format(name="wide") + "    return x + deep(rows, i) * deep(rows, i + 1)\n",
)
CALLER = """def caller(rows, out):
    for i in range(out.shape[0]):
        out[i] = wide(rows, i) - deep(rows, i) + wide(rows, i + 1)
"""


def test_the_option_against_reference_counts_is_what_keeps_them_out(monkeypatch):
    given = {"signature": "void(float64[:, ::1], float64[::1])", "callees": CALLEES}
    _, *callees = functions(door.instantiate(CALLER, **given))
    assert len(callees) == 2
    assert not any("NRT" in line for callee in callees for line in callee)
    monkeypatch.setattr(door, "HEADER", door.HEADER.replace("_nrt=False", "_nrt=True"))
    counted = functions(door.instantiate(CALLER, **given))
    assert any("NRT_incref" in line for function in counted[1:] for line in function)


def test_a_loop_runs_without_the_gil():
    assembly = loop(KERNELS["moller1"]).assembly
    assert "PyEval_SaveThread" in assembly and "PyEval_RestoreThread" in assembly
