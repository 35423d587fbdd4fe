"""Reading: files made by hand or by another program, and files that are none."""

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from rtbench.errors import RtbenchError
from rtbench.images.reading import read
from rtbench.images.writing import write

LEVELS = np.array([[[0, 10, 11], [128, 255, 64]]], np.uint8)
# (level / 255 / 12.92) to 10, ((level / 255 + 0.055) / 1.055)^2.4 beyond, by a desk calculator
LIGHT = [[[0, 0.003035270, 0.003346536], [0.215860500, 1, 0.051269458]]]


def refused(path):
    with pytest.raises(RtbenchError) as problem:
        read(path)
    assert problem.value.exit_code == 2 and "\n" not in str(problem.value)
    assert str(problem.value).startswith(f"cannot read {path}: ")
    return str(problem.value)


@pytest.mark.parametrize("suffix", ["png", "tga", "bmp", "ppm", "tif"])
def test_whole_numbers_are_read_by_the_curve(tmp_path, suffix):
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(LEVELS).save(path)
    found = read(path)
    assert (found.dtype, found.shape) == (np.float64, (1, 2, 3))
    np.testing.assert_allclose(found, LIGHT, rtol=1e-6)
    np.testing.assert_array_equal(read(path, "linear"), LEVELS / 255)


@pytest.mark.parametrize("mode", ["L", "LA", "P", "RGBA", "1"])
def test_grey_palettes_and_alpha(tmp_path, mode):
    colours = np.repeat(np.array([[[0], [255]]], np.uint8), 3, axis=2)
    image = Image.fromarray(colours).convert(mode)
    if mode in ("LA", "RGBA"):
        image.putalpha(7)
    image.save(tmp_path / "a.png")
    np.testing.assert_array_equal(read(tmp_path / "a.png"), colours / 255)


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(width, height, depth, colour_type, lines: bytes, interlaced=0, more=b"") -> bytes:
    header = struct.pack(">IIBBBBB", width, height, depth, colour_type, 0, 0, interlaced)
    half = zlib.compress(lines)
    parts = [half[: len(half) // 2], half[len(half) // 2 :]]  # pixels may come in several chunks
    body = b"".join(chunk(b"IDAT", part) for part in parts)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + more + body + chunk(b"IEND", b"")


def filtered(samples: np.ndarray) -> bytes:
    """The bytes of a PNG's rows by the five filters in turn, from the standard's definition."""
    height, _, channels = samples.shape
    rows = samples.astype(">u2").view(np.uint8).reshape(height, -1).astype(int)
    step, out = 2 * channels, b""
    for y in range(height):
        kind, line = y % 5, []
        for x in range(rows.shape[1]):
            a = rows[y, x - step] if x >= step else 0
            b = rows[y - 1, x] if y else 0
            c = rows[y - 1, x - step] if y and x >= step else 0
            p = a + b - c
            nearest = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            guess = (0, a, b, (a + b) // 2, nearest)[kind]
            line.append((rows[y, x] - guess) % 256)
        out += bytes([kind, *line])
    return out


@pytest.mark.parametrize(("colour_type", "channels"), [(0, 1), (2, 3), (4, 2), (6, 4)])
def test_all_16_bits_of_a_png_are_read_through_every_filter(tmp_path, colour_type, channels):
    samples = np.random.default_rng(channels).integers(0, 65536, (11, 7, channels))
    (tmp_path / "a.png").write_bytes(png(7, 11, 16, colour_type, filtered(samples)))
    colours = samples[:, :, :3] if channels > 2 else np.repeat(samples[:, :, :1], 3, axis=2)
    np.testing.assert_array_equal(read(tmp_path / "a.png", "linear"), colours / 65535)
    if channels > 2:  # another reader, which keeps the upper 8 bits
        with Image.open(tmp_path / "a.png") as image:
            np.testing.assert_array_equal(np.asarray(image), samples // 256)


def test_16_bits_of_grey_and_of_a_pixmap(tmp_path):
    levels = np.array([[0, 1, 257, 65535]], np.uint16)
    Image.fromarray(levels).save(tmp_path / "a.png")
    (tmp_path / "a.pgm").write_bytes(
        b"P5 # a comment\n4 1\n65535\n" + levels.astype(">u2").tobytes()
    )
    (tmp_path / "b.ppm").write_bytes(b"P6\n1 1\n1000\n" + struct.pack(">3H", 0, 500, 1000))
    for name in ("a.png", "a.pgm"):
        np.testing.assert_array_equal(read(tmp_path / name, "linear")[0, :, 1], levels[0] / 65535)
    np.testing.assert_array_equal(read(tmp_path / "b.ppm", "linear"), [[[0, 0.5, 1]]])


def test_a_png_that_tells_its_exponent_is_read_by_it(tmp_path):
    """gAMA holds 100000 times the exponent from light to numbers (PNG, 11.3.3.2)."""
    for name, gamma in (("linear", 100000), ("root", 50000), ("usual", 45455)):
        info = PngInfo()
        info.add(b"gAMA", struct.pack(">I", gamma))
        Image.fromarray(LEVELS).save(tmp_path / f"{name}.png", pnginfo=info)
    np.testing.assert_allclose(read(tmp_path / "linear.png"), LEVELS / 255, rtol=1e-12)
    np.testing.assert_allclose(read(tmp_path / "root.png"), (LEVELS / 255) ** 2, rtol=1e-12)
    np.testing.assert_allclose(read(tmp_path / "usual.png"), LIGHT, rtol=1e-6)


def test_float_maps_of_others(tmp_path):
    big = b"PF\n1 2\n1.0\n" + struct.pack(">6f", 4, 5, 6, 1, 2, 3)
    grey = b"Pf 2 1 -0.5\n" + struct.pack("<2f", 0.25, 8)
    (tmp_path / "big.pfm").write_bytes(big)
    (tmp_path / "grey.pfm").write_bytes(grey)
    np.testing.assert_array_equal(read(tmp_path / "big.pfm"), [[[1, 2, 3]], [[4, 5, 6]]])
    np.testing.assert_array_equal(read(tmp_path / "grey.pfm"), [[[0.25] * 3, [8] * 3]])


@pytest.mark.parametrize("suffix", ["npy", "pfm"])
def test_floats_come_back_to_the_last_bit(tmp_path, suffix):
    pixels = np.random.default_rng(2).normal(size=(5, 4, 3)).astype(np.float32)
    pixels[0, 0] = np.nan, np.inf, -0.0
    write(tmp_path / f"a.{suffix}", pixels)
    found = read(tmp_path / f"a.{suffix}")
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found.astype(np.float32).tobytes(), pixels.tobytes())


def test_our_own_png_comes_back_to_half_a_step(tmp_path):
    display = np.random.default_rng(3).random((20, 30, 3))
    light = np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)
    write(tmp_path / "a.png", light)
    found = read(tmp_path / "a.png")
    shown = np.where(found <= 0.0031308, 12.92 * found, 1.055 * found ** (1 / 2.4) - 0.055)
    assert np.abs(shown - display).max() <= 0.5 / 255 + 1e-9


def npy(array) -> bytes:
    out = io.BytesIO()
    np.save(out, array, allow_pickle=True)
    return out.getvalue()


HUGE = npy(np.zeros((1, 1, 3))).replace(b"(1, 1, 3), }      ", b"(99999,99999,99), }")
BOMB = png(20000, 20000, 16, 2, b"\0" * 99)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.png", b"", "not a picture"),
        ("a.png", b"no picture at all", "not a picture"),
        ("a.png", png(2, 2, 8, 2, b"\0" * 14)[:-30], "damaged"),
        ("a.png", png(2, 2, 16, 2, b"\0" * 25), "cut off: 25 of 26 bytes"),
        ("a.png", png(2, 2, 16, 2, b"\x05" * 26), "pixels are damaged"),
        ("a.png", png(2, 2, 16, 2, b"\0" * 26, interlaced=1), "interlaced"),
        ("a.png", png(2, 2, 16, 3, b"\0" * 26), "cannot read"),
        ("a.png", BOMB, "more than"),
        ("a.npy", b"\x93NUMPY", "not an array"),
        ("a.npy", b"", "not an array"),
        ("a.npy", npy(np.zeros((2, 2, 3)))[:-8], "not an array"),
        ("a.npy", npy(np.zeros((2, 2, 3), int)), "not an array of floats"),
        ("a.npy", npy(np.zeros(3)), "not an array of floats"),
        ("a.npy", npy(np.array([[{}]])), "not an array"),
        ("a.npy", npy(np.zeros((0, 2, 3))), "no pixels"),
        ("a.npy", HUGE, "cannot read"),
        ("a.pfm", b"PF\n2 2\n-1.0\n1234", "cut off: 4 of 48 bytes"),
        ("a.pfm", b"PF\n2 2\nminus\n1234", "header"),
        ("a.pfm", b"PF\n2 2\n1e1e1\n1234", "scale 1e1e1 is not a number"),
        ("a.pfm", b"PF\n0 2\n-1.0\n", "no pixels"),
        ("a.ppm", b"P6\n1 1\n70000\n123456", "greatest value 70000"),
        ("a.ppm", b"P6\n999999999 999999999\n255\n123", "cut off"),
        ("a.tga", b"\0" * 10, "not a picture"),
        ("a.exr", b"", "unknown suffix of a picture '.exr'"),
    ],
)
def test_what_is_no_picture_is_refused_in_one_line(tmp_path, name, data, said):
    (tmp_path / name).write_bytes(data)
    assert said in refused(tmp_path / name)


