"""Generated modules: nothing is compiled twice, nothing is confused, and the code can be read."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rtbench.compiled.instantiate import instantiate
from rtbench.compiled.layout import LAYOUTS, PRECISIONS
from rtbench.compiled.loops import loop
from rtbench.errors import RtbenchError
from rtbench.kernels.registry import all_kernels

# A listing with and without u, v, listings that store a plane, and methods of pieces.
SOME = ("moller1", "moller1_uv", "badouel_uv", "chirkov", "wald_uv", "kensler_shirley_last_uv")
KERNELS = {name: all_kernels()[name] for name in (*SOME, "perpendicular_planes_last_whole_uv")}

PRELUDE = """
import json, os, sys
from pathlib import Path
import numpy as np
from rtbench.compiled import cache
from rtbench.compiled.instantiate import instantiate
from rtbench.compiled.loops import loop
from rtbench.kernels.registry import all_kernels
KERNELS = {name: all_kernels()[name] for name in NAMES}
"""


def started(code, folder, **environment):
    """Start code in a fresh interpreter with a cache folder of its own."""
    return subprocess.Popen(
        [sys.executable, "-c", PRELUDE.replace("NAMES", repr(list(KERNELS))) + code],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"RTBENCH_CACHE_DIR": str(folder)} | environment,
    )


def fresh_process(code, folder, **environment):
    """Return the JSON that code prints."""
    process = started(code, folder, **environment)
    told, _ = process.communicate()
    assert process.returncode == 0
    return json.loads(told)


def files(folder):
    """Return the files in a folder and when each was written."""
    return {
        str(path.relative_to(folder)): path.stat().st_mtime_ns
        for path in folder.rglob("*")
        if path.is_file()
    }


ONE_LOOP = """
made = loop(KERNELS["moller1"])
print(json.dumps([made.fresh, made.code_digest, made.path.name]))
"""


def test_a_second_start_compiles_nothing(tmp_path):
    fresh, code, _ = fresh_process(ONE_LOOP, tmp_path)
    assert fresh
    before = files(tmp_path)
    again, same, _ = fresh_process(ONE_LOOP, tmp_path)
    assert (again, same) == (False, code)
    after = files(tmp_path)
    assert set(after) == set(before)
    # Only the module is touched, which says that it is still in use.
    changed = [name for name in after if after[name] != before[name]]
    assert len(changed) == 1 and changed[0].endswith(".py")


def test_one_entry_a_file_and_no_more(tmp_path):
    *_, name = fresh_process(ONE_LOOP, tmp_path)
    stem = name.removesuffix(".py")
    found = [file.rpartition("/")[2] for file in files(tmp_path)]
    assert all(file.startswith(stem) for file in found)
    assert sorted(file.rpartition(".")[2] for file in found) == ["nbc", "nbi", "py", "s"]


EVERY_VARIANT = """
from rtbench.compiled.intersect import run_once
from rtbench.compiled.layout import LAYOUTS, PRECISIONS, fill
import hashlib
random = np.random.default_rng(1)
vertices = tuple(random.random((3, 500, 3)))
origins, directions = random.random((500, 3)), random.random((500, 3)) - 0.5
variants = [(k, p, l) for k in KERNELS for p in PRECISIONS for l in LAYOUTS]
answers, compiled, stems = {}, 0, set()
for name, precision, layout in variants[::STEP]:
    kernel = KERNELS[name]
    made = loop(kernel, precision, layout)
    compiled += made.fresh
    stems.add(made.path.stem)
    records = fill(kernel, layout, precision, vertices, origins, directions)
    outputs = run_once(made, kernel, precision, *records)
    bits = hashlib.sha256(b"".join(np.nan_to_num(x, nan=-1.0).tobytes() for x in outputs))
    answers[" ".join((name, precision, layout))] = bits.hexdigest()
print(json.dumps([compiled, answers, sorted(stems)]))
"""


@pytest.fixture(scope="module")
def all_variants():
    """Compile every variant, one after the other, into the session's cache."""
    folder = Path(os.environ["RTBENCH_CACHE_DIR"])
    _, answers, stems = fresh_process(EVERY_VARIANT.replace("STEP", "1"), folder)
    assert len(answers) == len(KERNELS) * len(PRECISIONS) * len(LAYOUTS)
    return folder, answers, stems


def test_in_reverse_order_every_variant_gives_the_same_answers_and_nothing_is_compiled(
    all_variants,
):
    folder, answers, stems = all_variants

    def own():  # others of this session may compile meanwhile
        return {name for name in files(folder) if Path(name).name.split(".")[0] in stems}

    before = own()
    assert len(before) == 4 * len(stems)
    compiled, again, same = fresh_process(EVERY_VARIANT.replace("STEP", "-1"), folder)
    assert compiled == 0
    assert again == answers
    assert same == stems and own() == before


def test_variants_differ_where_they_should(all_variants):
    """Precision changes the bits of t, u in the answers; the layout does not."""
    _, answers, _ = all_variants
    for name in KERNELS:
        single, double, mixed = (answers[f"{name} {p} own"] for p in PRECISIONS)
        assert len({single, double, mixed}) == 3
        for precision in PRECISIONS:
            assert answers[f"{name} {precision} own"] == answers[f"{name} {precision} shared"]


def test_two_processes_that_compile_the_same_at_once(tmp_path):
    processes = [started(ONE_LOOP, tmp_path) for _ in range(3)]
    told = [json.loads(process.communicate()[0]) for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0]
    assert len({(code, name) for _, code, name in told}) == 1
    assert fresh_process(ONE_LOOP, tmp_path)[0] is False


