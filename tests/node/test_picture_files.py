"""Pictures and videos of others: pixels as the sensor gave them, and nothing decoded that could fill the memory."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from rhot_node.capture.paced import VideoFile
from rhot_node.errors import PictureError
from rhot_node.pictures import PIXELS_MAX, Picture, decode_picture, open_video, read_picture

WIDTH, HEIGHT = 24, 16
IMAGE: Picture = np.random.default_rng(1).integers(0, 256, (HEIGHT, WIDTH, 3)).astype(np.uint8)


def exif(orientation: int) -> bytes:
    return b"II*\0" + struct.pack("<IHHHIHHI", 8, 1, 274, 3, 1, orientation, 0, 0)


def chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def jpeg(orientation: int = 1, size: tuple[int, int] = (WIDTH, HEIGHT)) -> bytes:
    data, about = cv2.imencode(".jpg", IMAGE)[1].tobytes(), b"Exif\0\0" + exif(orientation)
    data = data[:2] + b"\xff\xe1" + struct.pack(">H", len(about) + 2) + about + data[2:]
    at = data.index(b"\xff\xc0") + 5
    return data[:at] + struct.pack(">HH", *reversed(size)) + data[at + 4:]


def png(orientation: int = 1, size: tuple[int, int] = (WIDTH, HEIGHT)) -> bytes:
    data = cv2.imencode(".png", IMAGE)[1].tobytes()
    head = chunk(b"IHDR", struct.pack(">II", *size) + data[24:29])
    return data[:8] + head + chunk(b"eXIf", exif(orientation)) + data[33:]


def webp(orientation: int = 1, size: tuple[int, int] = (WIDTH, HEIGHT)) -> bytes:
    lossless = cv2.imencode(".webp", IMAGE, [cv2.IMWRITE_WEBP_QUALITY, 101])[1].tobytes()[12:]
    extended = b"VP8X" + struct.pack("<IB3x", 10, 8) + b"".join((n - 1).to_bytes(3, "little") for n in size)
    about = exif(orientation)
    data = b"WEBP" + extended + lossless + b"EXIF" + struct.pack("<I", len(about)) + about
    return b"RIFF" + struct.pack("<I", len(data)) + data


def tiff(orientation: int = 1, size: tuple[int, int] = (WIDTH, HEIGHT), order: str = "<", **more: int) -> bytes:
    pixels = IMAGE[..., ::-1].tobytes()
    tags = {256: size[0], 257: size[1], 258: 0, 259: 1, 262: 2, 273: 0, 274: orientation, 277: 3, 278: size[1],
            279: len(pixels)} | {int(name[1:]): value for name, value in more.items()}
    tags[258] = 8 + 2 + 12 * len(tags) + 4
    tags[273] = tags[258] + 6
    entries = [struct.pack(f"{order}HHII", tag, 4, 1, value) for tag, value in sorted(tags.items())]
    entries[sorted(tags).index(258)] = struct.pack(f"{order}HHII", 258, 3, 3, tags[258])
    entries[sorted(tags).index(274)] = struct.pack(f"{order}HHIHH", 274, 3, 1, orientation, 0)
    return ((b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}IH", 8, len(tags)) + b"".join(entries)
            + struct.pack(f"{order}IHHH", 0, 8, 8, 8) + pixels)


Make = Callable[..., bytes]
FORMATS = pytest.mark.parametrize("make", [jpeg, png, webp, tiff])


@FORMATS
@pytest.mark.parametrize("grey", [False, True])
def test_pixels_are_as_the_sensor_gave_them_whatever_the_orientation_says(make: Make, grey: bool) -> None:
    upright = decode_picture(make(1), grey=grey)
    assert upright.shape == ((HEIGHT, WIDTH) if grey else (HEIGHT, WIDTH, 3))
    for orientation in range(2, 9):
        assert (decode_picture(make(orientation), grey=grey) == upright).all()
    if make is not jpeg and not grey:
        assert (upright == IMAGE).all()


def test_a_tiff_of_either_byte_order_is_not_turned() -> None:
    assert (decode_picture(tiff(6, order=">")) == IMAGE).all()


@FORMATS
def test_a_picture_of_too_many_pixels_is_refused_before_it_is_decoded(make: Make,
                                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("decoded"))
    with pytest.raises(PictureError, match=r"30000 x 30000 px.*64 megapixels"):
        decode_picture(make(size=(30000, 30000)))


def test_the_simple_webp_formats_say_their_size_too() -> None:
    for quality in (80, 101):  # lossy, lossless
        data = bytearray(cv2.imencode(".webp", IMAGE, [cv2.IMWRITE_WEBP_QUALITY, quality])[1].tobytes())
        assert decode_picture(bytes(data)).shape == IMAGE.shape
        at = 26 if quality == 80 else 21
        data[at:at + 4] = struct.pack("<I", 0x3FFF3FFF if quality == 80 else 0x0FFFFFFF)
        with pytest.raises(PictureError, match=r"1638[34] x 1638[34] px"):
            decode_picture(bytes(data))


@pytest.mark.parametrize("more", [{"t322": 30000, "t323": 30000}, {"t278": 10**7}])
def test_a_small_tiff_of_large_tiles_is_refused(more: dict[str, int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("decoded"))
    with pytest.raises(PictureError, match="64 megapixels"):
        decode_picture(tiff(**more))


@pytest.mark.parametrize("data", [
    b"", b"text", b"GIF89a" + bytes(20), b"BM" + bytes(60), b"P6\n2 2\n255\n" + bytes(12),
    bytes.fromhex("0000000c6a5020200d0a870a") + bytes(80), bytes.fromhex("ff4fff51") + bytes(80),  # JPEG 2000
    b"\x76\x2f\x31\x01" + bytes(80), b"#?RADIANCE\n", b"\x59\xa6\x6a\x95" + bytes(60),
], ids=["empty", "text", "gif", "bmp", "ppm", "jp2", "j2k", "exr", "hdr", "sun"])
def test_only_four_formats_reach_a_decoder(data: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """CVE-2025-53644 is in OpenCV's decoder of JPEG 2000."""
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("decoded"))
    with pytest.raises(PictureError, match=r"is empty|PNG, JPEG, TIFF or WebP"):
        decode_picture(data)


