"""The wizard for a bare hand: the nodes learn the empty scene and the skin."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.kinds.wizard_only import FOREGROUND
from rhot_app.calibration.proposal import Command, Proposal, Row
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge, told_apart, with_findings
from rhot_app.errors import EngineError, RhotError
from rhot_app.ui.backend.contract import Connect
from rhot_app.ui.backend.feed import Picture, ask_picture
from rhot_app.ui.common.job import Job
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_page
from rhot_app.ui.wizards.framework.drawing import Layer
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, Bar, Pictures, Step, StepView
from rhot_node.detect.foreground import BackgroundSums, no_foreground, skin_mask
from rhot_node.errors import PictureError
from rhot_node.pictures import decode_picture


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand."""
    cameras = {node.name: node.node_id for node in context.rig.nodes if node.node_id in context.now.node_settings}
    empty, skin = EmptyStep(cameras), SkinStep(cameras, context.connect)
    last = accept_page(context, lambda: propose(empty, skin), tr("Learn the empty scene and your hand first."))
    pages = (LearnPage(empty, context, tr("Learn the empty scene")), LearnPage(skin, context, tr("Learn my skin")),
             last)

    def put_back() -> None:
        """What was only tried out goes, and what is being learnt is given up."""
        for step in (empty, skin):
            step.stop()
        if last.accept.state != "used" and (empty.tried or skin.tried):
            with contextlib.closing(context.connect()) as client:
                for node_id in cameras.values():
                    with contextlib.suppress(RhotError):  # a node that is gone has forgotten it anyway
                        ask_node(client.command, node_id, "revert_foreground")

    return Definition(pages, put_back=put_back)


class LearnPage(Page):
    """A button that has the nodes learn; the pictures stay live."""

    def __init__(self, step: LearningStep, context: WizardContext, label: str) -> None:
        super().__init__(step)
        self._learning, self._context = step, context
        self._job: Job | None = None
        self.learn_button = plain_button(label, tr("Tried out at once by every node, and kept by none before the last "
                                                   "step."), self.learn)
        self.column.addWidget(self.learn_button)
        self.column.addStretch(1)
        self.first_field = self.learn_button

    def learn(self) -> None:
        """Have the nodes learn, in a worker."""
        if self._job is None:
            self._learning.begin()
            self._job = Job(lambda progress: self._ask(), self._learnt, self._failed, None, self).start()
            self.changed.emit()

    def show_view(self, view: StepView) -> None:
        """The button waits for what is under way."""
        self.learn_button.setEnabled(self._job is None and bool(self._learning.nodes))

    def _ask(self) -> str:
        with contextlib.closing(self._context.connect()) as client:
            return self._learning.learn(client.command)

    def _learnt(self, problem: str) -> None:
        self._job = None
        self._learning.finish(problem)
        self.changed.emit()

    def _failed(self, sentence: str) -> None:
        self._job = None
        self._learning.finish(sentence, learnt=False)
        self.changed.emit()


# -- what the nodes learn ----------------------------------------------------------------------------------------------

SECONDS = 3.0
"""s of the empty scene: a hundred pictures at 30 Hz, after which a pixel's noise is known to 7 %."""

LEAST, MOST = 0.005, 0.5
"""Parts of a picture that a hand with its forearm covers, from 2 m away and from 0.25 m, seen with 62 degrees."""

WHOLE = 0.8
"""Part of the foreground that is in one piece when it shows a hand and little else."""

_WAIT_S = 10.0  # beyond SECONDS, for a slow node
_LOOK_S = 0.2
_MOVES = 6.0  # times the median standard deviation of a pixel: no noise of a pixel in other light varies so
_TINT = (60, 200, 255)


def ask_node(command: Command, node_id: int, request: str, **fields: Any) -> dict[str, Any]:
    """A node's whole answer, a picture included. Raises EngineError."""
    return command("node", node_id=node_id, request={"request": request, **fields})


def foreground_of(command: Command, node_id: int) -> dict[str, Any]:
    """What a node knows of background and skin. Raises EngineError, also for a node that knows no such thing."""
    known = ask_node(command, node_id, "state").get("answer", {}).get("foreground")
    if not isinstance(known, dict):
        raise EngineError(tr("a node learns neither background nor skin. Does rhot-node have the version of this "
                             "program there?"))
    return known


