"""Cameras and detectors from other packages: the example of docs/plugins.md, and what broken ones do."""

from __future__ import annotations

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest
from node_process import Node, write_settings
from patience import eventually
from shipped_markers import LANDMARKS21, RHOT6

from rhot_node import detectors
from rhot_node.capture.camera import Frame
from rhot_node.capture.open import PluginCamera, open_camera
from rhot_node.clock import NodeClock
from rhot_node.config import CameraSettings, NodeSettings, load_settings
from rhot_node.detect.image import YuvImage
from rhot_node.detectors import DetectorChoice, PluginDetector, warm_up_image
from rhot_node.errors import CameraError
from rhot_node.files import resource_path
from rhot_node.markers import MarkerSet
from rhot_node.plugins import plugin_names
from rhot_node.wire.messages import MarkerFlag, NodeState

PAGE = (Path(__file__).parents[2] / "docs" / "plugins.md").read_text()
SETTINGS = CameraSettings(fps=200.0)

BROKEN = """
raise_now = None

class Camera:
    size = 640, 480
    def __init__(self, spec, settings, clock):
        if spec == "open":
            raise KeyError("no such lens")
        self.spec = spec
    def read(self, timeout_s):
        if self.spec == "nonsense":
            return "a picture"
        raise ZeroDivisionError("the shutter")
    def close(self):
        raise RuntimeError("stuck")

class Detector:
    def __init__(self, markers):
        self.count = len(markers.markers)
    def detect(self, image):
        return WHAT
    def reset(self):
        pass
"""


def install(folder: Path, module: str, code: str, entries: str) -> None:
    """Lay a package into a folder as pip would: its module, and a dist-info that lists its entry points."""
    info = folder / f"{module}-1.0.dist-info"
    info.mkdir(parents=True)
    (folder / f"{module}.py").write_text(code)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module.replace('_', '-')}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(entries)


@pytest.fixture
def example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The page's package on the path."""
    code = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)
    entries = re.findall(r'^\[project\.entry-points\."(.*?)"\]\n(\w+) = "(.*?)"', PAGE, re.MULTILINE)
    assert code is not None and len(entries) == 3
    listed = "".join(f"[{group}]\n{name} = {place}\n" for group, name, place in entries)
    install(tmp_path, "rhot_example", code[1], listed)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "rhot_example", raising=False)
    return tmp_path


@pytest.fixture
def broken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package whose plug-ins do everything wrong."""
    code = BROKEN
    entries = "[rhot.cameras]\nbad = rhot_broken:Camera\ngone = rhot_broken:Nothing\n[rhot.detectors]\n"
    for name, what in (("raises", "1 / 0"), ("few", "()"), ("strange", "[None] * self.count")):
        code += BROKEN[BROKEN.index("class Detector"):].replace("Detector", name).replace("WHAT", what)
        entries += f"{name} = rhot_broken:{name}\n"
    install(tmp_path / "broken", "rhot_broken", code, entries + "missing = rhot_nowhere:Detector\n")
    monkeypatch.syspath_prepend(str(tmp_path / "broken"))
    monkeypatch.delitem(sys.modules, "rhot_broken", raising=False)


def settings(detector: str) -> NodeSettings:
    """A node's settings with this detector."""
    return msgspec.structs.replace(load_settings(resource_path("nodes", "left.json")), detector=detector)


def test_the_example_camera_delivers(example: Path) -> None:
    assert plugin_names("rhot.cameras") == ("grey",)
    camera = open_camera("plug:grey:77", SETTINGS, NodeClock())
    assert isinstance(camera, PluginCamera) and camera.size == (640, 480)
    frame = camera.read(1.0)
    assert isinstance(frame, Frame) and frame.number == 1 and frame.image.y[5, 5] == 77
    assert camera.report() == {}
    camera.close()


@pytest.mark.parametrize(("spec", "sentence"), [
    ("plug:nothing", "there is no plug-in 'nothing' of the kind rhot.cameras; installed: bad, gone"),
    ("plug:gone", "the plug-in 'gone' of rhot-broken 1.0 cannot be loaded (AttributeError"),
    ("plug:bad:open", "the plug-in 'bad' of rhot-broken 1.0 could not open its camera (KeyError: 'no such lens')")])
def test_a_camera_that_cannot_be_opened_is_a_sentence(broken: None, spec: str, sentence: str) -> None:
    with pytest.raises(CameraError) as raised:
        open_camera(spec, SETTINGS, NodeClock())
    assert sentence in str(raised.value)


@pytest.mark.parametrize(("spec", "sentence"), [
    ("plug:bad", "failed over a frame (ZeroDivisionError: the shutter)"),
    ("plug:bad:nonsense", "something else than a frame of 640 x 480 px")])
def test_a_camera_that_fails_later_is_a_sentence(broken: None, spec: str, sentence: str) -> None:
    camera = open_camera(spec, SETTINGS, NodeClock())
    with pytest.raises(CameraError) as raised:
        camera.read(0.1)
    assert sentence in str(raised.value)
    camera.close()


@pytest.mark.parametrize(("markers", "count"), [(RHOT6, 6), (LANDMARKS21, 21)], ids=["markers", "landmarks"])
def test_the_example_detector_is_chosen_by_name(example: Path, markers: MarkerSet, count: int) -> None:
    choice = DetectorChoice(lambda settings: pytest.fail("not asked for"))
    detector = choice.make(msgspec.structs.replace(settings("plug:middle"), markers=markers))
    found = detector.detect(warm_up_image(RHOT6, (640, 480)))
    assert [(one.index, one.x, one.y) for one in found] == [(k, 320.0, 240.0) for k in range(count)]
    assert choice.troubles() == []


