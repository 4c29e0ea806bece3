"""The first page: a person shows which paint is which marker, and moves the hand until enough of it was seen."""

from __future__ import annotations

import msgspec

from rhot_app.calibration.colour.gathering import ColourGathering
from rhot_app.calibration.colour.identity import Identity, identify
from rhot_app.calibration.colour.separability import SKIN
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.common.parts import plain_button
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.rows import marker_name
from rhot_app.ui.wizards.colours.masks import MaskChoice, MaskedPictures, MaskMaker, Show, annotated_by_masks, drift_of
from rhot_app.ui.wizards.colours.paint_list import PaintList, PaintRow
from rhot_app.ui.wizards.framework.page import Page, shrinkable
from rhot_app.ui.wizards.framework.step import AnnotatedPicture, Bar, Pictures, Step, StepView
from rhot_node.detect.colour import learn_chroma_from_colours
from rhot_node.detect.image import from_bgr
from rhot_node.markers import MarkerSet

_CLICK_PX = 5.0  # a drag that is smaller was a click
_PARTS = 10  # of a marker's variety after which its colour is learnt anew


class PickStep(Step):
    """Every marker of the set in turn: choose it, click its paint. Space holds the pictures, to click in them."""

    title = tr_noop("Pick the colours")
    watches = captures = True

    def __init__(self, markers: MarkerSet, cameras: tuple[str, ...]) -> None:
        self.cameras = cameras
        self.base = markers
        self.gathering = ColourGathering(cameras)
        self.chosen = markers.ids[0]
        self.show: Show = "all"
        self.problem = ""
        self.held: dict[str, Picture] = {}
        self._live: Pictures = {}
        self._holding = False  # also before the first pictures came, which are held then
        self._masked: MaskedPictures = {}
        self._maker = MaskMaker()
        self._markers = markers
        self._learnt: dict[str, tuple[int, int]] = {}
        self.identity = Identity((), {}, ())

    @property
    def names(self) -> tuple[str, ...]:
        """What can be picked: the markers and, for comparison, bare skin."""
        return (*self.base.ids, SKIN)

    @property
    def masked(self) -> MaskedPictures:
        """What the cameras' detectors found last."""
        return self._masked

    @property
    def markers(self) -> MarkerSet:
        """The set whose mask is shown: new colours where there are samples, the old ones elsewhere."""
        return self._markers

    @property
    def keeps(self) -> bool:
        """Picking takes a person a minute."""
        return bool(self.gathering.names)

    def observe(self, pictures: Pictures) -> tuple[Pictures, MaskedPictures]:
        """The mask; the detectors are the picture worker's own."""
        return pictures, self._maker.look(self.held or pictures, self._markers, tuple(self._learnt))

    def accept_observation(self, seen: tuple[Pictures, MaskedPictures]) -> None:
        """Gather where markers show something new."""
        self._live, self._masked = seen
        if self._holding and not self.held:
            self.held = dict(self._live)
        if not self.held:
            self.gathering.follow({name: picture.image for name, picture in self._masked.items()})
        self._learn()

    def capture(self) -> bool:
        """Hold the pictures, or let them go on."""
        self._holding = not self._holding
        self.held = dict(self._live) if self._holding else {}
        return bool(self.held)

    def pick(self, picture: Picture, x: float, y: float, width: float, height: float) -> bool:
        """The chosen marker's paint is there in `picture`, px; whether it could be taken. The next one is chosen."""
        click = max(width, height) < _CLICK_PX
        where = (x, y) if click else (round(x), round(y), round(x + width) + 1, round(y + height) + 1)
        try:
            self.gathering.pick(self.chosen, picture.camera, from_bgr(picture.bgr), where)
        except CalibrationError as exc:
            self.problem = str(exc)
            return False
        self.problem = ""
        self._learn()
        self._identify()
        self._choose_next()
        return True

    def undo(self) -> bool:
        """Take the last pick back, and choose what it was for."""
        name = self.gathering.take_back()
        if name is None:
            return False
        self.chosen, self.problem = name, ""
        self._learn()
        self._identify()
        return True

    @property
    def undoable(self) -> bool:
        """Whether there is a pick to take back."""
        return bool(self.gathering.names) or bool(len(self.gathering.skin))

    def _choose_next(self) -> None:
        """The next line, whether or not it was picked already: who clicks on in order goes on in order."""
        self.chosen = self.names[min(self.names.index(self.chosen) + 1, len(self.names) - 1)]

    def _learn(self) -> None:
        """A quick model of every marker, renewed as samples come."""
        parts = {name: (self.gathering.last_pick(name), int(_PARTS * self.gathering.variety(name)))
                 for name in self.gathering.names}
        if parts == self._learnt:
            return
        self._learnt = parts
        samples = {one.name: one for one in self.gathering.samples}
        self._markers = msgspec.structs.replace(self.base, markers=tuple(
            marker if marker.id not in samples else msgspec.structs.replace(
                marker, chroma=learn_chroma_from_colours(samples[marker.id].colours),
                display_rgb=samples[marker.id].rgb)
            for marker in self.base.markers))

    def _identify(self) -> None:
        """Whose colour is whose, among the markers picked so far."""
        gathering = self.gathering
        models = {marker.id: marker.chroma for marker in self._markers.markers if marker.id in gathering.names}
        rig = {marker.id: (marker.chroma,) for marker in self.base.markers}
        self.identity = identify(gathering.samples, gathering.views, models, (gathering.earlier, rig))

    def doubt(self, name: str) -> str:
        """In a few words, what is wrong with a marker's colour; empty when nothing is."""
        if name in self.identity.skin:
            return tr("as skin")
        same = [pair for pair in self.identity.same if name in pair[:2]]
        if same:
            return tr("as {other}", other=marker_name(same[0][1] if same[0][0] == name else same[0][0]))
        return next((tr("was {other}'s", other=marker_name(other)) for marker, other in self.identity.taken
                     if marker == name), "")

    def _verdict(self) -> Verdict | None:
        """What is wrong with the colours picked so far; None when nothing is."""
        again = tr("Click the right paint; Ctrl+Z takes the last click back.")
        findings = [Finding("skin", Grade.POOR, tr("{name} has the colour of skin: {shown}.",
                                                        name=marker_name(name), shown=shown),
                            "", again) for name, shown in self.identity.skin.items()]
        findings += [Finding("same-colour", Grade.POOR, tr("{first} and {second} have one colour: their hues are "
                                                           "{apart:.0f}° apart.", first=marker_name(first),
                                                           second=marker_name(second), apart=apart), "", again)
                     for first, second, apart in self.identity.same]
        if self.identity.exchanged:
            findings.append(Finding("exchanged", Grade.FAIR, self.identity.exchanged, "",
                                    tr("If the hand does not wear them so, click these again.")))
        doubtful = [name for name in self.base.ids if self.doubt(name)]
        again = tr("look at {names} again.", names=", ".join(map(marker_name, doubtful)))
        return judge(again, findings) if findings else None

    @property
    def _wrong(self) -> str:
        """The first marker whose colour cannot stay; empty when there is none."""
        wrong = {*self.identity.skin, *(name for pair in self.identity.same for name in pair[:2])}
        return next((name for name in self.base.ids if name in wrong), "")

    def view(self) -> StepView:
        """Which paint to show next, and how much has been seen of those named."""
        names, gathering = self.gathering.names, self.gathering
        seen = sum(gathering.variety(name) for name in names) / len(names) if names else 0.0
        bars = (Bar(tr("picked"), len(names) / len(self.base.ids),
                    tr("{picked} of {count} markers", picked=len(names), count=len(self.base.ids))),
                Bar(tr("seen moving"), seen, tr("places and angles at which the markers were seen so far")))
        return StepView(self._sentence(),
                        done=gathering.enough and len(names) == len(self.base.ids) and not self._wrong,
                        passable=bool(names), hint=self.problem or self._hint(), bars=bars, verdict=self._verdict(),
                        annotated=self._annotated(), pictures=self.held)

    def _sentence(self) -> str:
        if self.held:
            return tr("Click {paint} in the held picture.", paint=self._paint())
        if len(self.gathering.names) < len(self.base.ids):
            return tr("Click {paint}, or drag over it.", paint=self._paint())
        if self._wrong:
            return tr("Choose {marker} and click its paint.", marker=marker_name(self._wrong))
        if not self.gathering.enough:
            return tr("Move and turn the hand slowly, near and far.")
        return tr("Enough: press Next.")

    def _paint(self) -> str:
        return tr("bare skin") if self.chosen == SKIN else tr(
            "the paint of {chosen}", chosen=marker_name(self.chosen))

    def _hint(self) -> str:
        if self._wrong:
            return tr("{marker} cannot stay so: choose its line and click its paint, or press Ctrl+Z.",
                      marker=marker_name(self._wrong))
        if self.gathering.names and not len(self.gathering.skin):
            return tr("Pick bare skin too: then it is said whether a marker looks like it.")
        drift = () if self.gathering.names else drift_of(self._masked)
        if drift:
            return tr("By the rig's colours: {figure}", figure=drift[0].figure)
        if not self.gathering.names:
            return tr("Space holds the pictures, if your hands are full.")
        unseen = [tr("{camera} has not seen {name}: {why}", camera=camera, name=marker_name(name),
                     why=picture.why(self.base.ids.index(name))) for camera,
                  picture in self._masked.items() for name in self.gathering.unseen_by(camera)
                  if picture.why(self.base.ids.index(name))]
        if unseen:
            return unseen[0]
        missing = [marker_name(name) for name in self.gathering.names if self.gathering.variety(name) < 1.0]
        return tr("Still to be seen in other places: {names}.", names=", ".join(missing)) if missing else ""

    def _annotated(self) -> dict[str, AnnotatedPicture]:
        chosen = self.base.ids.index(self.chosen) if self.show == "chosen" and self.chosen != SKIN else None
        return annotated_by_masks(self._masked, self._markers, chosen, self.show)


