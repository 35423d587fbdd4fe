"""Blocks deleted by hand and by machine; codes that differ in names alone, and ones that do not."""

import ast
import inspect
import itertools
import re
import textwrap

import numpy as np
import pytest

from rtbench.compiled.instantiate import instantiate, source_of
from rtbench.scenes import reading
from rtbench.scenes.model import Camera, Light, Material, Plane, Scene, Sphere, Triangles
from rtbench.tracer import specialising
from rtbench.tracer.canonical_code import canonical, first_difference
from rtbench.tracer.effects import EFFECTS
from rtbench.tracer.options import KINDS, Options
from rtbench.tracer.render import Renderer

GLASS = MIRROR = FOG = False  # stand-ins for the linter


def parsed(function):
    return ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]


def without(source, *names):
    """Return statements after the deletion of names."""
    text = "def f():\n" + textwrap.indent(textwrap.dedent(source).strip(), "    ")
    function = specialising.deleted(names)(ast.parse(text).body[0])
    return "\n".join(ast.unparse(each) for each in function.body)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("if GLASS:\n    bend()\nshade()", "shade()"),
        ("if GLASS:\n    bend()", "pass"),
        ("if not GLASS:\n    stop()\nshade()", "stop()\nshade()"),
        ("if GLASS:\n    bend()\nelse:\n    stop()", "stop()"),
        ("if GLASS:\n    bend()\nelif a:\n    b()", "if a:\n    b()"),
        ("if a:\n    b()\nelif GLASS:\n    bend()", "if a:\n    b()"),
        ("if GLASS and a > 1:\n    bend()", "pass"),
        ("if a > 1 and GLASS:\n    bend()\nb()", "b()"),
        ("if GLASS or a > 1:\n    b()", "if a > 1:\n    b()"),
        ("if not GLASS or a > 1:\n    b()", "b()"),
        ("if a and (not GLASS or b):\n    c()", "if a:\n    c()"),
        ("if a():\n    if GLASS:\n        bend()", "if a():\n    pass"),
        ("x = 1 if GLASS else 2", "x = 2"),
        ("x = 1 if not GLASS else 2", "x = 1"),
        ("for i in a:\n    if GLASS:\n        bend()", "for i in a:\n    pass"),
        ("while True:\n    if GLASS:\n        break\n    b()", "while True:\n    b()"),
        # What is asked may do something: it is asked still.
        ("if f() or not GLASS:\n    b()", "if f() or True:\n    b()"),
        # Other names, and other values, stay.
        ("if MIRROR:\n    b()\nx = False", "if MIRROR:\n    b()\nx = False"),
        ("if a == 1 and True:\n    b()", "if a == 1:\n    b()"),
        ("GLASS = 3", "GLASS = 3"),
    ],
)
def test_what_is_deleted(before, after):
    assert without(before, "GLASS") == after


def shade(a, b):
    found = a
    if GLASS and a > 0:
        found += 100
    if not GLASS or b > 1:
        found += 1
    if a > 1 and (MIRROR or b > a):
        found *= 2
    elif FOG:
        found = -1
    else:
        found += 3 if MIRROR else 7
    for i in range(a):
        if GLASS:
            return -100
        if i > b and not (MIRROR and FOG):
            found += i
    return found


@pytest.mark.parametrize("inside", list(itertools.product([False, True], repeat=3)))
def test_what_is_left_does_the_same(inside):
    told = dict(zip(("GLASS", "MIRROR", "FOG"), inside, strict=True))
    absent = [name for name, there in told.items() if not there]
    left = specialising.deleted(absent)(parsed(shade))
    assert not {node.id for node in ast.walk(left) if isinstance(node, ast.Name)} & set(absent)
    names = {name: there for name, there in told.items() if there}
    exec(compile(ast.Module([left], []), "<left>", "exec"), names)
    whole = dict(told)
    exec(compile(ast.Module([parsed(shade)], []), "<whole>", "exec"), whole)
    for a, b in itertools.product(range(5), repeat=2):
        assert names["shade"](a, b) == whole["shade"](a, b)


