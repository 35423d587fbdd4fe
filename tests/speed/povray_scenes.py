"""Scene files for POV-Ray and tachyon that mean what the NFF files mean; used by against_povray.py.

The SPD's writer put things into its ``.pov`` files that its ``.nff`` files do not have, and left
out others. Without changing what has to be traced, these functions make the two agree:

- ``ambient`` is 0, as NFF has none (balls' floor has 0.2, jacks 0.1).
- ``phong`` is Ks, as NFF has one coefficient for the mirror and the highlight.
- Each solid of glass is one union with one interior. In a loose triangle POV-Ray sees a solid of
  its own: rays bend where they enter the first one and go straight through all others.
- Lights have the colour 1 / sqrt(number of lights) also where one was left out.
- The camera is given with all digits: between small mirrors its sixth digit decides about pixels.
- max_trace_level counts primary rays as the first level, so it is the depth + 1.
"""

import math
import re

import numpy as np

DECLARED = re.compile(r"#declare (txt\d+) = texture \{.*?\} // texture[^\n]*\n", re.S)
USED = re.compile(r"texture \{ (txt\d+) \}")
LIGHT = re.compile(r"light_source \{\s*<([^>]*)> color [^}]*\} // light\n*", re.S)
NUMBER = r"(\d[\d.e+-]*)"


def picture(pov: str, nff: str, depth: int, threshold: float) -> str:
    """Return the POV-Ray scene to time and to look at."""
    settings = f"global_settings {{ max_trace_level {depth + 1} adc_bailout {threshold:.9g} }}\n"
    seen = with_lights(with_camera(pov, nff), nff)
    return settings + whole_glass(DECLARED.sub(plain_finish, seen))


def objects(pov: str, nff: str) -> str:
    """Return a POV-Ray scene in which each of the NFF file's objects has its number's colour.

    What is not hit is black. To be rendered with the option +Q0, which leaves all light out.
    """
    numbers = (number for number, parts in enumerate(parts_of(nff), start=1) for _ in range(parts))

    def coloured(match: re.Match) -> str:
        parts = ", ".join(f"{part}/255" for part in code(next(numbers)))
        return f"pigment {{ color rgb <{parts}> }}"

    text = USED.sub(coloured, DECLARED.sub("", with_camera(pov, nff)))
    if next(numbers, None) is not None:
        raise SystemExit("the .pov file has fewer objects than the .nff file")
    return text + "\nbackground { color rgb 0 }\n"


def code(number: int) -> tuple[int, int, int]:
    """Return the colour, in steps of 1/255, that stands for the number of an object from 1 on."""
    return number >> 16, number >> 8 & 255, number & 255


def for_tachyon(nff: str) -> str:
    """Return the NFF scene with the lights' colour written out, which tachyon takes for white."""
    shade = f" {1 / math.sqrt(len(lights_of(nff))):.9g}" * 3
    return re.sub(r"^(l +\S+ +\S+ +\S+) *$", lambda match: match[1] + shade, nff, flags=re.M)


def lights_of(nff: str) -> list[tuple[float, ...]]:
    """Return the positions of the lights of an NFF scene."""
    return [
        tuple(map(float, line.split()[1:4])) for line in nff.splitlines() if line.startswith("l ")
    ]


def parts_of(nff: str) -> list[int]:
    """Return, object by object, into how many POV-Ray objects the SPD's writer took it apart."""
    return [parts for _, _, parts in entities(nff)]


def entities(nff: str) -> list[tuple[int, str, int]]:
    """Return of each object the number of its fill, its kind, and of how many parts it is."""
    found, fill = [], 0
    for kind, number in re.findall(r"^(f|s|c|p|pp) +(\S+)", nff, flags=re.M):
        if kind == "f":
            fill += 1
        else:
            found.append((fill, kind, int(number) - 2 if kind in ("p", "pp") else 1))
    return found


def with_camera(pov: str, nff: str) -> str:
    """Write the camera with all digits."""
    said = {
        key: np.array(numbers.split(), float)
        for key, numbers in re.findall(r"^(from|at|up|angle) +(.*)$", nff, flags=re.M)
    }
    forward = said["at"] - said["from"]
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, said["up"])
    right *= 2 * math.tan(math.radians(said["angle"][0] / 2)) / np.linalg.norm(right)
    axes = {"location": said["from"], "direction": forward, "right": right}
    axes["up"] = np.cross(right, forward)
    told = " ".join(f"{key} <{', '.join(map(repr, map(float, to)))}>" for key, to in axes.items())
    return re.sub(r"camera \{.*?\} // camera", f"camera {{ {told} }}", pov, flags=re.S)


def with_lights(pov: str, nff: str) -> str:
    """Keep the lights that the NFF scene has, in the colour that they get by their number."""
    wanted = lights_of(nff)
    shade = 1 / math.sqrt(len(wanted))

    def kept(match: re.Match) -> str:
        place = tuple(map(float, match[1].split(",")))
        light = f"light_source {{ <{match[1]}> color rgb {shade:.9g} }}\n"
        return light if place in wanted else ""

    return LIGHT.sub(kept, pov)


def plain_finish(match: re.Match) -> str:
    """Give a declared texture NFF's finish."""
    text = re.sub(rf"ambient {NUMBER}", "ambient 0", match[0])
    mirror = re.search(rf"reflection {NUMBER}", text)
    if mirror:
        text = re.sub(rf"phong {NUMBER}", f"phong {mirror[1]}", text)
    return text


def whole_glass(pov: str) -> str:
    """Put the objects that share a texture with an index of refraction into one union."""
    made, at = [], 0
    declared = list(DECLARED.finditer(pov))
    ends = [match.start() for match in declared[1:]] + [len(pov)]
    for match, end in zip(declared, ends, strict=True):
        index = re.search(rf"refraction {NUMBER} ior {NUMBER}", match[0])
        made.append(pov[at : match.start()])
        at = match.start()
        if index:
            texture = match[0].replace(index[0], "")
            interior = f"interior {{ ior {index[2]} }}"
            made.append(f"{texture}union {{\n{pov[match.end() : end]}\n{interior} }}\n")
            at = end
    return "".join([*made, pov[at:]])
