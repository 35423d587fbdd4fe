"""What the methods that project along an axis share: the axes, and components along them."""


def dominant(vector):
    """Return the axis on which a vector is greatest in magnitude; of equals the first."""
    x, y, z = abs(vector[0]), abs(vector[1]), abs(vector[2])
    larger = y if y > x else x
    return 2 if z > larger else (1 if y > x else 0)


def axes(vector):
    """Return the dominant axis w of a vector and the two that follow it in a circle, u and v.

    Source
    ------
    Havel 2008, sections 3.4.1 and 4.2.5.
    """
    w = dominant(vector)
    return w, (w + 1) % 3, (w + 2) % 3


def along(vector, axis):
    """Return the component of a vector along an axis."""
    return vector[axis]
