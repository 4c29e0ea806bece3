"""What to change on a camera: exposure, mains flicker and white balance in one report (RHOT 7.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.exposure import (
    ExposureResult,
    Mask,
    WhiteBalance,
    balance_on_grey,
    measure_exposure,
    unseen_finding,
)
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_node.config import CameraSettings
from rhot_node.detect.colour import Box
from rhot_node.detect.image import YuvImage

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CameraAdvice:
    """`flicker`: None until enough frames are seen, `white`: None without a grey patch."""

    exposure: ExposureResult
    flicker: FlickerResult | None
    white: WhiteBalance | None
    verdict: Verdict


class CameraAdvisor:
    """Looks at the pictures of one camera as they come. `markers`: names of those that it must have seen once before
    anything is called good."""

    def __init__(self, markers: Sequence[str] = ()) -> None:
        self._markers = tuple(markers)
        self.restart()

    def update(self, image: YuvImage, t_row0_s: float, settings: CameraSettings,
               markers: Mapping[str, Mask] | None = None, grey: Box | None = None) -> CameraAdvice:
        """The advice on a picture taken at `t_row0_s` (mid-exposure of row 0, s, node clock) with these settings.

        `markers`: their paint in the picture; `grey`: a box on something grey. Raises CalibrationError for a box on
        nothing grey.
        """
        self._flicker.add(image, t_row0_s)
        exposure = measure_exposure(image, markers, settings)
        self._seen.update(exposure.markers)
        row_time = 1e-6 * settings.row_time_us or None
        flicker = None
        if self._flicker.ready:
            flicker = self._flicker.report(row_time, 1e-6 * settings.exposure_us, settings.fps)
        white = None if grey is None else balance_on_grey(image, grey, settings)
        unseen = unseen_finding((name for name in self._markers if name not in self._seen), settings)
        waiting = [Finding("flicker_waiting", Grade.FAIR, "Flicker is not measured yet.", "It takes some pictures.")]
        findings = [*exposure.findings, *unseen, *(flicker.findings if flicker else waiting),
                    *(white.findings if white else ())]
        words = exposure.summary + ("" if flicker is None else f", flicker {100.0 * flicker.depth:.1f} %")
        return CameraAdvice(exposure, flicker, white, judge(f"{words}.", findings))

    def restart(self) -> None:
        """Forget the frames so far: the settings have changed."""
        self._flicker = FlickerWatch()
        self._seen: set[str] = set()


# -- mains flicker -----------------------------------------------------------------------------------------------------
# From the rows' mean brightness in a series of frames.

MAINS_HZ = (50.0, 60.0)
MAINS_SPREAD = 0.01  # of the mains' frequency, grids off their nominal and camera clocks included
OTHERS_HZ = (37.0, 61.0, 83.0, 109.0, 137.0, 151.0)  # frequencies that nothing has: what noise and motion give
FRAMES_LEAST = 8
ROWS = 120  # bands of rows that a picture is averaged to
ALIKE = 0.35  # of agreement of the rows
SEEN, STRONG = 0.004, 0.03  # of the brightness: worth a sentence, and moving colours and edges visibly
ABOVE_OTHERS = 4.0  # times what noise and motion give at other frequencies
IN_STEP = 0.15  # of wandering, 0..1: less cannot be told from the scene
ROW_TIMES_US = np.arange(0.0, 81.0, 2.0)  # that are tried where the camera does not tell


@dataclass(frozen=True, slots=True)
class FlickerResult:
    """`mains_hz`: of the lamp, None when no flicker is seen; `depth`: amplitude as a share of the mean brightness.

    `depths` by mains frequency, NaN where frames come in step with it, so that a standing pattern would not be seen.
    `bands`: how many a frame shows, top to bottom. `exposures_us`: times over which this lamp averages out and that fit
    into a frame, shortest first.
    """

    mains_hz: float | None
    depth: float
    depths: dict[float, float]
    bands: float
    exposures_us: tuple[float, ...]
    findings: tuple[Finding, ...]


class FlickerWatch:
    """Collects frames of one camera for `measure_flicker`; holds the last ones only."""

    def __init__(self, most: int = 120) -> None:
        self._most = most
        self._rows: list[Array] = []
        self._times: list[float] = []

    def add(self, image: YuvImage, t_row0_s: float) -> None:
        """A frame and the mid-exposure of its row 0, s, of the node's clock."""
        self._rows.append(row_means(image))
        self._times.append(t_row0_s)
        del self._rows[:-self._most], self._times[:-self._most]

    @property
    def ready(self) -> bool:
        """Whether there are enough frames to tell."""
        return len(self._rows) >= FRAMES_LEAST

    def report(self, row_time_s: float | None, exposure_s: float, fps: float) -> FlickerResult:
        """What `measure_flicker` says of the frames so far; `row_time_s` as for one row of the picture."""
        return measure_flicker(self._rows, self._times, row_time_s, exposure_s, fps)


def row_means(image: YuvImage) -> Array:
    """(H,) mean luma of every row."""
    return np.asarray(image.y.mean(axis=1, dtype=np.float64))


