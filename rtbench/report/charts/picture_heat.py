"""Heat maps of a rendered picture: a number a pixel as colours, with a bar and its unit."""

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from rtbench.errors import RtbenchError
from rtbench.report.charts import style

COLOURS = "viridis"  # perceptually uniform, dark to light in grey print too
MISSING = (0.6, 0.6, 0.6)  # no number: a grey that is not among the colours
_MOST = 99.5  # percentile that ends the scale: a few rays along a surface meet very many
_LONG_SIDE = 6.0  # inches


@style.styled
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
        From 0 to the value that 0.5 % of the pixels exceed; write it with `style.save`.

    Raises
    ------
    RtbenchError
        If values are no (H, W) array.
    """
    values = np.asarray(values, np.float64)
    if values.ndim != 2 or not values.size:
        raise RtbenchError(f"a heat map needs numbers (height, width), not {values.shape}")
    finite = values[np.isfinite(values)]
    most = max(float(np.percentile(finite, _MOST)), 1e-300) if finite.size else 1.0
    height, width = values.shape
    scale = _LONG_SIDE / max(height, width)
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