CODE = """; ModuleID = 'one'
source_filename = "one"

@.const.one = internal constant [4 x i8] c"one\\00"

; Function Attrs: nounwind
define i32 @"f<one>"(i32 %x, double %y) #0 {
entry:
  %.5 = icmp sgt i32 %x, 3
  br i1 %.5, label %then, label %else, !prof !1

then:                                             ; preds = %entry
  %.6 = add i32 %x, 1
  br label %end

else:                                             ; preds = %entry
  %.7 = mul i32 %x, %x
  br label %end

end:                                              ; preds = %then, %else
  %.8 = phi i32 [ %.6, %then ], [ %.7, %else ]
  ret i32 %.8
}

attributes #0 = { nounwind }
!1 = !{i32 1}
"""
# The same by hand: other names, blocks in another order, no name for the first.
SAME = """source_filename = "two"
@.const.two = internal constant [4 x i8] c"one\\00"
define i32 @g(i32 %0, double %1) #7 {
  %3 = icmp sgt i32 %0, 3
  br i1 %3, label %6, label %4, !prof !9

4:                                                ; preds = %2
  %5 = mul i32 %0, %0
  br label %8

8:                                                ; preds = %4, %6
  %9 = phi i32 [ %5, %4 ], [ %7, %6 ]
  ret i32 %9

6:                                                ; preds = %2
  %7 = add i32 %0, 1
  br label %8
}
"""


# Two sums of a loop, whose phis may stand either way.
LOOP = """define i32 @f(i32 %n) {
  br label %loop
loop:
  %a = phi i32 [ 0, %0 ], [ %a2, %loop ]
  %b = phi i32 [ 1, %0 ], [ %b2, %loop ]
  %a2 = add i32 %a, %n
  %b2 = mul i32 %b, %n
  %c = icmp slt i32 %a2, %b2
  br i1 %c, label %loop, label %end
end:
  ret i32 %b2
}
"""


def swapped(text, one, other):
    return text.replace(one, "?").replace(other, one).replace("?", other)


def test_the_order_of_a_block_s_phis_does_not_count_and_what_they_take_does():
    first, second = (line for line in LOOP.splitlines() if " = phi " in line)
    assert canonical(swapped(LOOP, first, second)) == canonical(LOOP)
    assert canonical(swapped(LOOP, "[ 0,", "[ 1,")) != canonical(LOOP)
    assert canonical(swapped(LOOP, "%a2, %loop", "%b2, %loop")) != canonical(LOOP)


def test_names_numbers_and_the_order_of_blocks_do_not_count():
    assert canonical(CODE) == canonical(SAME)
    assert first_difference(*map(canonical, (CODE, SAME))) == ""


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("icmp sgt", "icmp sge"),
        ("i32 %x, 3", "i32 %x, 4"),
        ("add i32 %x, 1", "add i32 1, %x"),
        ("label %then, label %else", "label %else, label %then"),
        ("[ %.6, %then ], [ %.7, %else ]", "[ %.7, %then ], [ %.6, %else ]"),
        ("[ %.6, %then ], [ %.7, %else ]", "[ 7, %then ], [ %.7, %else ]"),
        ("ret i32 %.8", "ret i32 %x"),
        ("mul i32 %x, %x", "mul nsw i32 %x, %x"),
        ("(i32 %x, double %y)", "(i32 %x, float %y)"),
        ('c"one\\00"', 'c"two\\00"'),
        ("  %.6 = add", "  %.9 = sub i32 %x, 1\n  %.6 = add"),
    ],
)
def test_all_else_counts(before, after):
    other = CODE.replace(before, after)
    assert other != CODE
    assert canonical(other) != canonical(CODE)


def bent(x):
    return math.sin(x) / 1.33  # noqa: F821 (of the generated module)


def entry(values):
    for i in range(values.shape[0]):
        if GLASS:
            values[i] = bent(values[i])
        if not GLASS or MIRROR:
            values[i] += 1.0


def made(glass, change=None):
    source = source_of(entry)
    if change is not None:
        source = ast.unparse(change(ast.parse(source).body[0]))
    return specialising.code_of(
        instantiate(
            source,
            signature="void(float64[::1])",
            callees=(source_of(bent),),
            constants={"GLASS": str(glass), "MIRROR": "False"},
            title="glass" if glass else "no glass",
        )
    )


