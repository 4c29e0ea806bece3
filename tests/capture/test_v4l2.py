"""The list of webcams, against a fake driver: no machine that runs the tests needs a camera."""

from __future__ import annotations

from pathlib import Path

from fake_v4l2 import CAPTURE, METADATA, Driver, FakeCamera

from rhot_node.capture.v4l2 import (
    Automatics,
    Control,
    Device,
    Mode,
    list_devices,
    look_at_device,
    read_automatics,
)


def listed(folder: Path, **cameras: FakeCamera) -> tuple[Device, ...]:
    return list_devices(folder, Driver(folder, cameras).ioctl)


def test_cameras_are_listed_by_number_with_their_modes(tmp_path: Path) -> None:
    first, second = listed(tmp_path, video10=FakeCamera("other"), video2=FakeCamera())
    assert (first.path, first.name, second.name) == (str(tmp_path / "video2"), "HD Webcam", "other")
    assert first.modes == (Mode(640, 480, 30.0), Mode(1280, 720, 30.0)), "each size at its highest rate"
    assert first.bus and not first.problem


def test_what_gives_no_pictures_is_no_camera(tmp_path: Path) -> None:
    (tmp_path / "video7").mkdir()
    assert listed(tmp_path, video1=FakeCamera(capabilities=METADATA)) == ()
    assert look_at_device(tmp_path / "video99") is None


def test_a_camera_that_another_program_holds_is_named(tmp_path: Path) -> None:
    device, = listed(tmp_path, video0=FakeCamera(held=True))
    assert "Another program" in device.problem and "fuser" in device.problem and device.modes


def test_the_mode_is_the_usual_one_or_the_nearest_that_is_not_slow(tmp_path: Path) -> None:
    def mode(*sizes: tuple[int, int, list[float]], steps: bool = False) -> Mode:
        camera = FakeCamera(capabilities=CAPTURE, formats=[list(sizes)], steps=steps)
        return listed(tmp_path, video0=camera)[0].mode
    assert mode((320, 240, [60.0]), (640, 480, [30.0]), (1920, 1080, [30.0])) == Mode(640, 480, 30.0)
    assert mode((320, 240, [30.0]), (640, 480, [5.0])) == Mode(320, 240, 30.0)
    assert mode((640, 480, [5.0])) == Mode(640, 480, 5.0), "a slow camera is better than none"
    assert mode((1920, 1080, [30.0]), steps=True) == Mode(640, 480, 30.0)
    assert mode() == Mode(640, 480, 30.0), "one that lists no modes is asked for the usual one"


def test_what_a_driver_says_of_its_automatic_modes(tmp_path: Path) -> None:
    def read(**controls: int) -> Automatics:
        ids = {"exposure": Control.EXPOSURE_AUTO, "time": Control.EXPOSURE_ABSOLUTE,
               "balance": Control.AUTO_WHITE_BALANCE}
        camera = FakeCamera(controls={ids[name]: value for name, value in controls.items()})
        return read_automatics(str(tmp_path / "video0"), Driver(tmp_path, {"video0": camera}).ioctl)
    assert read(exposure=3, time=666, balance=1) == Automatics(True, True, 66_600.0)
    assert read(exposure=1, balance=0) == Automatics(False, False, None)
    assert read() == Automatics() == read_automatics(str(tmp_path / "video9"))
