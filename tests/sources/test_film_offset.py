"""When films of one scene began: to half a frame by their sound, and by a flash; what does not show it is refused."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from rhot_app.__main__ import main
from rhot_app.sources.film_offset import filmed

FPS, SOUND_HZ = 30.0, 16_000
LATER_S = 1.3371  # of the second film, no whole number of frames

Array = NDArray[np.float64]


def speech(seconds: float, seed: int) -> Array:
    """Noise in bursts, as syllables are."""
    rng = np.random.default_rng(seed)
    knots = rng.gamma(0.6, 1.0, int(seconds * 12) + 2)
    loud = np.interp(np.arange(int(seconds * SOUND_HZ)) / SOUND_HZ, np.arange(len(knots)) / 12.0, knots)
    return 0.1 * loud * rng.normal(0.0, 1.0, len(loud))


def heard(sound: Array, begin_s: float, seconds: float, seed: int, noise: float = 0.01) -> Array:
    """What a microphone hears from a time on, with its own noise."""
    part = sound[round(begin_s * SOUND_HZ):round((begin_s + seconds) * SOUND_HZ)]
    return part + np.random.default_rng(seed).normal(0.0, noise, len(part))


def film_of(path: Path, sound: Array | None, seconds: float = 6.0, *, size: tuple[int, int] = (64, 48),
            rate: int = 30, **metadata: str) -> Path:
    """A film of grey pictures with AAC sound."""
    av = pytest.importorskip("av", reason="the extra `films` is not installed")
    with av.open(str(path), "w") as film:
        film.metadata.update(metadata)
        pictures = film.add_stream("mpeg4", rate=Fraction(rate))
        pictures.width, pictures.height, pictures.pix_fmt = *size, "yuv420p"
        voice = None if sound is None else film.add_stream("aac", rate=SOUND_HZ, layout="mono")
        for k in range(round(seconds * rate)):
            frame = av.VideoFrame.from_ndarray(np.full((*size[::-1], 3), 90, np.uint8), format="rgb24")
            frame.pts = k
            film.mux(pictures.encode(frame))
        film.mux(pictures.encode(None))
        if voice is not None and sound is not None:
            for k in range(0, len(sound) - 1023, 1024):
                block = av.AudioFrame.from_ndarray(sound[None, k:k + 1024].astype(np.float32), format="fltp",
                                                   layout="mono")
                block.sample_rate, block.pts = SOUND_HZ, k
                film.mux(voice.encode(block))
            film.mux(voice.encode(None))
    return path


def lit(path: Path, on_s: tuple[float, ...], begin_s: float, seconds: float = 4.0, noise: float = 0.5) -> Path:
    """A film of a scene in which a lamp goes on, or on and off, at these times of the scene; exposed all the time."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), FPS, (64, 48))
    rng = np.random.default_rng(round(1e3 * begin_s))
    for k in range(round(seconds * FPS)):
        opened, closed = begin_s + (k - 0.5) / FPS, begin_s + (k + 0.5) / FPS
        share = sum((-1) ** j * np.clip((closed - t) * FPS, 0.0, 1.0) for j, t in enumerate(on_s))
        level = 60.0 + 120.0 * share + rng.normal(0.0, noise)
        writer.write(np.clip(level + rng.normal(0.0, 2.0, (48, 64, 3)), 0, 255).astype(np.uint8))
        assert opened < closed
    writer.release()
    return path