def test_a_block_that_is_not_called_for_is_not_in_the_code():
    own, gone = made(False), made(False, specialising.deleted(["GLASS", "MIRROR"]))
    assert (own.functions, gone.functions) == (("entry",), ("entry",))
    assert own.canonical == gone.canonical and own.digest == gone.digest
    glass = made(True)
    assert glass.functions == ("bent", "entry")
    assert glass.canonical != own.canonical and glass.instructions > 0
    sine = r'@"?(llvm\.)?sin\b'
    assert re.search(sine, glass.text) and not re.search(sine, own.text)


def test_code_from_the_cache_is_that_of_the_first_time():
    made(True)
    instance = instantiate(
        source_of(entry),
        signature="void(float64[::1])",
        callees=(source_of(bent),),
        constants={"GLASS": "True", "MIRROR": "False"},
        title="glass",
    )
    kept = instance.path.with_suffix(".ll")
    before = kept.read_text()
    kept.unlink()
    again = specialising._compiled_aside(instance.path)
    assert again["entry"] is not instance.call
    specialising.code_of(instance)
    assert canonical(kept.read_text()) == canonical(before)


def small(*objects):
    camera = Camera(position=(0.0, 1.0, 6.0), target=(0.0, 0.0, 0.0), width=24, height=16)
    light = Light(position=(3.0, 5.0, 4.0))
    return Scene("small", camera, (light,), (Material(),), objects)


BALL = Sphere(center=(0.0, 0.0, 0.0), radius=1.0, material=0)


def test_a_tracer_s_own_code_is_that_of_sources_without_the_blocks():
    scene = small(BALL)  # one opaque sphere: no shadow can fall
    own, gone = Renderer(scene), specialising.Deleted(scene)
    assert own.instance.path != gone.instance.path
    one, other = specialising.code_of(own.instance), specialising.code_of(gone.instance)
    assert first_difference(one.canonical, other.canonical) == ""
    for code in (one, other):
        assert {"radiance", "lit"} <= set(code.functions)
        assert not {"refracted", "fresnel", "reflected", "in_the_way"} & set(code.functions)
    np.testing.assert_array_equal(own.render().pixels, gone.render().pixels)


@pytest.mark.full
def test_glass_is_there_only_where_it_is_called_for():
    with_glass = specialising.code_of(Renderer(reading.read("glass")).instance)
    assert {"refracted", "fresnel"} <= set(with_glass.functions)
    for name in reading.names():
        scene = reading.read(name)
        own, gone = Renderer(scene), specialising.Deleted(scene)
        one, other = specialising.code_of(own.instance), specialising.code_of(gone.instance)
        assert first_difference(one.canonical, other.canonical) == "", name
        assert ("refracted" in one.functions) == own.effects["refraction"], name


CORNERS = np.array([[[-1.0, -1.0, 0.5], [1.0, -1.0, 0.5], [0.0, 1.5, 0.5]]])
FLOOR = Plane(point=(0.0, -1.0, 0.0), normal=(0.0, 1.0, 0.0), material=0)


SHAPES = ("spheres", "cones", "discs", "planes")


@pytest.mark.full
@pytest.mark.parametrize(
    ("objects", "more"),
    [
        ((FLOOR,), {"kinds": KINDS}),  # a tree of nothing
        ((FLOOR, BALL), {"kinds": KINDS}),
        ((Triangles(corners=CORNERS, material=0),), {"kinds": SHAPES}),  # in blocks, as before
        (
            (Triangles(corners=CORNERS, material=0), FLOOR, BALL),
            {"kinds": KINDS, "force": tuple(EFFECTS)},
        ),
    ],
    ids=["plane", "shapes", "triangle", "all"],
)
@pytest.mark.parametrize("how", [("float32", "kd"), ("float64", "bvh")], ids=" ".join)
def test_kinds_that_are_forced_change_no_bit(objects, more, how):
    options = dict(zip(("precision", "structure"), how, strict=True))
    scene = small(*objects)
    own = Renderer(scene, Options(**options)).render()
    other = Renderer(scene, Options(**options, **more)).render()
    assert own.pixels.tobytes() == other.pixels.tobytes()
    assert own.rays == other.rays
    assert len({pixel.tobytes() for pixel in own.pixels.reshape(-1, 3)}) > 20
