"""Callees: their code is in the entry, and nowhere else."""

import math
import re

import numba
import numpy as np

from rtbench.compiled.callees import CalleeCompiler

LONG = " + ".join(f"math.sin(x * {k}.0)" for k in range(40))


def made(**options):
    """Return compiled functions, an entry and a callee too long to be inlined, and its name."""
    names = {"math": math}
    exec(f"def callee(x):\n    return {LONG}", names)
    callee = numba.njit(
        no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False, error_model="numpy", **options
    )(names["callee"])

    @numba.njit("float64(float64)", error_model="numpy")
    def entry(x):
        return callee(x) + callee(-2.0 * x)

    (compiled,) = callee.overloads.values()
    return entry, compiled.library, compiled.fndesc.llvm_func_name


def test_a_callee_has_no_machine_code_of_its_own():
    ours, library, name = made(pipeline_class=CalleeCompiler)
    assert library.get_pointer_to_function(name) == 0
    plain, library, name = made()
    assert library.get_pointer_to_function(name) != 0
    for x in np.linspace(-3.0, 3.0, 11):
        assert ours(x) == plain(x)


def test_a_callee_that_was_not_inlined_is_in_its_callers_code():
    entry, _, name = made(pipeline_class=CalleeCompiler)
    code = entry.inspect_llvm(entry.signatures[0])
    assert re.search(rf"^define linkonce_odr .*@{re.escape(name)}\(", code, re.M)
