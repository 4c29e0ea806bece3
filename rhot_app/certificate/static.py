"""Lines 1 and 6: static jitter (RHOT figure 7.7), and whether the rig is upright and not mirrored."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rhot_app.certificate import thesis
from rhot_app.certificate.document import Figure, Line, figure, in_words, not_measured, number
from rhot_app.certificate.geometry import axes_of
from rhot_app.certificate.intervals import Interval, mean_of, sd_of
from rhot_app.certificate.recordings import CertifiedRecording
from rhot_app.filters import jitter
from rhot_app.project import Rig

Array = NDArray[np.float64]

TITLE = "Static jitter"
AGAIN = "Rest the hand or the board on a table, let nobody touch the cameras, and record 10 s again."
_SWAYS = 2.0
"""White noise has the same standard deviation over the whole as within half a second; twice as much is a movement."""


def judge_static(recording: CertifiedRecording, rig: Rig) -> Line:
    """The standard deviation of every marker: in the pictures, along the rig's axes, and of its distance."""
    axes = axes_of(rig)
    figures: list[Figure] = []
    curves: dict[str, list[float | None]] = {}
    worst: tuple[float, str, Interval, Interval] | None = None
    sways, hidden = [], []
    for m, name in enumerate(recording.marker_ids):
        places = recording.positions[:, m]
        located = np.count_nonzero(np.isfinite(places[:, 0]))
        if located < 0.5 * len(places):
            hidden += [name] if located else []
            continue
        pixels = [_pixel_sd(recording, m, axis) for axis in range(2)]
        distance = sd_of([axes.distance(places)]).scaled(1e3)
        figures += [figure(f"{name}: {axis} in the pictures", "px", sd,
                           thesis="{:g} to {:g} px (figure 7.7)".format(*thesis.JITTER_PX))
                    for axis, sd in zip("xy", pixels, strict=True)]
        figures += [figure(f"{name}: {axis}", "mm", sd_of([axes.rig_axes(places)[:, k]]).scaled(1e3))
                    for k, axis in enumerate(("right", "up", "away"))]
        figures.append(figure(f"{name}: distance", "mm", distance))
        larger = max(pixels, key=lambda sd: sd.value)
        curves[name] = [pixels[0].value, pixels[1].value, distance.value]
        short = jitter.resting(recording.times_s, axes.distance(places)[:, None])
        if math.isfinite(short) and 1e-3 * distance.low > _SWAYS * short:
            sways.append(name)
        if math.isfinite(larger.value) and (worst is None or larger.value > worst[0]):
            worst = (larger.value, name, larger, distance)
    if worst is None:
        return not_measured("static", TITLE, "no marker was located, or long enough, in the recording of the still "
                            "hand.", AGAIN)
    _, name, larger, distance = worst
    measured = (f"The least steady marker, {name}, moves by {in_words(larger, 'px')} in the pictures and by "
                f"{in_words(distance, 'mm')} in distance.")
    limit = thesis.JITTER_PX[1]
    if larger.low > limit:
        return Line("static", TITLE, "differs", f"{measured} The thesis reaches {limit:g} px.",
                    "The marker is partly hidden, dim, or of a colour that something else has." if not sways else
                    "It moved while it was recorded.", AGAIN, tuple(figures), curves)
    if larger.high > limit:
        return not_measured("static", TITLE, f"more than the thesis's {limit:g} px would not show. {measured}", AGAIN,
                            tuple(figures), curves)
    word = "below" if larger.high < thesis.JITTER_PX[0] else "within"
    swaying = (f" {', '.join(sways)} swayed: most of that is movement, not noise." if sways else "")
    unseen = f" Not judged, because located less than half of the time: {', '.join(hidden)}." if hidden else ""
    return Line("static", TITLE, "agrees", f"{measured} That is {word} the thesis's "
                f"{thesis.JITTER_PX[0]:g} to {limit:g} px.{swaying}{unseen}", figures=tuple(figures), curves=curves)


def _pixel_sd(recording: CertifiedRecording, marker: int, axis: int) -> Interval:
    """px, common to all cameras, each with its own frames."""
    return sd_of([recording.pixels[recording.cameras == camera, marker, axis]
                  for camera in range(recording.camera_count)])


# -- line 6: upright and not mirrored ----------------------------------------------------------------------------------

UPRIGHT, HANDEDNESS = "Upright", "Not mirrored"

LEVEL_RAD = math.radians(1.0)
"""17 mm over one metre: no better is a rig levelled with a spirit level."""

_MARK_SD_M = 0.5e-3  # of a marker's centre beside the axis of the rod, set by hand


