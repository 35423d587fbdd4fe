"""Heat maps of pictures tell their unit and their numbers; grey is what has none."""

import numpy as np
import pytest
from PIL import Image

from rtbench.errors import RtbenchError
from rtbench.report.charts import style
from rtbench.report.charts.picture_heat import heat_figure


def test_the_figure_tells_its_unit_and_its_numbers(tmp_path):
    values = np.full((60, 80), 4.0)
    values[0, 0], values[5, 5] = 1000, np.nan
    figure = heat_figure(values, "traversal steps", "per ray", "balls", "float64")
    panel, bar = figure.axes
    assert bar.get_ylabel() == "traversal steps (per ray)"
    shown = panel.images[0]
    assert shown.get_clim() == (0, 4)  # one pixel of 4800 is beyond the scale
    assert shown.colorbar.extend == "max"
    words = " ".join(text.get_text() for text in figure.texts)
    assert "balls" in words and "80 x 60 pixels" in words and "float64" in words
    assert "greatest 1000" in words and "grey: 1 pixels without a number" in words
    (path,) = style.save(figure, tmp_path / "heat", ["png"])
    with Image.open(path) as image:
        assert image.size[0] > 400


@pytest.mark.parametrize("shape", [(1, 1), (3, 400), (400, 3)])
def test_figures_of_odd_shapes_are_drawn(tmp_path, shape):
    figure = heat_figure(np.zeros(shape), "steps", "")
    assert style.save(figure, tmp_path / "heat", ["png"])


@pytest.mark.parametrize("shape", [3, (2, 2, 3), (0, 3)])
def test_what_is_no_map_is_refused(shape):
    with pytest.raises(RtbenchError, match="height, width"):
        heat_figure(np.zeros(shape), "steps", "per ray")