def test_files_that_are_not_there(tmp_path):
    assert "No such file" in refused(tmp_path / "a.png")
    (tmp_path / "b.png").mkdir()
    assert "Is a directory" in refused(tmp_path / "b.png")
    Image.fromarray(LEVELS).save(tmp_path / "c.png")
    with pytest.raises(RtbenchError, match="unknown meaning of numbers 'linaer'; did you mean"):
        read(tmp_path / "c.png", "linaer")


def test_a_png_damaged_anywhere_gives_a_picture_or_one_line(tmp_path):
    """No traceback, whatever byte is wrong: 8 and 16 bits, every fifth byte turned over."""
    samples = np.random.default_rng(5).integers(0, 65536, (5, 4, 3))
    out = io.BytesIO()
    Image.fromarray((samples // 256).astype(np.uint8)).save(out, "PNG")
    good = [out.getvalue(), png(4, 5, 16, 2, filtered(samples))]
    path, refusals = tmp_path / "a.png", 0
    for data in good:
        for place in range(0, len(data), 3):
            path.write_bytes(data[:place] + bytes([data[place] ^ 255]) + data[place + 1 :])
            try:
                assert read(path).shape[2] == 3
            except RtbenchError as problem:
                refusals += 1
                assert "\n" not in str(problem)
    assert refusals > 20
