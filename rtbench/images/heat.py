"""Heat maps: a number a pixel as colours, bare or as a figure with a bar and its unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rtbench.errors import RtbenchError
from rtbench.images.colour import to_linear

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = "viridis"  # perceptually uniform, dark to light in grey print too
MISSING = (0.6, 0.6, 0.6)  # no number: a grey that is not among the colours
_MOST = 99.5  # percentile that ends a figure's scale: a few rays along a surface meet very many
_LONG_SIDE = 6.0  # inches


def heat_map(values: np.ndarray, least: float = 0.0, most: float | None = None) -> np.ndarray:
    """Return numbers as a picture, dark for few and light for many.

    Parameters
    ----------
    values : (H, W) array
        A number a pixel, row 0 on top. Where it is not finite the picture is grey.
    least, most : float
        What is darkest and lightest; beyond them colours stay. By default the scale begins at 0
        and ends at the greatest value.

    Returns
    -------
    (H, W, 3) array of float64
        Linear light: a PNG of it has the colours of the table, to be read by eyes or programs.

    Raises
    ------
    RtbenchError
        If values are no (H, W) array, or most is not above least.

    Source
    ------
    The table is matplotlib's viridis (S. van der Walt, N. Smith 2015).
    """
    from matplotlib import colormaps

    values = _checked(values)
    finite = np.isfinite(values)
    if most is None:
        most = float(values[finite].max()) if finite.any() else least
        most = most if most > least else least + 1  # all are least: all are dark
    if not most > least:
        raise RtbenchError(f"a scale from {least:g} to {most:g} is not allowed: it has no width")
    scaled = (np.where(finite, values, least) - least) / (most - least)
    colours = colormaps[COLOURS](np.clip(scaled, 0, 1))[:, :, :3]
    return to_linear(np.where(finite[:, :, None], colours, MISSING))


def heat_figure(
    values: np.ndarray, what: str, unit: str, title: str = "", remark: str = ""
) -> Figure:
    """Return numbers as a figure with a colour bar.

    Parameters
    ----------
    values : (H, W) array
        A number a pixel, row 0 on top; grey where it is not finite.
    what, unit : str
        What the bar says: ``steps``, ``per ray``.
    title : str
        Above the figure; by default what is shown.
    remark : str
        Joins the line below the title.

    Returns
    -------
    Figure
        From 0 to the value that 0.5 % of the pixels exceed; write it with
        `rtbench.report.charts.style.save`.

    Raises
    ------
    RtbenchError
        If values are no (H, W) array.
    """
    from matplotlib import colormaps
    from matplotlib.colors import Normalize

    from rtbench.report.charts import style

    values = _checked(values)
    finite = values[np.isfinite(values)]
    most = max(float(np.percentile(finite, _MOST)), 1e-300) if finite.size else 1.0
    height, width = values.shape
    scale = _LONG_SIDE / max(height, width)

    @style.styled
    def draw() -> Figure:
        figure, [[panel]] = style.panels(1, 1, max(width * scale, 1.5) + 1.1, height * scale + 0.2)
        shown = panel.imshow(
            np.ma.masked_invalid(values),
            cmap=colormaps[COLOURS].with_extremes(bad=MISSING),
            norm=Normalize(0, most),
            interpolation="nearest",
            rasterized=True,
        )
        panel.set_xticks([])
        panel.set_yticks([])
        for side in panel.spines.values():
            side.set_visible(False)
        over = finite.size and finite.max() > most
        bar = figure.colorbar(shown, ax=panel, extend="max" if over else "neither", pad=0.02)
        bar.set_label(f"{what} ({unit})" if unit else what)
        bar.outline.set_linewidth(0.5)
        told = [f"{width} x {height} pixels"]
        if finite.size:
            told += [f"mean {finite.mean():.3g}", f"greatest {finite.max():.6g}"]
        if finite.size < values.size:
            told.append(f"grey: {values.size - finite.size:,} pixels without a number")
        style.head(figure, title or what, "; ".join([*told, *([remark] if remark else [])]))
        return figure

    return draw()


def _checked(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, np.float64)
    if values.ndim != 2 or not values.size:
        raise RtbenchError(f"a heat map needs numbers (height, width), not {values.shape}")
    return values
