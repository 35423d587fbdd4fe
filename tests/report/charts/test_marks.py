"""What charts say of their error bars is what they have."""

import pytest
from matplotlib.figure import Figure

from rtbench.report.charts import marks
from rtbench.report.charts.style import looks


@pytest.mark.parametrize(
    ("low", "said"), [(0.9, marks.INTERVAL_NOTE), (float("nan"), "no intervals")]
)
def test_intervals_are_named_where_any_is_drawn(low, said):
    first, second = Figure().subplots(1, 2)
    look = looks(["a"])["a"]
    marks.dot(first, 1.0, float("nan"), float("nan"), 0.0, look)
    marks.dot(second, 1.0, low, 2.0 - low, 0.0, look)
    assert marks.noted(first) == "no intervals"
    assert marks.noted(first, second) == said
