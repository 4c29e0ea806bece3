"""``rhot-node detect``: what it prints for images, folders, recordings and videos, and what it says when it cannot."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from marker_rendering import Canvas, capsule, disc

from rhot_node.__main__ import main
from rhot_node.capture.yuv import YuvWriter
from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

MARKERS = resource_path("markers", "rhot6.json")
RGB = {marker.id: marker.display_rgb for marker in load_markers(MARKERS).markers}


def frame(x: float, hidden: bool = False) -> YuvImage:
    canvas = Canvas(160, 120).paint(disc(x, 60, 12), RGB["ring"], (x, 60), 15)
    if hidden:
        canvas.paint(capsule((x + 10, 10), (x + 10, 110), 10), (205, 160, 135), (x, 60), 70)
    return canvas.expose()


def detect(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict:
    assert main(["detect", *map(str, arguments), "--markers", str(MARKERS), "--json"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    report = json.loads(out)
    assert isinstance(report, dict)
    return report


def ring(entry: dict) -> dict:
    return next(marker for marker in entry["markers"] if marker["id"] == "ring")


def test_an_image(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "one.png"
    cv2.imwrite(str(path), to_bgr(frame(70)))
    report = detect(capsys, path)
    assert report["path"] == str(path)
    assert report["detector"] == "fast"
    [only] = report["frames"]
    assert (only["index"], only["file"], only["width"], only["height"]) == (0, "one.png", 160, 120)
    assert [marker["id"] for marker in only["markers"]] == list(RGB)
    assert ring(only)["x"] == pytest.approx(70, abs=0.2)
    assert ring(only)["size"] == pytest.approx(24, rel=0.03)
    assert ring(only)["flags"] == ["acquired"]
    thumb = only["markers"][0]
    assert (thumb["x"], thumb["y"], thumb["size"], thumb["quality"]) == (None, None, None, 0.0)
    assert thumb["flags"] == ["lost"]


def test_images_are_stills_unless_they_are_said_to_be_a_sequence(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number, image in enumerate([frame(70), frame(70), frame(70, hidden=True)]):
        cv2.imwrite(str(tmp_path / f"{number:03}.png"), to_bgr(image))
    (tmp_path / "notes.txt").write_text("not an image")
    stills = [ring(entry)["flags"] for entry in detect(capsys, tmp_path)["frames"]]
    assert stills == [["acquired"]] * 3
    sequence = [ring(entry)["flags"] for entry in detect(capsys, tmp_path, "--sequence")["frames"]]
    assert sequence == [["acquired"], [], ["partial"]]


def test_a_recording_is_a_sequence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with YuvWriter(tmp_path / "rec", 160, 120, 4_000_000, 48_000) as writer:
        for number in range(3):
            image = frame(50 + 10 * number)
            writer.append(number * 25_000_000, np.concatenate([image.y.ravel(), image.u.ravel(), image.v.ravel()]))
    frames = detect(capsys, tmp_path / "rec")["frames"]
    assert [entry["index"] for entry in frames] == [0, 1, 2]
    assert [round(ring(entry)["x"]) for entry in frames] == [50, 60, 70]
    assert ring(frames[2])["flags"] == []
    assert "file" not in frames[0]
    assert ring(detect(capsys, tmp_path / "rec", "--stills")["frames"][2])["flags"] == ["acquired"]


def test_a_video(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30, (160, 120))
    for number in range(4):
        writer.write(to_bgr(frame(50 + 10 * number)))
    writer.release()
    frames = detect(capsys, path)["frames"]
    assert [round(ring(entry)["x"]) for entry in frames] == [50, 60, 70, 80]


@pytest.mark.parametrize("detector", ["fast", "reference"])
def test_all_lists_every_blob_largest_first(tmp_path: Path, capsys: pytest.CaptureFixture[str], detector: str) -> None:
    canvas = Canvas(160, 120).paint(disc(40, 60, 9), RGB["ring"], (40, 60), 12)
    cv2.imwrite(str(tmp_path / "two.png"), to_bgr(canvas.paint(disc(110, 60, 14), RGB["ring"], (110, 60), 17).expose()))
    report = detect(capsys, tmp_path / "two.png", "--all", "--detector", detector)
    blobs = ring(report["frames"][0])["blobs"]
    assert report["detector"] == detector
    assert [blob["x"] for blob in blobs] == pytest.approx([110, 40], abs=1.0)
    assert blobs[0]["size"] > blobs[1]["size"]
    assert report["frames"][0]["markers"][0]["blobs"] == []


def test_the_table_is_for_people(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cv2.imwrite(str(tmp_path / "one.png"), to_bgr(frame(70)))
    assert main(["detect", str(tmp_path), "--markers", str(MARKERS), "--all"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.split()[1:2] == ["ring"] and "acquired" in line for line in lines)
    assert any("thumb" in line and "lost" in line for line in lines)


def _bad(tmp_path: Path) -> dict[str, Path]:
    (tmp_path / "empty").mkdir()
    (tmp_path / "broken.png").write_bytes(b"\x89PNG\r\n but no more")
    (tmp_path / "text.mp4").write_text("not a video")
    cv2.imwrite(str(tmp_path / "dot.png"), np.zeros((1, 1, 3), dtype=np.uint8))
    cv2.VideoWriter(str(tmp_path / "none.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 30, (160, 120)).release()
    with YuvWriter(tmp_path / "cut", 160, 120, 1, 1) as writer:
        writer.append(0, np.zeros(28800, dtype=np.uint8))
    (tmp_path / "cut" / "frames.i420").write_bytes(b"short")
    names = ("missing.png", "empty", "broken.png", "text.mp4", "dot.png", "none.avi", "cut")
    return {name: tmp_path / name for name in names}


@pytest.mark.parametrize("name", ["missing.png", "empty", "broken.png", "text.mp4", "dot.png", "none.avi", "cut"])
@pytest.mark.parametrize("form", [(), ("--json",)])
def test_what_cannot_be_read_is_named_and_nothing_printed(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, form: tuple[str, ...]) -> None:
    path = _bad(tmp_path)[name]
    assert main(["detect", str(path), "--markers", str(MARKERS), *form]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert name in captured.err
    assert "Traceback" not in captured.err


def test_a_bad_marker_file_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cv2.imwrite(str(tmp_path / "one.png"), to_bgr(frame(70)))
    for content in ("{", "{}", '{"format": "rhot-markers", "version": 1, "markers": []}'):
        (tmp_path / "bad.json").write_text(content)
        assert main(["detect", str(tmp_path / "one.png"), "--markers", str(tmp_path / "bad.json"), "--json"]) == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        assert "bad.json" in captured.err
