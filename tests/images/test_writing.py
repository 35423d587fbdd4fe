"""Files of pictures: their bytes by hand or by another reader; whole, or the old one stays."""

import errno
import os
import struct
import threading

import numpy as np
import pytest
from PIL import Image

from rtbench.errors import RtbenchError
from rtbench.images import writing
from rtbench.images.writing import require_writable, write

PIXELS = np.array([[[0.0, 0.5, 1.0], [0.25, 2.0, -1.0]], [[0.125, 0.75, 0.0625], [1.5, 3.0, 0.0]]])


def refused(path, pixels=PIXELS):
    with pytest.raises(RtbenchError) as problem:
        write(path, pixels)
    assert problem.value.exit_code == 2 and "\n" not in str(problem.value)
    return str(problem.value)


def test_a_png_is_read_back_by_another_program(tmp_path):
    assert write(tmp_path / "a.PNG", PIXELS, "a comment") == (0, 2)
    with Image.open(tmp_path / "a.PNG") as image:
        assert (image.mode, image.size) == ("RGB", (2, 2))
        # 255 * (1.055 x^(1/2.4) - 0.055) by a desk calculator; row 0 on top
        assert np.asarray(image).tolist() == [
            [[0, 188, 255], [137, 255, 0]],
            [[99, 225, 71], [255, 255, 0]],
        ]
        assert image.info["Software"] == "rtbench"
        assert image.info["Comment"] == "a comment"
        assert image.info["srgb"] == 0


def test_a_png_without_a_comment_has_none_and_any_letters_are_kept(tmp_path):
    write(tmp_path / "a.png", PIXELS)
    write(tmp_path / "b.png", PIXELS, "Šilhavý\0 → 2")
    with Image.open(tmp_path / "a.png") as a, Image.open(tmp_path / "b.png") as b:
        assert "Comment" not in a.info
        assert b.info["Comment"] == "Šilhavý  → 2"


def test_not_a_number_is_magenta_and_counted(tmp_path):
    pixels = PIXELS.copy()
    pixels[1, 1, 2] = np.nan
    pixels[0, 1] = np.inf
    assert write(tmp_path / "a.png", pixels) == (1, 1)
    with Image.open(tmp_path / "a.png") as image:
        assert np.asarray(image)[1].tolist() == [[99, 225, 71], [255, 0, 255]]
        assert image.getpixel((1, 0)) == (255, 255, 255)
    assert write(tmp_path / "a.pfm", pixels) == (1, 0)


def test_equal_pictures_give_equal_files(tmp_path):
    for name in ("a.png", "b.png"):
        write(tmp_path / name, PIXELS, "same")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_float_map_has_the_bytes_of_its_description(tmp_path):
    write(tmp_path / "a.pfm", PIXELS)
    bottom_first = [0.125, 0.75, 0.0625, 1.5, 3.0, 0.0, 0.0, 0.5, 1.0, 0.25, 2.0, -1.0]
    expected = b"PF\n2 2\n-1.0\n" + struct.pack("<12f", *bottom_first)
    assert (tmp_path / "a.pfm").read_bytes() == expected


def test_a_float_map_of_light_beyond_float32_is_infinite(tmp_path):
    write(tmp_path / "a.pfm", np.full((1, 1, 3), 1e300))
    assert struct.unpack("<3f", (tmp_path / "a.pfm").read_bytes()[-12:]) == (np.inf,) * 3


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_an_array_stays_as_it_is(tmp_path, precision):
    pixels = (PIXELS / 3).astype(precision)
    pixels[0, 0, 0] = np.nan
    write(tmp_path / "a.npy", pixels)
    found = np.load(tmp_path / "a.npy", allow_pickle=False)
    assert found.dtype == precision
    np.testing.assert_array_equal(found, pixels)