def offset(capsys: pytest.CaptureFixture[str], *words: str) -> float:
    assert main(["offset", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)["offsets_s"]["b"]


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(["offset", *words]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    return told.err


def test_sound_says_when_a_film_began(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sound = speech(9.0, 1)
    a = film_of(tmp_path / "a.mp4", heard(sound, 0.0, 6.0, 2))
    b = film_of(tmp_path / "b.mp4", 0.3 * heard(sound, LATER_S, 6.0, 3))
    assert offset(capsys, str(a), str(b)) == pytest.approx(LATER_S, abs=0.5 / FPS)
    assert main(["offset", f"left={b}", f"right={a}"]) == 0
    words = capsys.readouterr().out.split()
    assert words[0] == "--offset-s" and float(words[1].removeprefix("right=")) == pytest.approx(-LATER_S, abs=0.5 / FPS)


def test_the_true_offset_lies_in_the_stated_interval(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With as much noise as speech the peak is lower and the interval wider."""
    sound, widths = speech(9.0, 1), []
    a = film_of(tmp_path / "a.mp4", heard(sound, 0.0, 6.0, 2))
    for noise in (0.01, 0.1):
        b = film_of(tmp_path / "b.mp4", heard(sound, LATER_S, 6.0, 3, noise))
        assert main(["offset", str(a), str(b), "--json"]) == 0
        said = json.loads(capsys.readouterr().out)
        assert abs(said["offsets_s"]["b"] - LATER_S) < 3.0 * said["offsets_std_s"]["b"] < 0.5 / FPS
        widths.append(said["offsets_std_s"]["b"])
    assert widths[1] > widths[0] > 0.0 and said["offsets_std_s"]["a"] == 0.0
    lamps = [lit(tmp_path / f"{name}.avi", (2.5,), begin) for name, begin in (("a", 0.0), ("b", LATER_S))]
    assert main(["offset", *map(str, lamps), "--by", "flash", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["offsets_std_s"]["b"] == pytest.approx(np.sqrt(2 / 12) / FPS)


def test_sound_that_says_nothing_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    films = {name: str(film_of(tmp_path / f"{name}.mp4", sound)) for name, sound in (
        ("a", heard(speech(6.0, 1), 0.0, 6.0, 2)), ("other", heard(speech(6.0, 7), 0.0, 6.0, 8)),
        ("silent", np.zeros(6 * SOUND_HZ)), ("mute", None), ("short", heard(speech(6.0, 1), 0.0, 1.0, 2)),
        ("ticks", np.tile(speech(0.5, 3), 12)), ("tocks", np.tile(speech(0.5, 3), 12)))}
    assert "not agree" in refused(capsys, films["a"], films["other"])
    assert "silent" in refused(capsys, films["a"], films["silent"])
    assert "no sound" in refused(capsys, films["a"], films["mute"])
    assert "less than" in refused(capsys, films["a"], films["short"])
    assert "repeats" in refused(capsys, films["ticks"], films["tocks"])


def test_a_playlist_is_no_film(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It would name other files and addresses."""
    film = film_of(tmp_path / "a.mp4", heard(speech(6.0, 1), 0.0, 6.0, 2))
    (tmp_path / "list.mp4").write_text(f"#EXTM3U\n#EXTINF:6,\n{film}\n#EXT-X-ENDLIST\n")
    assert "list.mp4" in refused(capsys, str(film), str(tmp_path / "list.mp4"))


@pytest.mark.parametrize("lamp_s", [(2.5, ), (2.517, ), (2.5, 2.62)], ids=["on", "between frames", "flash"])
def test_a_light_that_goes_on_says_when_a_film_began(tmp_path: Path, lamp_s: tuple[float, ...],
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    a, b = lit(tmp_path / "a.avi", lamp_s, 0.0), lit(tmp_path / "b.avi", lamp_s, LATER_S)
    assert offset(capsys, str(a), str(b), "--by", "flash") == pytest.approx(LATER_S, abs=0.5 / FPS)


def test_light_that_says_nothing_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    once = str(lit(tmp_path / "a.avi", (2.0,), 0.0))
    steady, twice = lit(tmp_path / "steady.avi", (), 0.0), lit(tmp_path / "twice.avi", (1.0, 1.5, 3.0), 0.0)
    assert "no light" in refused(capsys, once, str(steady), "--by", "flash")
    assert "more than once" in refused(capsys, once, str(twice), "--by", "flash")
    assert "frames" in refused(capsys, once, str(lit(tmp_path / "brief.avi", (0.1,), 0.0, 0.2)), "--by", "flash")
    (tmp_path / "text.avi").write_text("no film")
    assert "text.avi" in refused(capsys, once, str(tmp_path / "text.avi"), "--by", "flash")


def test_one_film_or_two_of_one_name_have_no_offset(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x").mkdir()
    films = [lit(tmp_path / name, (2.0,), 0.0, 0.5) for name in ("a.avi", "x/a.avi")]
    assert "two or more" in refused(capsys, str(films[0]))
    assert "two films" in refused(capsys, *map(str, films))


def test_a_film_says_when_it_was_taken_or_nothing(tmp_path: Path) -> None:
    dated = film_of(tmp_path / "dated.mp4", None, 0.2, creation_time="2024-05-01T12:00:03.000000Z")
    assert filmed(dated) == datetime(2024, 5, 1, 12, 0, 3, tzinfo=UTC)
    assert filmed(film_of(tmp_path / "plain.mp4", None, 0.2)) is None
    (tmp_path / "none.mp4").write_bytes(b"no film")
    assert filmed(tmp_path / "none.mp4") is None and filmed(tmp_path / "gone.mp4") is None
