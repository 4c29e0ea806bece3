"""All calibrations: what each is called wherever it is named, in the order in which a new rig needs them.

The Calibrate menu, `rhot calibrate`, a rig's history, its health and the documents' list follow these records. No other
list of calibrations exists. A wizard is loaded as the module of that name in `rhot_app.ui.wizards`.
"""

from __future__ import annotations

from typing import NamedTuple


class Command(NamedTuple):
    """``rhot calibrate WORD``, also by the words `aliases`. `summary` goes on after "Calibrate". `module` has
    ``add_arguments(parser)`` and ``run(args)``."""

    word: str
    summary: str
    aliases: tuple[str, ...] = ()
    module: str = ""

    @property
    def imported(self) -> str:
        """The dotted name of its module."""
        return self.module or f"rhot_app.calibration.commands.{self.word}"


class Calibration(NamedTuple):
    """One calibration. `title` is its wizard's, `meaning` what it finds and from what, a sentence. `reason` begins what
    it writes into a rig's history, so that menus can tell when it was used last."""

    name: str
    title: str
    meaning: str
    reason: str
    command: Command | None = None


CAMERA = Calibration(
    "camera", "Set the cameras", "Exposure, gains, white balance: what each camera is told, tried out live.",
    "camera settings")
LENS = Calibration(
    "lens", "Intrinsics of a camera", "Focal length, centre and distortion of one camera's lens, from a board that is "
    "held all over its picture.", "intrinsics of",
    Command("intrinsics", "focal length, centre and distortion of one camera's lens, from pictures of a board",
            ("lens",)))
STEREO = Calibration(
    "stereo", "Stereo calibration", "Where the cameras stand to each other and to the table, from a board that they "
    "see at the same time.", "stereo calibration",
    Command("stereo", "how two or more cameras stand to each other, from pictures of a board that they took together",
            ("together",)))
REFINED = Calibration(
    "refined", "Use refined calibration", "How the cameras stand now, from the hand that moves while it is tracked.",
    "refined calibration")
COLOURS = Calibration(
    "colours", "Colours of the markers", "Which colour each marker has, and what may be mistaken for it.",
    "colour calibration", Command("colours", "the markers' colours, from boxes on their paint in pictures"))
FOREGROUND = Calibration(
    "foreground", "Background and skin", "What the empty scene and your skin look like, so that a bare hand can be "
    "tracked.", "background and skin")
ADAPTED = Calibration(
    "adapted", "Adapt the hand's shape", "How long and how thick the fingers are, from a bare hand that moves while it "
    "is tracked.", "hand adapted while it was tracked")
MEASURED = Calibration(
    "measured", "Use measured bones", "How long the bones are, from the landmarks of a hand that two cameras see while "
    "it is tracked.", "bones measured while the hand was tracked")
TIME = Calibration(
    "time", "Time of the cameras", "When each camera sees, from a hand that waves.", "time calibration",
    Command("time", "when each camera sees, from a moving marker"))
DEPTH = Calibration(
    "depth", "Depth without a board", "Distance from disparity, from a marker at measured distances.",
    "depth calibration",
    Command("depth", "distance from disparity, without a board, from a table of measured distances"))
BONES = Calibration(
    "bones", "Bones of the hand", "How long the bones are, from a minute of movement or by a ruler.",
    "bones calibration",
    Command("bones", "the hand's bones and where the markers sit, from a minute of free movement or a ruler"))
FILTERS = Calibration(
    "filters", "Filters", "How much jitter and how much lag, from a hand held still and one that moves fast.",
    "filter tuning", Command("filters", "the filters' settings, from a hand held still and one that moves fast"))
ALIGNMENT = Calibration(
    "alignment", "Alignment with another tracker", "Where a Vive tracker's world is in the rig, from a movement of "
    "both.", "alignment with another tracker",
    Command("alignment", "where another tracker's world is in the rig, from two streams of one motion", ("tracker",),
            "rhot_app.objects.alignment.calibration"))
CERTIFICATE = Calibration(
    "certificate", "Certificate", "How good this rig is, measured as the thesis did, with 95 % intervals: five "
    "minutes.", "certificate")

CALIBRATIONS = (CAMERA, LENS, STEREO, REFINED, COLOURS, FOREGROUND, ADAPTED, MEASURED, TIME, DEPTH, BONES, FILTERS,
                ALIGNMENT, CERTIFICATE)

COMMANDS = tuple(one.command for one in CALIBRATIONS if one.command is not None)