def test_what_cannot_be_written_is_said_in_one_line(tmp_path):
    said = refused(tmp_path / "a.pgn")
    assert "unknown suffix of a picture '.pgn'; did you mean '.png'?" in said
    assert "allowed: .npy, .pfm, .png" in said
    assert "suffix of a picture ''" in refused(tmp_path / "picture")
    assert "there is no folder" in refused(tmp_path / "nowhere" / "a.png")
    (tmp_path / "folder.png").mkdir()
    assert "it is a folder" in refused(tmp_path / "folder.png")
    for wrong in (
        np.zeros((2, 2)),
        np.zeros((2, 2, 4)),
        np.zeros((0, 2, 3)),
        np.zeros((2, 2, 3), int),
    ):
        assert "array of floats (height, width, 3)" in refused(tmp_path / "a.png", wrong)
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


def test_the_target_is_checked_before_anything_is_rendered(tmp_path):
    for name in ("a.pgn", "nowhere/a.png", "", "."):
        with pytest.raises(RtbenchError):
            require_writable(tmp_path / name)
    require_writable(tmp_path / "a.png")
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def old(tmp_path):
    """A picture that is there; at the end it must be the only file, and unchanged."""
    path = tmp_path / "a.png"
    write(path, PIXELS)
    before = path.read_bytes()
    yield path
    assert path.read_bytes() == before
    assert [one.name for one in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.parametrize("where", ["fsync", "replace"])
def test_out_of_disk_the_old_picture_stays(old, monkeypatch, where):
    def full(*arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(writing.os, where, full)
    assert refused(old, PIXELS / 2) == f"cannot write {old}: No space left on device"


@pytest.mark.parametrize("where", ["fsync", "replace"])
def test_stopped_the_old_picture_stays(old, monkeypatch, where):
    def stop(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(writing.os, where, stop)
    with pytest.raises(KeyboardInterrupt):
        write(old, PIXELS / 2)


def test_where_the_system_stops_a_file_half_way_the_old_picture_stays(old):
    """No stand-in: the system itself refuses the bytes beyond a limit."""
    resource = pytest.importorskip("resource")
    noise = np.random.default_rng(1).random((100, 100, 3))  # does not compress below the limit
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        said = refused(old, noise)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert said == f"cannot write {old}: {os.strerror(errno.EFBIG)}"


def test_in_a_closed_folder_the_old_picture_stays(old):
    if os.geteuid() == 0:
        pytest.skip("root may write into every folder")
    old.parent.chmod(0o500)
    try:
        assert "Permission denied" in refused(old, PIXELS / 2)
        with pytest.raises(RtbenchError, match="Permission denied"):
            require_writable(old)
    finally:
        old.parent.chmod(0o700)


def test_a_reader_beside_never_sees_half_a_picture(tmp_path):
    path = tmp_path / "a.pfm"
    sizes = {len(b"PF\n90 90\n-1.0\n") + 90 * 90 * 12}
    write(path, np.zeros((90, 90, 3)))
    seen, done = set(), threading.Event()

    def look():
        while not done.is_set():
            seen.add(len(path.read_bytes()))

    reader = threading.Thread(target=look)
    reader.start()
    for k in range(8):
        write(path, np.full((90, 90, 3), float(k)))
    done.set()
    reader.join()
    assert seen == sizes


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real").mkdir()
    write(tmp_path / "real" / "b.png", PIXELS)
    (tmp_path / "a.png").symlink_to(tmp_path / "real" / "b.png")
    write(tmp_path / "a.png", np.ones((1, 1, 3)))
    assert (tmp_path / "a.png").is_symlink()
    with Image.open(tmp_path / "real" / "b.png") as image:
        assert image.size == (1, 1)


def test_a_new_picture_can_be_read_by_whom_the_user_allows(tmp_path):
    mask = os.umask(0o027)
    try:
        write(tmp_path / "a.png", PIXELS)
    finally:
        os.umask(mask)
    assert (tmp_path / "a.png").stat().st_mode & 0o777 == 0o640