def measure_flicker(rows: Sequence[Array], times_s: Sequence[float], row_time_s: float | None, exposure_s: float,
                    fps: float) -> FlickerResult:
    """Flicker in frames with mean row brightness `rows` (F, H), row 0 of which was mid-exposed at `times_s` (F,).

    `row_time_s`: from row to row; None where the camera does not tell it (0: all rows at once). Raises CalibrationError
    for less than FRAMES_LEAST frames.
    """
    if len(rows) < FRAMES_LEAST:
        raise CalibrationError(f"{len(rows)} frames are too few to see flicker; at least {FRAMES_LEAST} are needed.")
    swing, centres = _swing(np.array(rows))
    times = np.asarray(times_s, dtype=np.float64) - times_s[0]
    row_times = 1e-6 * ROW_TIMES_US if row_time_s is None else np.array([row_time_s])
    depths, places = {}, {}
    for mains in MAINS_HZ:
        depths[mains], places[mains] = _depth(swing, times, centres, row_times, mains)
    noise = max(_amplitude(swing, times, centres, hz, row_times)[0] for hz in OTHERS_HZ)
    seen = {mains: depth for mains, depth in depths.items()
            if np.isfinite(depth) and depth >= max(SEEN, ABOVE_OTHERS * noise)}
    strongest = max(seen, key=lambda mains: seen[mains]) if seen else None
    depth = seen.get(strongest, 0.0) if strongest else 0.0
    bands = 2.0 * strongest * places[strongest] * len(rows[0]) if strongest else 0.0
    exposures = _steady_exposures(strongest, fps) if strongest else ()
    return FlickerResult(strongest, depth, depths, bands, exposures,
                         tuple(_findings(strongest, depth, depths, bands, exposures, exposure_s)))


def _swing(rows: Array) -> tuple[Array, Array]:
    """(F, B) relative deviation of bands of rows from their mean over time, and (B,) the row of each band's middle."""
    height = rows.shape[1]
    edges = np.linspace(0, height, min(ROWS, height) + 1).astype(int)
    bands = np.add.reduceat(rows, edges[:-1], axis=1) / np.diff(edges)
    mean = bands.mean(axis=0)
    return bands / np.maximum(mean, 1.0) - 1.0, 0.5 * (edges[:-1] + edges[1:] - 1)


def _depth(swing: Array, times: Array, rows: Array, row_times: Array, mains: float) -> tuple[float, float]:
    """Amplitude at twice the mains' frequency, NaN where frames are in step with it, and the row time that fits."""
    best, place = 0.0, float(row_times[0])
    for hz in 2.0 * mains * (1.0 + MAINS_SPREAD * np.linspace(-1.0, 1.0, 9)):
        if _wandering(times, float(hz)) >= IN_STEP:
            amplitude, row_time, alike = _amplitude(swing, times, rows, float(hz), row_times)
            if amplitude > best and alike >= ALIKE:
                best, place = amplitude, row_time
    blind = _wandering(times, 2.0 * mains) < IN_STEP and best < SEEN
    return (float("nan") if blind else best), place


def _wandering(times: Array, hz: float) -> float:
    """0..1: 0 when every frame sees the same phase, so that the mean over time takes the bands off."""
    return 1.0 - abs(complex(np.exp(2j * np.pi * hz * times).mean()))


def _amplitude(swing: Array, times: Array, rows: Array, hz: float, row_times: Array) -> tuple[float, float, float]:
    """Amplitude of a cosine at `hz` and each row's own time, the row time that shows the largest, and how far the rows
    agree, 0..1: 1 when all swing alike; 1/2 when frames see only two opposite phases, so that some rows see no swing.

    Taking the mean over time off also took the mean of the cosine: the share that is left is put right.
    """
    phase = np.exp(-2j * np.pi * hz * times)
    left = max(1.0 - abs(phase.mean()) ** 2, IN_STEP)
    by_row = 2.0 * (swing * (phase - phase.mean())[:, None]).mean(axis=0) / left
    sums = np.abs(np.exp(-2j * np.pi * hz * row_times[:, None] * rows) @ by_row) / len(rows)
    best = int(np.argmax(sums))
    power = float(np.mean(np.abs(by_row) ** 2))
    return float(sums[best]), float(row_times[best]), float(sums[best]) ** 2 / max(power, 1e-12)


def _steady_exposures(mains: float, fps: float) -> tuple[float, ...]:
    """Whole swings of the lamp that fit into a frame, us."""
    swing_us, frame_us = 1e6 / (2.0 * mains), 1e6 / fps
    return tuple(swing_us * k for k in range(1, int(frame_us / swing_us + 1e-6) + 1))


def _findings(mains: float | None, depth: float, depths: dict[float, float], bands: float,
              exposures: tuple[float, ...], exposure_s: float) -> list[Finding]:
    if mains is None:
        blind = [f"{hz:.0f} Hz" for hz, one in depths.items() if np.isnan(one)]
        return [Finding("flicker_unseen", Grade.GOOD, "At this frame rate flicker from "
                        f"{' and '.join(blind)} mains cannot be measured.",
                        "Every frame meets the lamp at the same point of its swing. Bands would stand still in the "
                        "picture, and harm little.")] if blind else []
    now = 1e6 * exposure_s
    fitting = " or ".join(f"{1e-3 * one:.2f}" for one in exposures) + " ms"
    if exposures and now > 0.5 * exposures[0]:
        remedy = f"Set the exposure to {fitting}: over that time this lamp averages out."
    elif exposures:
        remedy = (f"Use a lamp that does not flicker (direct current), or set the exposure to {fitting}, over which "
                  "this lamp averages out; a moving hand is then blurred more.")
    else:
        remedy = "Use a lamp that does not flicker (direct current): no exposure between two frames is long enough."
    figure = f"The light flickers with the {mains:.0f} Hz mains by {100.0 * depth:.1f} % of its brightness"
    figure += f", {bands:.1f} bands in a picture." if bands >= 0.5 else ", from frame to frame."
    return [Finding("flicker", Grade.POOR if depth >= 5.0 * STRONG else Grade.FAIR, figure,
                    f"An exposure of {1e-3 * now:.1f} ms catches other parts of the lamp's swing every time.", remedy)]
