"""How surfaces of the Neutral File Format are shaded.

The format says what surfaces are, not how they are shaded. Here it is as POV-Ray 3.7 shades the
``.pov`` files that the SPD package writes of the same scenes, measured there on single surfaces:

- Highlight (Phong's) and mirror are white, Ks each.
- What shines through is T times the colour, and so is light on its way to other surfaces.
- The diffuse part is Kd (1 - T) times the colour: it is for what does not shine through.
- Nothing is ambient; lights do not fade with distance, and those without a colour are white,
  1 / sqrt(number of lights).

What the ``.pov`` files have beyond that no NFF file tells: an ambient part of 0.2 in balls (floor)
and of 0.1 in jacks, and highlights of 0.3 in gears (floor) and 0.4 in jacks where Ks is 0.6 and
0.7. POV-Ray also bends rays only where they enter: triangles that are objects of their own have no
inside to leave. Its 5 levels are the ray of the pixel and 4 generations.
"""

from __future__ import annotations

from rtbench.scenes.model import Material, check_colour, check_number


def material_of(numbers: list[float], name: str) -> Material:
    """Return the material of a fill.

    Parameters
    ----------
    numbers : list of 8 float
        r, g, b, Kd, Ks, Shine, T, index of refraction (0 means 1).
    name : str

    Raises
    ------
    SceneError
        ``color``, ``Kd``, ``Ks``, ``Shine``, ``T``, ``index``: not allowed.

    Source
    ------
    E. Haines, Neutral File Format 3.9, 1996.
    """
    *color, kd, ks, shine, through, index = numbers
    check_colour("color", color, 1.0)
    for key, value in (("Ks", ks), ("T", through)):
        check_number(key, value, 0.0, 1.0, "from 0 to 1")
    for key, value in (("Kd", kd), ("Shine", shine)):
        check_number(key, value, 0.0, 1e9, "0 to 1e9")
    return Material(
        diffuse=tuple(kd * (1.0 - through) * each for each in color),
        specular=(ks, ks, ks),
        exponent=shine,
        reflection=(ks, ks, ks),
        transmission=tuple(through * each for each in color),
        # What nothing shines through has none, whatever is written there.
        index=(index or 1.0) if through else 1.0,
        name=name,
    )
