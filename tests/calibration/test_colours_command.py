"""``rhot calibrate colours``: from boxes in pictures to a marker file that a node takes; wrong input in sentences."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from colour_scenes import PAINTS, box, picture, place

from rhot_app.__main__ import main
from rhot_app.calibration.kinds import colours
from rhot_node.commands.detect_command import detect_all
from rhot_node.detect.image import to_bgr
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

CUBE = Path(__file__).resolve().parents[3] / "shared" / "data" / "trifinger_cube"
FACES = {"yellow": (60, (240, 185, 30, 30)), "green": (60, (221, 215, 8, 20)), "cyan": (60, (255, 245, 30, 20)),
         "blue": (180, (215, 305, 30, 20)), "magenta": (300, (320, 255, 30, 30))}
CAMERAS = (60, 180, 300)


def sample(name: str, at: str | None = None) -> list[str]:
    x0, y0, x1, y1 = box(at or name)
    return ["--sample", f"{name}={x0},{y0},{x1 - x0},{y1 - y0}"]


@pytest.fixture
def shot(tmp_path: Path) -> Path:
    path = tmp_path / "hand.png"
    cv2.imwrite(str(path), to_bgr(picture()))
    return path


def calibrate(*arguments: str) -> int:
    return main(["calibrate", "colours", *arguments])


def test_the_file_finds_the_markers_in_another_picture(shot: Path, tmp_path: Path,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "markers.json"
    samples = [word for name in PAINTS for word in sample(name)]
    x, y = place("ring")
    assert calibrate("--image", str(shot), *samples, "--skin", f"{x - 5:.0f},{y + 30:.0f},10,20", "--out", str(out),
                     "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["written"] == str(out)
    assert [marker["id"] for marker in report["markers"]] == list(PAINTS)
    assert report["separability"]["columns"] == [*PAINTS, "skin", "room"]
    assert len(report["separability"]["percent"]) == 6
    assert min(marker["coverage_percent"] for marker in report["markers"]) >= 99.0
    assert report["grade"] == "good" and report["warnings"] == []

    other = tmp_path / "other.png"
    cv2.imwrite(str(other), to_bgr(picture(shift=(13.0, 20.0), light=0.9, seed=5)))
    (frame,) = detect_all(other, load_markers(out), "fast")["frames"]
    for entry in frame["markers"]:
        x, y = place(entry["id"], (13.0, 20.0))
        assert np.hypot(entry["x"] - x, entry["y"] - y) < 0.5


@pytest.mark.skipif(not CUBE.is_dir(), reason=f"real images are not there ({CUBE})")
def test_faces_of_a_real_cube_learnt_from_small_boxes_are_found_by_the_other_cameras(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "cube.json"
    images = [word for camera in CAMERAS for word in ("--image", str(CUBE / f"camera{camera}.png"))]
    samples = [word for name, (camera, where) in FACES.items() for word in (
        "--sample", f"{name}@{CAMERAS.index(camera) + 1}={','.join(map(str, where))}")]
    assert calibrate(*images, *samples, "--out", str(out)) == 0
    assert "Written" in capsys.readouterr().out
    seen = 0
    for camera in CAMERAS:
        (frame,) = detect_all(CUBE / f"camera{camera}.png", load_markers(out), "fast")["frames"]
        for entry in frame["markers"]:
            mask = CUBE / f"{entry['id'][0]}{camera}.png"
            if mask.exists():
                alpha = cv2.imread(str(mask), cv2.IMREAD_UNCHANGED)
                assert alpha is not None
                rows, columns = np.nonzero(alpha[:, :, 3] > 127)
                assert np.hypot(entry["x"] - columns.mean(), entry["y"] - rows.mean()) < 3.0, (camera, entry)
                seen += 1
    assert seen == 9


def test_a_second_picture_adds_samples_and_base_markers_keep_their_places(shot: Path, tmp_path: Path,
                                                                          capsys: pytest.CaptureFixture[str]) -> None:
    second, out = tmp_path / "second.png", tmp_path / "markers.json"
    cv2.imwrite(str(second), to_bgr(picture(light=0.8, seed=2)))
    x0, y0, x1, y1 = box("ring")
    base = resource_path("markers", "rhot6.json")
    assert calibrate("--image", str(shot), "--image", str(second), *sample("ring"), "--sample",
                     f"ring@2={x0},{y0},{x1 - x0},{y1 - y0}", "--markers", str(base), "--out", str(out), "--json") == 0
    (ring,) = json.loads(capsys.readouterr().out)["markers"]
    assert ring["pictures"] == 2 and ring["role"] == "ring_tip"
    assert load_markers(out).ids == load_markers(base).ids


def test_one_colour_under_two_names_is_not_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "same.png", tmp_path / "markers.json"
    cv2.imwrite(str(path), to_bgr(picture({"thumb": PAINTS["ring"], "index": PAINTS["ring"]})))
    assert calibrate("--image", str(path), *sample("thumb"), *sample("index"), "--out", str(out)) == 2
    assert "thumb and index overlap by" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(("arguments", "said"), [
    (["--sample", "ring=400,10,8,8"], "reaches outside"),
    (["--sample", "ring=-4,10,8,8"], "reaches outside"),
    (["--sample", "ring=10,10"], "is not NAME=x,y,w,h"),
    (["--sample", "ring=a,b,c,d"], "is not NAME=x,y,w,h"),
    (["--sample", "my ring=10,10,8,8"], "a marker's name has"),
    (["--sample", "ring=10,10,0,8"], "holds nothing"),
    (["--sample", "ring@3=10,10,8,8"], "asks for picture 3"),
    (["--sample", "ring@0=10,10,8,8"], "asks for picture 0"),
    (["--sample", "ring=2,2,2,2"], "at least 12"),
    (["--skin", "5,5,900,900", *sample("ring")], "reaches outside"),
    (["--sample", "ring=2,2,2,2"], "10 x 8 px of paint are enough"),
    ([*sample("ring"), *sample("ring", "little")], "ring: its boxes in one picture differ in hue by"),
    (["--markers", str(resource_path("markers", "rhot6.json")), *sample("toe", "ring")], "no marker 'toe'"),
])
def test_wrong_input_is_a_sentence(shot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                   arguments: list[str], said: str) -> None:
    out = tmp_path / "markers.json"
    assert calibrate("--image", str(shot), *arguments, "--out", str(out)) == 2
    captured = capsys.readouterr()
    assert said in captured.err and captured.out == ""
    assert not out.exists()


def test_small_boxes_of_a_marker_in_one_picture_add_up(shot: Path, tmp_path: Path,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    x, y = (round(at) for at in place("ring"))
    corners = [(x - 6, y - 3), (x + 2, y - 4), (x - 1, y + 2), (x + 1, y + 5)]
    words = [word for left, top in corners for word in ("--sample", f"ring={left},{top},4,4")]
    reports = []
    for samples in (words, sample("ring")):
        assert calibrate("--image", str(shot), *samples, "--out", str(tmp_path / "m.json"), "--json") == 0
        reports.append(json.loads(capsys.readouterr().out))
    (few,), (one,) = (report["markers"] for report in reports)
    assert few["pictures"] == one["pictures"] == 1 and few["samples"] >= 12
    assert few["area_px"] == pytest.approx(one["area_px"], rel=0.1)
    hues = [np.degrees(np.arctan2(marker["chroma"]["cr"], marker["chroma"]["cb"])) for marker in (few, one)]
    assert abs(hues[0] - hues[1]) < 3.0


@pytest.mark.parametrize("size", [(4, 4), (2, 2), (1, 1)])
def test_a_box_that_is_too_small_is_enlarged_to_the_paint_round_it_and_the_report_says_so(
        shot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], size: tuple[int, int]) -> None:
    x, y = (round(at) for at in place("ring"))
    box_of = f"ring={x + 1},{y + 1},{size[0]},{size[1]}"
    assert calibrate("--image", str(shot), "--sample", box_of, "--out", str(tmp_path / "m.json"), "--json") == 0
    report = json.loads(capsys.readouterr().out)
    (note,) = [finding for finding in report["findings"] if finding["code"] == "enlarged"]
    assert "12 colour pixels are needed" in note["figure"] and "ring in picture 1 from" in note["figure"]
    assert "10 x 8 px" in note["remedy"] and note["grade"] == "good"
    assert report["markers"][0]["samples"] >= 12


def test_paint_too_small_to_learn_from_is_explained_with_the_size_that_is_needed(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image = np.full((100, 100, 3), 120, np.uint8)
    image[40:44, 40:44] = (205, 165, 25)
    path, out = tmp_path / "small.png", tmp_path / "m.json"
    cv2.imwrite(str(path), image)
    assert calibrate("--image", str(path), "--sample", "ring=41,41,2,2", "--out", str(out)) == 2
    said = capsys.readouterr().err
    assert "ring: " in said and "at least 12 are needed" in said and "10 x 8 px" in said and not out.exists()


def test_a_damaged_picture_among_others_is_left_out_and_named_unless_a_box_is_in_it(
        shot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    damaged, out = tmp_path / "damaged.png", tmp_path / "markers.json"
    damaged.write_bytes(shot.read_bytes()[:2000])
    pictures = ["--image", str(shot), "--image", str(damaged)]
    assert calibrate(*pictures, *sample("ring"), *sample("thumb"), *sample("index"), "--out", str(out), "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert [str(damaged) in warning for warning in report["warnings"]].count(True) == 1
    assert len(load_markers(out).ids) == 3
    x0, y0, x1, y1 = box("ring")
    assert calibrate(*pictures, "--sample", f"ring@2={x0},{y0},{x1 - x0},{y1 - y0}", "--out", str(out)) == 2
    assert "is cut off or damaged" in capsys.readouterr().err


def test_a_picture_of_too_many_pixels_is_refused(shot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(colours, "PIXELS_MAX", 1000)
    assert calibrate("--image", str(shot), "--sample", "a=1,1,9,9", "--out", str(tmp_path / "m.json")) == 2
    assert "colours are learnt from pictures of at most" in capsys.readouterr().err
    assert not (tmp_path / "m.json").exists()


def test_a_box_on_skin_is_refused_as_a_marker(shot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    x, y = (round(at) for at in place("ring"))
    out, boxes = tmp_path / "markers.json", (f"index={x - 4},{y + 30},8,8", f"{x - 4},{y + 50},8,20")
    assert calibrate("--image", str(shot), "--sample", boxes[0], "--skin", boxes[1], "--out", str(out)) == 2
    assert "index and skin overlap by" in capsys.readouterr().err and not out.exists()


def test_one_picture_is_a_hint_and_no_verdict(shot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [word for name in PAINTS for word in sample(name)]
    assert calibrate("--image", str(shot), *words, "--out", str(tmp_path / "markers.json")) == 0
    said = capsys.readouterr().out
    assert said.startswith("Good: 6 colours") and "[good]" not in said
    assert said.count("learnt from one picture") == 1


@pytest.mark.parametrize("size", [30, 3])
def test_grey_paint_is_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str], size: int) -> None:
    path = tmp_path / "grey.png"
    cv2.imwrite(str(path), np.full((100, 100, 3), 120, np.uint8))
    assert calibrate("--image", str(path), "--sample", f"ring=10,10,{size},{size}", "--out",
                     str(tmp_path / "m.json")) == 2
    assert "almost grey" in capsys.readouterr().err


@pytest.mark.parametrize(("content", "said"), [(None, "no such file"), (b"no picture", "not a picture")])
def test_unreadable_pictures_and_missing_folders_are_sentences(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                                               content: bytes | None, said: str) -> None:
    path = tmp_path / "x.png"
    if content is not None:
        path.write_bytes(content)
    assert calibrate("--image", str(path), *sample("ring"), "--out", str(tmp_path / "m.json")) == 2
    assert said.split("|")[-1] in capsys.readouterr().err
    assert calibrate("--image", str(path), *sample("ring"), "--out", str(tmp_path / "none" / "m.json")) == 2
    assert "there is no folder" in capsys.readouterr().err
