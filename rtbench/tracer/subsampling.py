"""Adaptive subsampling: where the corners of a cell look alike, what is between is interpolated.

The corners of a coarse grid are traced. A cell whose corners differ by more than the tolerance is
cut into halves along both axes and its new corners are traced, down to single pixels.

Source: Krupa 2006, as Blecha 2007, chapter 5 and appendix A.2, uses it.
"""

from __future__ import annotations

import numpy as np

from rtbench.tracer.camera import pixel

# Stand-ins for what each generated module puts at its top.
REAL = np.float64
INTERPOLATED = 9
CORNERS = 33  # along a side of a tile of 32 pixels


def corner(world, corners, known, left, upper, x, y):
    """Trace the pixel at a corner, unless it is known; x and y are counted from the tile's."""
    if known[y, x] == 0:
        known[y, x] = 1
        red, green, blue = pixel(world, left + x, upper + y)
        corners[y, x, 0], corners[y, x, 1], corners[y, x, 2] = red, green, blue


def spread_of(corners, x, y, end_x, end_y):
    """Return by how much the corners of a cell differ, of what a picture can show of them."""
    most = 0.0
    for channel in range(3):
        a = min(corners[y, x, channel], 1.0)
        b = min(corners[y, end_x, channel], 1.0)
        c = min(corners[end_y, x, channel], 1.0)
        d = min(corners[end_y, end_x, channel], 1.0)
        most = max(most, max(max(a, b), max(c, d)) - min(min(a, b), min(c, d)))
    return most


def fill(world, corners, known, image, left, upper, x, y, end_x, end_y, right, lower):
    """Write the pixels of a cell between its corners; those traced before stay as they are."""
    bilinear = world.settings[0].bilinear
    width, height = REAL(end_x - x), REAL(end_y - y)
    for j in range(y, min(end_y, lower - upper)):
        for i in range(x, min(end_x, right - left)):
            if known[j, i]:
                continue
            world.counts[INTERPOLATED] += 1
            s, t = REAL(i - x) / width, REAL(j - y) / height
            if not bilinear:
                s, t = 0.0 if s < 0.5 else 1.0, 0.0 if t < 0.5 else 1.0
            for channel in range(3):
                above = (1.0 - s) * corners[y, x, channel] + s * corners[y, end_x, channel]
                below = (1.0 - s) * corners[end_y, x, channel]
                below += s * corners[end_y, end_x, channel]
                image[upper + j, left + i, channel] = (1.0 - t) * above + t * below


def subsampled(world, corners, known, cells, image, left, upper, right, lower):
    """Render a tile; ``cells`` is room for those that wait."""
    settings = world.settings[0]
    for y in range(0, lower - upper, settings.grid_y):
        for x in range(0, right - left, settings.grid_x):
            cells[0, 0], cells[0, 1] = x, y
            cells[0, 2], cells[0, 3] = x + settings.grid_x, y + settings.grid_y
            top = 1
            while top > 0:
                top -= 1
                x0, y0, x1, y1 = cells[top, 0], cells[top, 1], cells[top, 2], cells[top, 3]
                if x0 >= right - left or y0 >= lower - upper:
                    continue
                corner(world, corners, known, left, upper, x0, y0)
                if x1 - x0 == 1 and y1 - y0 == 1:
                    continue
                for place in range(1, 4):
                    i = x1 if place & 1 else x0
                    j = y1 if place & 2 else y0
                    corner(world, corners, known, left, upper, i, j)
                if spread_of(corners, x0, y0, x1, y1) <= settings.tolerance:
                    fill(world, corners, known, image, left, upper, x0, y0, x1, y1, right, lower)
                    continue
                middle_x = (x0 + x1) >> 1 if x1 - x0 > 1 else x1
                middle_y = (y0 + y1) >> 1 if y1 - y0 > 1 else y1
                for place in range(4):
                    begin_x = middle_x if place & 1 else x0
                    begin_y = middle_y if place & 2 else y0
                    end_x = x1 if place & 1 else middle_x
                    end_y = y1 if place & 2 else middle_y
                    if begin_x < end_x and begin_y < end_y:
                        cells[top, 0], cells[top, 1] = begin_x, begin_y
                        cells[top, 2], cells[top, 3] = end_x, end_y
                        top += 1
    for y in range(lower - upper):
        for x in range(right - left):
            if known[y, x]:
                for channel in range(3):
                    image[upper + y, left + x, channel] = corners[y, x, channel]


CALLEES = (corner, spread_of, fill, subsampled)
NUMBERS = {"INTERPOLATED": INTERPOLATED, "CORNERS": CORNERS}