def judge_upright(recording: CertifiedRecording, upper: str, lower: str, rig: Rig) -> Line:
    """The rig's up against a rod that hangs from a string."""
    axes = axes_of(rig)
    up, down = recording.marker(upper), recording.marker(lower)
    along = recording.positions[:, up] - recording.positions[:, down]
    along = along[np.isfinite(along[:, 0])]
    if len(along) < 8:
        return not_measured("upright", UPRIGHT, f"{upper} and {lower} were not located together.", _PLUMB)
    length = float(np.linalg.norm(along.mean(axis=0)))
    unit = axes.rig_axes(along / np.linalg.norm(along, axis=1)[:, None])
    sideways, forward = (mean_of(unit[:, k]).widened(math.sqrt(2.0) * _MARK_SD_M / length) for k in (0, 2))
    tilt = math.atan2(math.hypot(sideways.value, forward.value), float(unit[:, 1].mean()))
    reach = math.sqrt(5.991 / 3.841) * max(sideways.half_width, forward.half_width)  # chi-squared of two and of one
    degrees = Interval(tilt, max(0.0, tilt - reach), tilt + reach).scaled(math.degrees(1.0))
    figures = (figure("tilt", "deg", degrees, expected=0.0),
               figure("to the right", "deg", sideways.scaled(math.degrees(1.0)), expected=0.0),
               figure("away", "deg", forward.scaled(math.degrees(1.0)), expected=0.0),
               figure("length of the rod as seen", "mm", Interval(1e3 * length, 1e3 * length, 1e3 * length)))
    measured = f"The rig's up is {in_words(degrees, 'deg')} off the plumb line."
    if tilt > 0.5 * math.pi:
        return Line("upright", UPRIGHT, "differs", measured, f"The rig is upside down, or {upper} and {lower} were "
                    "exchanged.", "Check which marker is above.", figures)
    if math.radians(degrees.low) <= LEVEL_RAD < math.radians(degrees.half_width):
        return not_measured("upright", UPRIGHT, f"a tilt of {math.degrees(LEVEL_RAD):g} deg would not show. {measured}",
                            f"Take a longer rod. {_PLUMB}", figures)
    if math.radians(degrees.low) > LEVEL_RAD:
        return Line("upright", UPRIGHT, "differs", measured, "The cameras look up or down, or are rolled, and the rig "
                    "file says nothing of it.", "Calibrate with a picture of the board on the table "
                    "(rhot calibrate stereo --table-image), or level the cameras.", figures)
    return Line("upright", UPRIGHT, "agrees", measured, figures=figures)


_PLUMB = "Hang the rod from a string, let it come to rest, and record 3 s."


def judge_handedness(recording: CertifiedRecording, facing: str | None, rig: Rig) -> Line:
    """Whether the hand that the operator shows is the hand that the rig sees (freemocap#862: a mirrored rig tracks
    smoothly and is wrong)."""
    if facing is None:
        return not_measured("handedness", HANDEDNESS, "nobody said which side of a hand faced the cameras.",
                            "Record the still hand, and state palm or back.")
    roles = {marker.role: m for m, marker in enumerate(rig.markers.markers)}
    wanted = ("wrist", "index_tip", "little_tip")
    if any(role not in roles for role in wanted):
        return not_measured("handedness", HANDEDNESS, "the hand wears no markers on wrist, index and little finger.",
                            "Use a marker set with these three.")
    wrist, index, little = (recording.positions[:, roles[role]] for role in wanted)
    normal = np.cross(index - wrist, little - wrist)
    line_of_sight = wrist - axes_of(rig).centre
    lengths = np.linalg.norm(index - wrist, axis=1) * np.linalg.norm(little - wrist, axis=1)
    sine = np.einsum("ti,ti->t", normal, line_of_sight) / (lengths * np.linalg.norm(line_of_sight, axis=1))
    # With the right palm towards the cameras the thumb points right in the picture: the turn from the index to the
    # little finger about the wrist is against the line of sight.
    seen = mean_of(sine * (-1.0 if (rig.hand.side == "right") == (facing == "palm") else 1.0))
    if math.isnan(seen.value):
        return not_measured("handedness", HANDEDNESS, "wrist, index and little finger were not seen together.", AGAIN)
    figures = (figure("turn from index to little finger (sine)", "", seen),)
    hand = f"a {rig.hand.side} hand with its {facing} to the cameras"
    if seen.low > 0.0:
        return Line("handedness", HANDEDNESS, "agrees", f"The rig sees {hand}, as stated.", figures=figures)
    if seen.high < 0.0:
        return Line("handedness", HANDEDNESS, "differs", f"Stated was {hand}; the rig sees its mirror image "
                    f"({number(seen.value)}).", "The pictures are mirrored and the cameras exchanged, or another hand "
                    "or side was shown.", "Switch off mirroring in the camera's driver and calibrate again with a "
                    "ChArUco board, which has no mirror image.", figures)
    return not_measured("handedness", HANDEDNESS, "the three markers lie nearly in one plane with the cameras.",
                        "Hold the hand flat towards the cameras, fingers spread.")


