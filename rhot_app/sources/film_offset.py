"""When films of one scene began, by what all of them heard or saw: sound, or a flash of light.

Sound: how the loudness of both films changes from millisecond to millisecond is compared at every lag (normalised
cross-correlation). Light: the largest rise of brightness of each film, to a part of a frame by those that it takes.
Either must stand out from chance, and from every other place, or it is refused.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import NormalDist
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import RecordingError
from rhot_app.progress import Progress, silent
from rhot_app.sources.frame_sets import FPS
from rhot_node.errors import PictureError
from rhot_node.files import require_file
from rhot_node.pictures import open_video

Array = NDArray[np.float64]

ENVELOPE_HZ: Final = 1000
"""Samples of loudness a second: ten times finer than half a frame of a fast camera."""

LONGEST_S: Final = 3600.0
"""Of a film that is listened to, or looked at."""

CHANCE: Final = 1e-6
"""Probability that a peak which is called one is chance, over all lags or frames."""

RIVAL: Final = 0.8
"""Of the peak's height: a second peak as high as that makes the answer one of two, as in a song's beat."""

_SAMPLE: Final = 12.0**-0.5  # SD of a number that is rounded to one
_TINY: Final = float(np.finfo(np.float64).tiny)
_SOUND_HZ: Final = 8000
_SMOOTH: Final = 11  # ms, the loudness is smoothed over: a clap rises as fast
_FLOOR: Final = 1e-3  # of the mean power: what is softer than that is silence
_OVERLAP_S: Final = 2.0  # of both films, the least that is compared
_PEAK_S: Final = 0.1  # a clap and its echo: nearer peaks are the same one
_DEMUXERS: Final = "mov,matroska,avi,mpegts,mpeg"  # no playlists, which name other files


@dataclass(frozen=True, slots=True)
class FilmOffset:
    """What to add to a film's times, s, and its standard deviation."""

    seconds: float
    std_s: float


def offset_by_sound(first: Path, second: Path) -> FilmOffset:
    """What to add to the second film's times, so that both heard the same at the same time.

    The agreement of two series at a lag has unit variance, and is as wide as the sound's own correlation. So a peak of
    height M and curvature c has its place known to 1 / sqrt(M c). What sound travels farther to one microphone, 3 ms a
    metre, is not in it. Raises RecordingError: no sound, too little of it at the same time, or no lag at which both
    agree.
    """
    (start, heard), (other_start, other) = (_envelope(path) for path in (first, second))
    least = round(_OVERLAP_S * ENVELOPE_HZ)
    if min(len(heard), len(other)) < least:
        short = first if len(heard) < len(other) else second
        raise RecordingError(f"{short}: it has less than {_OVERLAP_S:g} s of sound. Give the offset by hand.")
    lags, match = correlate(heard, other, least)
    best = int(np.argmax(match))
    needed = NormalDist().inv_cdf(1.0 - CHANCE / len(match))
    both = f"{first.name} and {second.name}"
    if match[best] < needed:
        raise RecordingError(f"The sound of {both} does not agree at any time (at best {match[best]:.1f} standard "
                             f"deviations, {needed:.1f} are needed). Did they hear the same? Clap once next time, or "
                             "give the offset by hand.")
    rivals = match[np.abs(lags - lags[best]) > _PEAK_S * ENVELOPE_HZ]
    if rivals.max(initial=0.0) > RIVAL * match[best]:
        raise RecordingError(f"The sound of {both} agrees at more than one time: it repeats itself. Clap once next "
                             "time, or give the offset by hand.")
    vertex, bend = _vertex(match, best)
    return FilmOffset(start - other_start + (lags[best] + vertex) / ENVELOPE_HZ,
                      math.hypot(1.0 / math.sqrt(match[best] * bend), _SAMPLE) / ENVELOPE_HZ)


