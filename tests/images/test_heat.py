"""Heat maps: the colours of viridis as published, one to one in a PNG."""

import numpy as np
import pytest
from PIL import Image

from rtbench.errors import RtbenchError
from rtbench.images.heat import heat_map
from rtbench.images.writing import write

# First, middle and last colour of viridis, as its authors list them.
FIRST, MIDDLE, LAST = (0x44, 0x01, 0x54), (0x21, 0x91, 0x8C), (0xFD, 0xE7, 0x25)


def png(tmp_path, pixels):
    write(tmp_path / "a.png", pixels)
    with Image.open(tmp_path / "a.png") as image:
        return [[tuple(pixel) for pixel in row] for row in np.asarray(image).tolist()]


def test_a_png_has_the_published_colours(tmp_path):
    values = np.array([[0, 50, 100], [np.nan, -5, np.inf]])
    found = png(tmp_path, heat_map(values))
    assert found[0][0] == FIRST and found[0][2] == LAST
    np.testing.assert_allclose(found[0][1], MIDDLE, atol=1)
    assert found[1] == [(153, 153, 153), FIRST, (153, 153, 153)]


def test_the_scale_can_be_given_and_two_maps_share_it(tmp_path):
    found = png(tmp_path, heat_map(np.array([[3, 10, 20, 40]]), least=10, most=20))
    assert found == [[FIRST, FIRST, LAST, LAST]]


@pytest.mark.parametrize("values", [np.zeros((2, 2)), np.full((2, 2), -3), np.full((1, 1), np.nan)])
def test_without_any_spread_there_is_a_map_still(tmp_path, values):
    expected = (153, 153, 153) if np.isnan(values).any() else FIRST
    assert {pixel for row in png(tmp_path, heat_map(values)) for pixel in row} == {expected}


def test_more_is_lighter_everywhere():
    light = heat_map(np.arange(256)[None]) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light[0]) > 0).all()


def test_what_is_no_map_is_refused():
    for values in (np.zeros(3), np.zeros((2, 2, 3)), np.zeros((0, 3))):
        with pytest.raises(RtbenchError, match="height, width"):
            heat_map(values)
    with pytest.raises(RtbenchError, match="scale from 5 to 5"):
        heat_map(np.zeros((2, 2)), least=5, most=5)
