"""What a rig still needs, in order, by what its owner has: the steps that `NextSteps` shows. No Qt."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from rhot_app.calibration.check.camera_calibration import calibration_finding, times_text, times_unknown
from rhot_app.calibration.registry import calibration
from rhot_app.hand.anatomy import is_shipped
from rhot_app.project import Rig
from rhot_app.ui.language import tr

Wear = Literal["paint", "bare", "landmarks"]
"""What shows the hand: painted or taped markers; a bare hand, by the networks; landmarks or nodes of one's own."""

CAMERAS, TRACKER, NETWORKS, BOARD = "cameras", "tracker", "networks", "board"
"""Actions that are no wizard; the others are names of calibrations."""


@dataclass(frozen=True, slots=True)
class Answers:
    """What somebody has."""

    wear: Wear
    cameras: Literal[1, 2]


@dataclass(frozen=True, slots=True)
class Step:
    """One step: whether the rig shows that it is `done`, and what opens it (`action`)."""

    title: str
    meaning: str
    done: bool
    action: str


def answers_of(rig: Rig) -> Answers:
    """The answers that fit the rig as it is."""
    return Answers("paint" if rig.painted else "bare", 1 if len(rig.nodes) == 1 else 2)


def next_steps(answers: Answers, rig: Rig, *, networks: bool, printed: bool, reasons: Collection[str]) -> list[Step]:
    """All steps in order. `networks`: whether the hand networks are installed here; `printed`: whether a board was;
    `reasons`: of what is in force, as the rig's history and the wizards note them."""
    two = answers.cameras == 2
    measured = [node.name for node in rig.nodes if not node.intrinsics.nominal]
    missing = [node.name for node in rig.nodes if node.intrinsics.nominal]
    exact = rig.calibration is not None and rig.calibration.method == "exact"
    steps = []
    if two and len(rig.nodes) < 2:
        steps.append(Step(tr("Choose two cameras"), tr("Both see the hand; 10 to 50 cm apart."), False, CAMERAS))
    if answers.wear == "bare":
        steps.append(Step(tr("Install the hand networks"), tr("They find the joints of a bare hand (36 MB)."), networks,
                          NETWORKS))
    steps.append(_observed(answers.wear, rig))
    steps.append(Step(tr("Print the board"), tr("A chessboard on A4 at 100 %, glued to something flat."),
                      printed or exact or bool(measured), BOARD))
    steps.append(Step(tr("Calibrate each lens"), tr("Until then distances are a guess.")
                      if len(missing) == len(rig.nodes) else tr("Missing: {names}.", names=", ".join(missing))
                      if missing else tr("All lenses are known."), exact or not missing, "lens"))
    if two:
        steps.append(Step(tr("Put the cameras together"),
                          tr("Where they stand to each other, from the board before both."), _together(rig),
                          "stereo"))
        steps.append(Step(tr("Compare the cameras' times"), times_text(rig), _together(rig) and not times_unknown(rig),
                          "time"))
    if answers.wear == "paint":
        steps.append(Step(tr("Teach the colours"), tr("Which colour each marker has in this light."),
                          exact or _noted(reasons, "colours"), "colours"))
    if answers.wear == "paint" or two:
        steps.append(Step(tr("Measure your hand"), tr("How long its bones are, from a minute of movement."),
                          not is_shipped(rig.hand) or _noted(reasons, "bones", "measured", "adapted"),
                          "bones" if answers.wear == "paint" else "measured"))
    return steps


def _observed(wear: Wear, rig: Rig) -> Step:
    if wear == "paint":
        return Step(tr("Track painted markers"), tr("Six colours: five fingertips and the wrist."), rig.painted,
                    TRACKER)
    return Step(tr("Track landmarks"), tr("The joints of a bare hand, as networks find them."),
                not rig.painted or rig.tracker.landmarks, TRACKER)


def _together(rig: Rig) -> bool:
    found = calibration_finding(rig)
    return (len(rig.nodes) > 1 and all(rig.tracked_with)
            and (found is None or found.finding.code == "lengths_unproven"))


def _noted(reasons: Collection[str], *names: str) -> bool:
    beginnings = tuple(calibration(name).reason for name in names)
    return any(reason.startswith(beginnings) for reason in reasons)