def correlate(first: Array, second: Array, least: int) -> tuple[Array, Array]:
    """(lags (K,), agreement (K,)) of two series, `second` moved later by each lag, where they overlap by `least`
    samples: their correlation in units of its standard deviation, if they had nothing in common. That allows for how
    each resembles its own past (Bartlett 1946)."""
    lags = np.arange(least - len(second), len(first) - least + 1)
    size = 1 << (len(first) + len(second)).bit_length()

    def moved(a: Array, b: Array) -> Array:
        return np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)

    ones = np.ones(len(first)), np.ones(len(second))
    shared = np.rint(moved(*ones)[lags])
    power = moved(first**2, ones[1])[lags], moved(ones[0], second**2)[lags]
    floor = 1e-9 * max(float(np.max(one)) for one in power) + _TINY
    match = moved(first, second)[lags] / np.sqrt(np.maximum(power[0], floor) * np.maximum(power[1], floor))
    own = [one[:least] / max(one[0], _TINY) for one in (moved(first, first), moved(second, second))]
    inflation = max(1.0, float(1.0 + 2.0 * np.sum(own[0][1:] * own[1][1:])))
    return lags.astype(np.float64), match * np.sqrt(shared / inflation)


def _vertex(values: Array, peak: int) -> tuple[float, float]:
    """Where between samples the parabola through a peak and its neighbours is highest, and how curved it is, per sample
    squared."""
    place = min(max(peak, 1), len(values) - 2)
    before, here, after = values[place - 1:place + 2]
    bend = float(2.0 * here - before - after)
    if place != peak or bend <= 0.0:
        return 0.0, 1e-6  # at the end of all lags: known to a second
    return 0.5 * float(after - before) / bend, bend


