import subprocess
import sys

import matplotlib
import pytest
from matplotlib.colors import to_rgb

from rtbench.errors import RtbenchError
from rtbench.report import plots
from rtbench.report.charts import style


def test_first_looks_differ_in_everything():
    found = list(style.looks([f"kernel{number}" for number in range(7)]).values())
    assert len({look.color for look in found}) == 7
    assert len({look.marker for look in found}) == 7


def test_sixteen_kernels_all_differ_even_without_colour():
    found = style.looks([f"kernel{number}" for number in range(16)]).values()
    assert len(set(found)) == 16
    assert len({(look.marker, look.dashes) for look in found}) == 16


def test_colours_stay_apart_for_colour_blind_eyes():
    """Machado, Oliveira & Fernandes 2009: deuteranopia and protanopia, full severity."""
    deuteranopia = [
        (0.367322, 0.860646, -0.227968),
        (0.280085, 0.672501, 0.047413),
        (-0.011820, 0.042940, 0.968881),
    ]
    protanopia = [
        (0.152286, 1.052583, -0.204868),
        (0.114503, 0.786281, 0.099216),
        (-0.003882, -0.048116, 1.051998),
    ]
    for matrix in (deuteranopia, protanopia):
        seen = [
            [sum(w * c for w, c in zip(row, to_rgb(color), strict=True)) for row in matrix]
            for color in style.OKABE_ITO
        ]
        for place, one in enumerate(seen):
            for other in seen[place + 1 :]:
                assert sum((a - b) ** 2 for a, b in zip(one, other, strict=True)) ** 0.5 > 0.12


@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
def test_the_same_bytes_twice(make, tmp_path, form):
    run = make("density", processes=2, rounds=2)
    first = plots.write(run, tmp_path / "first", [form])
    matplotlib.rcParams["font.size"] = 20  # the user's own settings change nothing
    try:
        second = plots.write(run, tmp_path / "second", [form])
    finally:
        matplotlib.rcdefaults()
    assert [path.name for path in first] == [f"density.{form}", f"drift.{form}"]
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(first, second, strict=True))


def test_files_are_what_their_suffix_says(make, tmp_path):
    paths = plots.write(make("density", processes=2, rounds=2), tmp_path, style.FORMATS)
    heads = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
    assert len(paths) == 6
    assert all(path.read_bytes().startswith(heads[path.suffix]) for path in paths)


def test_unknown_format(make, tmp_path):
    with pytest.raises(RtbenchError, match="plot format 'pgn'; did you mean 'png'"):
        plots.write(make("density", processes=1, rounds=1), tmp_path, ["pgn"])


def test_unwritable_folder(make, tmp_path):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with pytest.raises(RtbenchError, match="cannot write"):
        plots.write(make("density", processes=1, rounds=1), tmp_path / "file")


def test_neither_pyplot_nor_numba_is_imported():
    code = (
        "import sys, pkgutil, importlib, rtbench.report as r\n"
        "for m in pkgutil.walk_packages(r.__path__, 'rtbench.report.'):\n"
        "    importlib.import_module(m.name)\n"
        "assert 'matplotlib.figure' in sys.modules\n"
        "print([m for m in ('matplotlib.pyplot', 'numba') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_subtitle_breaks_at_semicolons():
    figure, _ = style.panels(1, 1, 2.2, 2)
    style.head(figure, "Title", "the first part of it; the second part of it; the third part")
    lines = figure.texts[1].get_text().split("\n")
    assert lines == ["the first part of it", "the second part of it", "the third part"]