class Fallback:
    """Stands in for the fast detector."""

    def detect(self, image: YuvImage) -> tuple[()]:
        return ()

    def reset(self) -> None:
        pass


@pytest.mark.parametrize(("name", "sentence"), [
    ("nothing", "There is no plug-in 'nothing'"), ("missing", "cannot be loaded (ModuleNotFoundError")])
def test_a_detector_that_cannot_begin_gives_way(broken: None, name: str, sentence: str) -> None:
    choice = DetectorChoice(lambda settings: Fallback())
    assert isinstance(choice.make(settings(f"plug:{name}")), Fallback)
    (check,) = choice.troubles()
    assert sentence in check.text and check.text.endswith("The fast detector works in its place.")
    choice.make(settings("fast"))
    assert choice.troubles() == []


@pytest.mark.parametrize(("name", "sentence"), [
    ("raises", "ZeroDivisionError"), ("few", "not one of each marker"), ("strange", "else than MarkerObservation")])
def test_a_detector_that_fails_states_all_as_lost(broken: None, name: str, sentence: str) -> None:
    choice = DetectorChoice(lambda settings: Fallback())
    detector = choice.make(settings(f"plug:{name}"))
    assert isinstance(detector, PluginDetector)
    found = detector.detect(warm_up_image(settings("fast").markers, (64, 48)))
    assert len(found) == 6 and all(one.flags == MarkerFlag.LOST for one in found)
    assert sentence in choice.troubles()[0].text


HANGING = """
import time

class Hangs:
    def __init__(self, markers):
        self.count = len(markers.markers)
    def detect(self, image):
        time.sleep(3600)
    def reset(self):
        pass

class Exits(Hangs):
    def detect(self, image):
        raise SystemExit(0)

class Camera:
    def __init__(self, spec, settings, clock):
        self.size, self.spec = (settings.width, settings.height), spec
    def read(self, timeout_s):
        if self.spec == "hangs":
            time.sleep(3600)
        raise SystemExit(0)
    def close(self):
        pass
"""


@pytest.fixture
def hanging(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package whose plug-ins never come back, or end the program."""
    folder = tmp_path / "hanging"
    install(folder, "rhot_hanging", HANGING, "[rhot.detectors]\nhangs = rhot_hanging:Hangs\n"
            "exits = rhot_hanging:Exits\n[rhot.cameras]\nstubborn = rhot_hanging:Camera\n")
    monkeypatch.syspath_prepend(str(folder))
    return folder


def test_a_detector_that_hangs_is_given_up_and_another_one_takes_its_place(
        hanging: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(detectors, "DETECT_S", 0.05)
    choice = DetectorChoice(lambda settings: Fallback())
    detector = choice.make(settings("plug:hangs"))
    image = warm_up_image(settings("fast").markers, (64, 48))
    assert all(one.flags == MarkerFlag.LOST for one in detector.detect(image))
    assert detector.detect(image) == ()
    detector.reset()
    (check,) = choice.troubles()
    assert "'hangs'" in check.text and "hangs (no answer within" in check.text and "fast detector works" in check.text


def test_a_plug_in_that_exits_ends_nothing(hanging: Path) -> None:
    choice = DetectorChoice(lambda settings: Fallback())
    found = choice.make(settings("plug:exits")).detect(warm_up_image(settings("fast").markers, (64, 48)))
    assert len(found) == 6 and "SystemExit" in choice.troubles()[0].text
    with pytest.raises(CameraError, match="SystemExit"):
        open_camera("plug:stubborn:exits", SETTINGS, NodeClock()).read(0.1)


@pytest.mark.parametrize(("detector", "camera", "words"), [
    ("plug:hangs", "plug:grey:60", ("hangs", "fast detector works")),
    ("plug:exits", "plug:grey:60", ("SystemExit",)),
    ("fast", "plug:stubborn:hangs", ("reads the camera has not come round",)),
    ("fast", "plug:stubborn:exits", ("SystemExit",))])
def test_a_node_names_what_hangs_and_answers_on(example: Path, hanging: Path, tmp_path: Path, detector: str,
                                                camera: str, words: tuple[str, ...]) -> None:
    path = write_settings(tmp_path, detector=detector)
    environment = f"{example}{os.pathsep}{hanging}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", environment)
        node = Node(path, camera)
    try:
        node.start(7)

        def state() -> dict[str, Any]:
            return json.loads(node.ask(request="state")[0])

        eventually(lambda: all(word in json.dumps(state()) for word in words), told=state)
        if camera == "plug:grey:60":
            assert node.observations(3), "it goes on"
        else:
            node.wait_for(NodeState.FAULT, 7)
    finally:
        node.process.kill()
        node.end()


@pytest.mark.parametrize("detector", ["slow", "plug:", "plug:a b", ""])
def test_settings_name_a_detector_that_can_be(detector: str) -> None:
    document = msgspec.to_builtins(settings("fast")) | {"detector": detector}
    with pytest.raises(msgspec.ValidationError, match=r"may be \"fast\", \"reference\", .*\"plug:NAME\""):
        msgspec.convert(document, NodeSettings)


def test_a_node_runs_on_both(example: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(example))
    node = Node(write_settings(tmp_path, detector="plug:middle", camera=SETTINGS), "plug:grey:60")
    try:
        assert (node.ready["width"], node.ready["height"]) == (640, 480)
        node.start(7)
        (observations,) = node.observations(1)
        assert [(one.x, one.y) for one in observations.markers] == [(320.0, 240.0)] * 6
        assert json.loads(node.ask(request="state")[0])["detector"] == "plug:middle"
    finally:
        node.end()