class PickPage(Page):
    """Choose a marker in the list, click its paint in a picture."""

    def __init__(self, step: PickStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._picks = step
        self.pickable = self.one_large = True
        self.list = PaintList(scheme, (tr_noop("marker"), tr_noop("pictures")))
        self.list.setToolTip(tr("Choose what to click next. The patches are the rig's colour and the one picked. A "
                                "tick: enough places and angles were seen; a cross: the colour is another marker's or "
                                "the skin's. Ctrl+Z takes the last click back; clicking a marker anew replaces what "
                                "was gathered for it."))
        self.mask_choice = MaskChoice()
        self.hold = plain_button(tr("Hold the pictures"), tr("Space. Then click at leisure; Space again lets them go "
                                                             "on."))
        self.undo_button = plain_button(tr("Undo"), tr("Ctrl+Z. The last click back."))
        for widget in (self.list, self.mask_choice, self.hold, self.undo_button):
            self.column.addWidget(widget, 1 if widget is self.list else 0)
        shrinkable(self.list)
        self.list.picked.connect(self._choose)
        self.mask_choice.currentIndexChanged.connect(self._show)
        self.hold.clicked.connect(self._hold)
        self.undo_button.clicked.connect(self._undo)

    def _choose(self, name: str) -> None:
        self._picks.chosen = name
        self.changed.emit()

    def _show(self) -> None:
        self._picks.show = self.mask_choice.currentData()
        self.changed.emit()

    def _hold(self) -> None:
        self._picks.capture()
        self.changed.emit()

    def _undo(self) -> None:
        self._picks.undo()
        self.changed.emit()

    def pick(self, picture: Picture, x: float, y: float, width: float, height: float) -> None:
        """The chosen marker is there."""
        self._picks.pick(picture, x, y, width, height)

    def show_view(self, view: StepView) -> None:
        """The list; the button says what it would do."""
        self.list.show_rows(tuple(self._row(name) for name in self._picks.names), self._picks.chosen)
        self.hold.setText(tr("Let the pictures go on") if view.pictures else tr("Hold the pictures"))
        self.undo_button.setEnabled(self._picks.undoable)

    def _row(self, name: str) -> PaintRow:
        gathering = self._picks.gathering
        if name == SKIN:
            count = len(gathering.skin)
            return PaintRow(name, None, "tick" if count else "ring", tr("picked") if count else tr("not picked"))
        index = self._picks.base.ids.index(name)
        before, now = (markers.markers[index].display_rgb for markers in (self._picks.base, self._picks.markers))
        if name not in gathering.names:
            return PaintRow(name, None, "ring", tr("not picked"), before)
        doubt = self._picks.doubt(name)
        state = "cross" if doubt else "tick" if gathering.variety(name) >= 1.0 else "half"
        return PaintRow(name, now, state, doubt or str(gathering.pictures(name)), before)