MADE_OF_TEXT = """
values = np.full(3, 8.0)
helper = "def helper(x):\\n    return x OPERATION CONSTANT\\n"
entry = '''def entry(values):
    for i in range(values.shape[0]):
        values[i] = helper(values[i])
'''
made = instantiate(entry, signature="void(float64[::1])", callees=(helper,),
                   constants={"CONSTANT": "VALUE"}, title="TITLE")
made.call(values)
print(json.dumps([values.tolist(), made.path.name, made.fresh]))
"""


def variant(operation="+", value="2.0", title="t"):
    code = MADE_OF_TEXT.replace("OPERATION", operation).replace("VALUE", value)
    return code.replace("TITLE", title)


def test_a_changed_helper_constant_or_source_is_another_file(tmp_path):
    """numba alone would load the old code: it sees neither callees nor globals."""
    told = [
        fresh_process(code, tmp_path)
        for code in (variant(), variant("*"), variant(value="3.0"), variant(title="u"))
    ]
    assert [values for values, *_ in told] == [[10.0] * 3, [16.0] * 3, [11.0] * 3, [10.0] * 3]
    assert len({name for _, name, _ in told}) == 4
    assert all(fresh for *_, fresh in told)
    again = fresh_process(variant(), tmp_path)
    assert again == [*told[0][:2], False]


@pytest.mark.parametrize("missing", [".s", ".nbi", ".nbc", ".py"])
def test_what_is_missing_is_made_again(missing, tmp_path):
    _, code, _ = fresh_process(ONE_LOOP, tmp_path)
    before = set(files(tmp_path))
    (lost,) = tmp_path.rglob(f"*{missing}")
    lost.unlink()
    _, again, _ = fresh_process(ONE_LOOP, tmp_path)
    assert again == code
    assert set(files(tmp_path)) == before
    assert fresh_process(ONE_LOOP, tmp_path)[0] is False


def test_an_edited_module_is_written_anew(tmp_path):
    _, code, _ = fresh_process(ONE_LOOP, tmp_path)
    (module,) = tmp_path.rglob("*.py")
    text = module.read_text()
    module.write_text(text.replace("EPSILON = REAL(1e-06)", "EPSILON = REAL(1.0)"))
    assert module.read_text() != text
    assert fresh_process(ONE_LOOP, tmp_path)[1] == code
    assert module.read_text() == text


def test_what_does_not_compile_leaves_nothing_behind(tmp_path):
    code = """
try:
    instantiate("def entry(x):\\n    return x.nothing\\n", signature="float64(float64)")
except Exception as problem:
    print(json.dumps(type(problem).__name__))
"""
    assert fresh_process(code, tmp_path) == "TypingError"
    assert files(tmp_path) == {}


def test_the_digest_of_machine_code_does_not_hang_on_folder_process_or_file(tmp_path):
    """Equal from two folders, and of two modules that differ in their title alone."""
    told = [fresh_process(ONE_LOOP, tmp_path / name) for name in ("a", "b/c")]
    assert told[0] == told[1]
    first = KERNELS["moller1"]
    before = loop(KERNELS["badouel_uv"], "float64", "own")  # numbers the types otherwise
    assert loop(first).code_digest == told[0][1] != before.code_digest


@pytest.mark.parametrize(
    "switch", [{"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}, {"NUMBA_BOUNDSCHECK": "1"}]
)
def test_other_code_is_another_module(tmp_path, switch):
    """numba's own switches change the code: neither the file nor its digest may be mistaken."""
    code = (
        "from rtbench.kernels.registry import find; from rtbench.compiled.loops import loop; "
        "made = loop(find('moller1')); print(made.path.name, made.code_digest, made.fresh)"
    )
    told = []
    for more in ({}, switch, {}):
        place = {"RTBENCH_CACHE_DIR": str(tmp_path)}
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | place | more,
            capture_output=True,
            text=True,
            check=True,
        )
        told.append(done.stdout.split())
    plain, switched, again = told
    assert plain[:2] == again[:2] and again[2] == "False"
    assert switched[0] != plain[0] and switched[1] != plain[1]


FLAGGED = """
source = "def entry(x, y):\\n    return (x + y) - x\\n"
made = [instantiate(source, signature="float32(float32, float32)", flags=flags, title="t")
        for flags in ("strict", "contract", "fast")]
big, one = np.float32(2.0**30), np.float32(1.0)
print(json.dumps([[each.call(big, one) for each in made], [each.path.name for each in made],
                  [each.code_digest for each in made], made[0].path.read_text()]))
"""


def test_flags_are_in_the_code_and_in_the_digest(tmp_path):
    """2^30 + 1 is 2^30 in single precision: only who computes as with real numbers finds 1."""
    answers, names, codes, strict = fresh_process(FLAGGED, tmp_path)
    assert answers == [0.0, 0.0, 1.0]
    assert len(set(names)) == 3
    assert codes[0] == codes[1] != codes[2]
    assert "fastmath" not in strict


def test_flags_reach_the_callees(tmp_path):
    code = """
helper = "def helper(x, y):\\n    return (x + y) - x\\n"
entry = "def entry(x, y):\\n    return helper(x, y)\\n"
made = instantiate(entry, signature="float32(float32, float32)", callees=(helper,), flags="fast")
print(json.dumps(made.call(np.float32(2.0**30), np.float32(1.0))))
"""
    assert fresh_process(code, tmp_path) == 1.0


def test_unknown_flags_are_told():
    with pytest.raises(RtbenchError, match=r"flags 'fastmath'.*did you mean 'fast'"):
        instantiate("def entry(x):\n    return x\n", signature="int64(int64)", flags="fastmath")