class LearningStep(Step):
    """Base of both: `learn` is called in a worker, between `begin` and `finish`; `stop` in another one."""

    def __init__(self, cameras: Mapping[str, int]) -> None:
        """`cameras`: node ids by name."""
        self.nodes = dict(cameras)
        self.cameras = tuple(cameras)
        self.learning = self.learnt = False
        self.tried = 0  # how often a learning was begun, of which some nodes may try something out
        self.problem = ""
        self._asking = threading.Lock()
        self._stopped = False

    def learn(self, command: Command) -> str:
        """Have every node learn; returns what is worth a sentence. Raises RhotError."""
        raise NotImplementedError

    def begin(self) -> None:
        """It is being learnt."""
        self.learning, self.problem = True, ""
        self.tried += 1

    def finish(self, problem: str = "", *, learnt: bool = True) -> None:
        """It has ended so."""
        self.learning, self.problem, self.learnt = False, problem, learnt or self.learnt

    def stop(self) -> None:
        """No node is asked to learn from now on; waits for an answer that is under way."""
        with self._asking:
            self._stopped = True

    @property
    def keeps(self) -> bool:
        """What was learnt is only tried out."""
        return self.learnt


class SceneWatch:
    """Looks at pictures of one camera while its node learns the empty scene: whether it is empty."""

    def __init__(self) -> None:
        self._sums = BackgroundSums()
        self._skin = 0.0

    @property
    def seen(self) -> bool:
        """Whether it has a picture."""
        return self._sums.count > 0

    def add(self, bgr: NDArray[np.uint8]) -> None:
        """Take one picture (H, W, 3) BGR."""
        small = np.asarray(cv2.resize(bgr, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)
        self._sums.add(np.asarray(cv2.GaussianBlur(small, (3, 3), 0.0), np.uint8))
        skin = cv2.morphologyEx(skin_mask(small[..., ::-1]).astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
        count, _, stats, _ = cv2.connectedComponentsWithStats(skin, connectivity=8)
        pieces = stats[1:, cv2.CC_STAT_AREA] / skin.size if count > 1 else np.zeros(0)
        self._skin = max(self._skin, float(pieces[(pieces >= LEAST) & (pieces <= MOST)].max(initial=0.0)))

    def findings(self, camera: str) -> list[Finding]:
        """What may be a hand: what moves, and what has the colours of skin."""
        sd = self._sums.learnt(no_foreground()).sd.max(axis=2)
        moving = float(np.mean(sd > _MOVES * np.median(sd)))
        if moving >= LEAST:
            return [Finding("moves", Grade.POOR, tr("{camera}: something moved in {moving:.1%} of the picture.",
                                                    camera=camera, moving=moving), tr("What moves is no background."),
                            tr("Keep out of the picture and learn it again."))]
        if self._skin > 0.0:
            return [Finding("skin", Grade.FAIR, tr("{camera}: something in {skin:.1%} of the picture has the colours "
                                                   "of skin.", camera=camera, skin=self._skin),
                            tr("A hand that is learnt as background is not found there."),
                            tr("If it is a hand or a face, take it away and learn again; if it is wood or cloth, go "
                               "on."))]
        return []


class EmptyStep(LearningStep):
    """The scene without a hand."""

    title = tr_noop("Empty scene")

    def __init__(self, cameras: Mapping[str, int]) -> None:
        super().__init__(cameras)
        self.before: dict[str, dict[str, Any]] = {}
        self.verdict: Verdict | None = None
        self._until_s = 0.0

    def begin(self) -> None:
        """See `LearningStep`; the time runs from when the nodes have been asked."""
        super().begin()
        self.verdict = None
        self._until_s = math.inf

    def learn(self, command: Command) -> str:
        """For SECONDS."""
        for name, node_id in self.nodes.items():
            known = foreground_of(command, node_id)
            self.before.setdefault(name, known)
            with self._asking:
                if not self._stopped:
                    ask_node(command, node_id, "learn_background", seconds=SECONDS, save=False)
        self._until_s = time.monotonic() + SECONDS
        watches = {name: SceneWatch() for name in self.nodes}
        while not self._stopped:
            for name, watch in watches.items():
                watch.add(ask_picture(command, name, self.nodes[name]).bgr)
            waiting = [name for name, node_id in self.nodes.items() if not self._has_learnt(command, node_id)]
            if not waiting:
                break
            if time.monotonic() > self._until_s + _WAIT_S:
                raise EngineError(tr("{names}: the background was not learnt in time. Look at the Nodes panel, then "
                                     "learn it again.", names=", ".join(waiting)))
            time.sleep(_LOOK_S)
        if all(watch.seen for watch in watches.values()):
            self.verdict = judge(tr("the scene is learnt."),
                                 [finding for name, watch in watches.items() for finding in watch.findings(name)])
        return ""

    def _has_learnt(self, command: Command, node_id: int) -> bool:
        known = foreground_of(command, node_id)
        if known.get("learning_s"):
            return False
        if known.get("problem"):
            raise EngineError(str(known["problem"]))
        return bool(known.get("background"))

    def view(self) -> StepView:
        """What to do."""
        if not self.nodes:
            return StepView(tr("No camera answers."),
                            hint=tr("Look at the Nodes panel: its sentence says what is wrong."))
        done = 1.0 if self.learnt else 0.0
        if self.learning:
            done = min(max(1.0 - (self._until_s - time.monotonic()) / SECONDS, 0.0), 1.0)
        verdict = self.verdict if self.learnt and not self.learning else None
        sentence = (tr("Keep out of the pictures.") if self.learning
                    else tr("Learnt. Go on, or learn it again after anything in the pictures has changed.")
                    if verdict is not None and verdict.grade is Grade.GOOD
                    else tr("Is the scene empty? Read what was seen, and learn it again.") if verdict is not None
                    else tr("Take the hand out of both pictures and leave everything as it will be. Then press Learn."))
        return StepView(sentence, done=verdict is not None and verdict.grade is Grade.GOOD, hint=self.problem,
                        bars=(Bar(tr("empty scene"), done, tr("{seconds:g} s of every camera", seconds=SECONDS)),),
                        verdict=verdict, passable=verdict is not None and verdict.acceptable)


@dataclass(frozen=True, slots=True, eq=False)
class Mask:
    """One camera's foreground: `covered`, its part of the picture, and `whole`, the largest piece's part of it.
    `annotated`: drawn over its picture, None from a node that does not give that."""

    covered: float
    whole: float
    annotated: AnnotatedPicture | None = None


class SkinStep(LearningStep):
    """The hand before the learnt background, its foreground live."""

    title = tr_noop("Your hand")
    watches = True

    def __init__(self, cameras: Mapping[str, int], connect: Connect) -> None:
        super().__init__(cameras)
        self.masks: dict[str, Mask] = {}
        self._connect = connect

    def learn(self, command: Command) -> str:
        """The next picture's skin of each camera."""
        without = [name for name, node_id in self.nodes.items() if not self._finds_skin(command, node_id)]
        return "" if not without else (
            tr("No skin was found in the picture of {names}, so the colours of any skin are used there. Hold the hand "
               "into both pictures and learn it again.", names=", ".join(without)))

    def _finds_skin(self, command: Command, node_id: int) -> bool:
        with self._asking:
            return not self._stopped and bool(
                ask_node(command, node_id, "learn_skin", save=False).get("answer", {}).get("found"))

    def observe(self, pictures: Pictures) -> dict[str, Mask]:
        """What each node takes for the hand now."""
        found = {}
        with contextlib.closing(self._connect()) as client:
            for name in pictures:
                if name in self.nodes:
                    with contextlib.suppress(RhotError):  # its picture says what is wrong
                        answer = ask_node(client.command, self.nodes[name], "foreground_mask")
                        found[name] = mask_of(name, answer)
        return found

    def accept_observation(self, seen: dict[str, Mask]) -> None:
        """The newest masks."""
        self.masks = {**self.masks, **seen}

    @property
    def verdict(self) -> Verdict | None:
        """On all cameras together; None until every one has a mask."""
        if not self.masks or set(self.masks) != set(self.nodes):
            return None
        findings = [finding for name, mask in self.masks.items() for finding in findings_of(name, mask)]
        return judge("; ".join(tr("{name}: {covered:.1%} of the picture is the hand", name=name, covered=mask.covered)
                               for name, mask in self.masks.items()) + ".", findings)

    def view(self) -> StepView:
        """The masks and what they say."""
        verdict = self.verdict
        good = verdict is not None and verdict.acceptable
        sentence = (tr("One moment.") if self.learning
                    else tr("Hold your bare hand into both pictures, fingers spread, and press Learn.")
                    if not self.learnt else tr("The hand and little else should be tinted: then press Next.") if good
                    else tr("Read what is wrong, then learn it again."))
        return StepView(sentence, done=self.learnt and good and not self.learning, hint=self.problem, verdict=verdict,
                        annotated={name: mask.annotated for name, mask in self.masks.items()
                                   if mask.annotated is not None})


def mask_of(camera: str, told: Mapping[str, Any]) -> Mask:
    """What a node's answer shows. Raises EngineError when it is no picture."""
    about, data = told.get("answer", {}), told.get("data", b"")
    mask_bytes = about.get("mask_bytes")
    try:
        grey = decode_picture(data[:mask_bytes], grey=True)
        bgr = decode_picture(data[mask_bytes:]) if mask_bytes else None
    except PictureError as exc:
        raise EngineError(tr("a node gave a foreground that cannot be read; restart it.")) from exc
    hand: NDArray[np.uint8] = np.asarray(grey > 127, np.uint8)
    count, _, stats, _ = cv2.connectedComponentsWithStats(hand, connectivity=8)
    total = int(hand.sum())
    largest = int(stats[1:, cv2.CC_STAT_AREA].max()) if count > 1 else 0
    annotated = None
    if bgr is not None:
        rgba = np.zeros((*hand.shape, 4), np.uint8)
        rgba[hand > 0] = (*_TINT, 130)
        picture = Picture(camera, bgr, int(about.get("number", 0)), int(about.get("t_node_ns", 0)), time.monotonic_ns())
        annotated = AnnotatedPicture(picture, (Layer(rgba),))
    return Mask(total / hand.size, largest / max(total, 1), annotated)


def findings_of(camera: str, mask: Mask) -> list[Finding]:
    """What is wrong with one camera's foreground."""
    if mask.covered < LEAST:
        return [Finding("nothing", Grade.POOR, tr("{camera}: the hand covers {told_apart} % of the picture, less than "
                                                  "{least:g} %.", camera=camera,
                                                  told_apart=told_apart(100.0 * mask.covered, 100.0 * LEAST, 1),
                                                  least=100.0 * LEAST),
                        tr("It was in the picture while the empty scene was learnt, or is not there now."),
                        tr("Hold it into the picture; if it is there, go back and learn the empty scene without it."))]
    if mask.covered > MOST:
        return [Finding("everything", Grade.POOR, tr("{camera}: {told_apart} % of the picture differs from the empty "
                                                     "scene, more than {most:g} %.", camera=camera,
                                                     told_apart=told_apart(100.0 * mask.covered, 100.0 * MOST),
                                                     most=100.0 * MOST),
                        tr("Light, exposure or the camera have changed since."),
                        tr("Go back and learn the empty scene again."))]
    if mask.whole < WHOLE:
        return [Finding("pieces", Grade.FAIR, tr("{camera}: {whole:.0%} of what is tinted is not the hand.",
                                                 camera=camera, whole=1.0 - mask.whole),
                        tr("Shadows, a second hand, a face or moving things."),
                        tr("Take them away, or have more even light."))]
    return []


# -- what is kept ------------------------------------------------------------------------------------------------------

@dataclass(frozen=True, slots=True)
class ForegroundChange:
    """What the nodes (ids by name) try out since the `tried`-th learning is kept in their files; a restore brings back
    what these had."""

    nodes: dict[str, int]
    tried: int
    _kept: dict[str, bool] = field(default_factory=dict, compare=False)  # True: kept; False: taken back

    def use(self, command: Command) -> None:
        """Keep it, on all nodes or on none."""
        for name, node_id in self.nodes.items():
            try:
                if name not in self._kept:
                    ask_node(command, node_id, "save_foreground")
                elif not self._kept[name]:
                    ask_node(command, node_id, "revert_foreground", earlier=True)  # what was taken back
                self._kept[name] = True
            except RhotError as exc:
                problem = self._take_back(command)
                if problem:
                    raise EngineError(f"{exc} {problem}") from exc
                raise

    @property
    def way_back(self) -> str:
        """The nodes' own: one earlier state."""
        return tr("Each node keeps what it had, and Restore the old one brings it back here, until this window closes.")

    def restore(self, command: Command) -> None:
        """What was kept before. A node that does not answer keeps none of the others from it."""
        problem = self._take_back(command)
        if problem:
            raise EngineError(problem)

    def _take_back(self, command: Command) -> str:
        """On every node that has kept it; a sentence on those where that failed."""
        problems = []
        for name, kept in self._kept.items():
            try:
                if kept:
                    ask_node(command, self.nodes[name], "revert_foreground", earlier=True)
                    self._kept[name] = False
            except RhotError as exc:
                problems.append(tr("{name} still has what was learnt now: {exc}", name=name, exc=exc))
        return " ".join(problems)


def propose(empty: EmptyStep, skin: SkinStep) -> Proposal | None:
    """What both steps have learnt; None before."""
    verdict = skin.verdict
    if not (empty.learnt and skin.learnt) or verdict is None or empty.verdict is None:
        return None
    verdict = with_findings(verdict, empty.verdict.findings)
    rows = [row for name in empty.nodes
            for row in (
        Row(tr("{name}: background", name=name), _background(empty.before.get(name, {})), tr("learnt now")),
        Row(tr("{name}: skin", name=name), str(empty.before.get(name, {}).get("skin", "none")), tr("learnt now")))]
    return Proposal(FOREGROUND.reason, verdict, tuple(rows),
                    changes=(ForegroundChange(empty.nodes, empty.tried + skin.tried),),
                    afterwards=tr("Calibrate, Tracker chooses the bare hand."))


def _background(known: dict[str, Any]) -> str:
    return tr("learnt earlier") if known.get("background") else "none"