@FORMATS
def test_what_is_cut_off_or_changed_is_a_picture_or_an_error(make: Make, capfd: pytest.CaptureFixture[str]) -> None:
    data, rng = make(6), np.random.default_rng(2)
    for length in range(0, len(data) - 1, 7):
        with pytest.raises(PictureError):
            decode_picture(data[:length])
    for _ in range(200):
        changed = bytearray(data)
        for place in rng.integers(0, min(len(data), 200), 4):
            changed[place] = rng.integers(256)
        try:
            picture = decode_picture(bytes(changed))
        except PictureError:
            continue
        assert picture.shape[0] * picture.shape[1] <= PIXELS_MAX
    assert "WARN" not in capfd.readouterr().err  # OpenCV's own account of it


def test_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"text")
    for path in (tmp_path / "a.png", tmp_path / "gone.png"):
        with pytest.raises(PictureError, match=path.name):
            read_picture(path)


def video(path: Path, turned: bool) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 10.0, (64, 48))
    for _ in range(3):
        writer.write(np.zeros((48, 64, 3), np.uint8))
    writer.release()
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 4 + 40  # the matrix of ISO/IEC 14496-12, 8.3.2
    if turned:
        data[at:at + 36] = struct.pack(">9i", 0, 1 << 16, 0, -1 << 16, 0, 0, 48 << 16, 0, 1 << 30)
    path.write_bytes(data)
    return path


def test_a_telephones_video_is_not_turned(tmp_path: Path) -> None:
    turned = video(tmp_path / "turned.mp4", True)
    assert cv2.VideoCapture(str(turned)).read()[1].shape == (64, 48, 3)  # what OpenCV makes of it by itself
    for path in (turned, video(tmp_path / "plain.mp4", False)):
        assert open_video(path).read()[1].shape == (48, 64, 3)
        source = VideoFile(path)
        assert source.advance() and source.image().shape == (48, 64, 3)


def test_a_picture_is_no_video(tmp_path: Path) -> None:
    """OpenCV would read it, and those of the next numbers, as a video."""
    (tmp_path / "a00.png").write_bytes(png())
    with pytest.raises(PictureError, match="is a picture, not a video"):
        open_video(tmp_path / "a00.png")


def test_a_video_of_too_many_pixels_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = video(tmp_path / "a.mp4", False)
    monkeypatch.setattr("rhot_node.pictures.PIXELS_MAX", 64 * 48 - 1)
    with pytest.raises(PictureError, match="64 x 48 px"):
        open_video(path)