def _envelope(path: Path) -> tuple[float, Array]:
    """(start s after the film's first frame, (N,) change of loudness from millisecond to millisecond, mean 0)."""
    samples, start = _sound(path)
    per = _SOUND_HZ // ENVELOPE_HZ
    power = np.square(samples[:len(samples) // per * per].reshape(-1, per)).mean(axis=1)
    if not power.max(initial=0.0) > 0.0:
        raise RecordingError(f"{path}: its sound is silent. Give the offset by hand, or by a flash.")
    smooth = np.convolve(power, np.hanning(_SMOOTH + 2)[1:-1], "same")
    change = np.diff(np.log(smooth + _FLOOR * smooth.mean()))
    return start, change - change.mean()


def _sound(path: Path) -> tuple[Array, float]:
    """((N,) samples at `_SOUND_HZ` of all channels together, their start s after the first frame). Raises
    RecordingError: no sound, or the package that reads it is missing."""
    try:
        import av
    except ImportError as exc:
        raise RecordingError("The package av, which reads the sound of films, is missing. Install it: pip install "
                             "'rhot[films]'.") from exc
    try:
        require_file(path)
        with av.open(str(path), options={"format_whitelist": _DEMUXERS}) as film:
            if not film.streams.audio:
                raise RecordingError(f"{path}: this film has no sound. Give the offset by hand, or by a flash.")
            return _decoded(film, av)
    except (OSError, ValueError) as exc:  # av's errors are both
        raise RecordingError(f"{path}: its sound cannot be read ({getattr(exc, 'strerror', None) or exc}). Is "
                             "it a film, and complete?") from exc


def _decoded(film: Any, av: Any) -> tuple[Array, float]:
    resampler = av.AudioResampler(format="flt", layout="mono", rate=_SOUND_HZ)
    parts: list[NDArray[np.float32]] = []
    begin: float | None = None
    for frame in film.decode(audio=0):
        begin = float(frame.time or 0.0) if begin is None else begin
        parts += [part.to_ndarray().ravel() for part in resampler.resample(frame)]
        if frame.time is not None and frame.time - begin > LONGEST_S:
            break
    with contextlib.suppress(av.error.FFmpegError):
        parts += [part.to_ndarray().ravel() for part in resampler.resample(None)]
    pictures = film.streams.video
    first = float(pictures[0].start_time * pictures[0].time_base) if pictures and pictures[0].start_time else 0.0
    return np.nan_to_num(np.concatenate([*parts, np.zeros(0, np.float32)]).astype(np.float64)), (begin or 0.0) - first


def filmed(path: Path) -> datetime | None:
    """When a film began, as its file says (`creation_time`, mostly to a second); None where it does not, and where the
    package av, which reads that, is missing."""
    try:
        import av
    except ImportError:
        return None
    try:
        require_file(path)
        with av.open(str(path), options={"format_whitelist": _DEMUXERS}) as film:
            found = datetime.fromisoformat(film.metadata.get("creation_time", ""))
    except (OSError, ValueError):  # av's errors are both
        return None
    return found if found.tzinfo else found.replace(tzinfo=UTC)


# -- light -------------------------------------------------------------------------------------------------------------

def flash_s(path: Path, progress: Progress = silent) -> FilmOffset:
    """When a light goes on in a film, s after its first frame. The standard deviation is that of a time between two
    frames: how long a frame is exposed is not known. Raises RecordingError."""
    levels, fps = _brightness(path, progress)
    rise = np.diff(levels)
    if len(rise) < 10:
        raise RecordingError(f"{path}: {len(levels)} frames are too few to tell a flash.")
    best = int(np.argmax(rise))
    near = np.abs(np.arange(len(rise)) - best) <= 2  # a light goes on within a frame or two
    noise = 1.4826 * float(np.median(np.abs(rise - np.median(rise))))
    needed = NormalDist().inv_cdf(1.0 - CHANCE / len(rise)) * max(noise, 1.0 / np.iinfo(np.uint8).max)
    if rise[best] < needed:
        raise RecordingError(f"{path}: no light goes on in it: its largest rise of brightness is {rise[best]:.2f} of "
                             f"255, {needed:.2f} are needed. Give the offset by hand, or by sound.")
    if rise[~near].max(initial=0.0) > RIVAL * rise[best]:
        raise RecordingError(f"{path}: a light goes on more than once in it, at {(best + 1) / fps:.2f} and "
                             f"{(int(np.argmax(np.where(near, 0.0, rise))) + 1) / fps:.2f} s. Cut the film, or give "
                             "the offset by hand.")
    parts = np.where(near & (rise > 0.5 * needed), rise, 0.0)
    parts[:best] *= np.cumprod((parts[:best] > 0.0)[::-1])[::-1]  # of one rise only
    parts[best + 1:] *= np.cumprod(parts[best + 1:] > 0.0)
    return FilmOffset(float(np.sum(parts * (np.arange(len(rise)) + 0.5)) / np.sum(parts)) / fps, _SAMPLE / fps)


def _brightness(path: Path, progress: Progress) -> tuple[Array, float]:
    """((N,) mean grey level of each frame, frames/s). Raises RecordingError."""
    try:
        capture = open_video(path)
    except PictureError as exc:
        raise RecordingError(str(exc)) from exc
    try:
        fps, count = float(capture.get(cv2.CAP_PROP_FPS)), max(int(capture.get(cv2.CAP_PROP_FRAME_COUNT)), 1)
        levels: list[float] = []
        while len(levels) < LONGEST_S * max(fps, FPS[0]):
            read, picture = capture.read()
            if not read:
                break
            levels.append(float(np.mean(picture[::4, ::4])))
            progress(f"looking for a flash in {path.name}", min(len(levels) / count, 1.0))
    finally:
        capture.release()
    if not levels:
        raise RecordingError(f"{path}: no frame of it can be decoded. Is it a film, and complete?")
    if not FPS[0] <= fps <= FPS[1]:
        raise RecordingError(f"{path}: it says no frame rate. Write it anew with a video program.")
    return np.array(levels), fps


def offsets_of(films: Mapping[str, Path], by: str, progress: Progress = silent) -> dict[str, FilmOffset]:
    """What to add to each film's times, 0 for the first one; `by` "sound" or "flash". Raises RecordingError."""
    if len(films) < 2:
        raise RecordingError("one film has no offset; give two or more of one scene.")
    (name, first), *others = films.items()
    found = {name: FilmOffset(0.0, 0.0)}
    if by == "sound":
        return found | {other: offset_by_sound(first, path) for other, path in others}
    began = flash_s(first, progress)
    for other, path in others:
        seen = flash_s(path, progress)
        found[other] = FilmOffset(began.seconds - seen.seconds, math.hypot(began.std_s, seen.std_s))
    return found


def offset_sentence(found: Mapping[str, FilmOffset], by: str) -> str:
    """By how much later than the first film the others began."""
    first, *others = found
    return (f"By {by}, after {first} began " + ", ".join(
        f"{name} {found[name].seconds:+.4f} ± {found[name].std_s:.4f} s" for name in others) + ".")
