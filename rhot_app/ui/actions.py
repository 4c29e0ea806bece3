"""The window's actions with their icons, keys and tooltips, and the toolbar and the menu bar made of them."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject, QSize, Qt
from PySide6.QtGui import QAction, QActionGroup, QKeySequence, QPainter
from PySide6.QtWidgets import QLabel, QMenuBar, QSizePolicy, QToolBar, QToolButton, QWidget

from rhot_app.calibration.registry import calibrations
from rhot_app.ui.common.menu import Menu, give_letters
from rhot_app.ui.common.shapes import shape_icon, show_overflow
from rhot_app.ui.language import tr, tr_noop
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.panels.state_badge import StateBadge
from rhot_app.ui.scene.ellipsoid_mesh import LARGER
from rhot_app.ui.scene.page import SceneBar

CLOUD_KINDS = (
    ("joints", tr_noop("of joints"), tr_noop("Of the hand's inner joints; the estimator estimates them.")),
    ("fingertips", tr_noop("of fingertips"), tr_noop("Of the fingertips; the estimator estimates them.")),
    ("markers", tr_noop("of markers"), tr_noop("Of the markers, as far as they are not the fingertips drawn already.")))
"""Whose uncertainty can be drawn: name in the settings, title, meaning."""

_ICON_PX = 24  # wide, with some air between the sign and the word
_SOURCE_PX = 220  # of a long file's name no more is shown, so that the window's word stays in sight
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
_START_WORDS = tr_noop("Start"), tr_noop("Stop")  # idle, at work
_RECORD_WORDS = tr_noop("Record"), tr_noop("Stop recording")


class Actions(QObject):
    """Every action of the window; what they do is connected by the window."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._make_recording()
        self._make_simulated(parent)
        self._make_rig(parent)
        self._make_calibrate(parent)
        self._make_view()
        self._make_help()
        for action, role in ((self.settings, QAction.MenuRole.PreferencesRole), (self.quit, QAction.MenuRole.QuitRole),
                             (self.about, QAction.MenuRole.AboutRole)):
            action.setMenuRole(role)
        self._name()
        for alternatives in ([self.dark, self.light], self.cloud_sizes):
            group = QActionGroup(self)
            for action in alternatives:
                group.addAction(action)

    def _make_recording(self) -> None:
        """Start and stop, and what is recorded."""
        self.start = self._make(tr("Start"), "", tr("Tell the nodes to stream, or to stop."))
        self.record = self._make(tr("Record"), "R", tr("Write the raw log of all datagrams, or end it."))
        self.bookmark = self._make(tr("Bookmark"), "B", tr("Write a few words about this moment into the recording."))
        self.video = self._make(tr("Record video, too"), "",
                                tr("Each camera writes its own frames as long as the next recording lasts. Rig, "
                                   "Recordings fetches them afterwards."), checkable=True)

    def _make_simulated(self, parent: QWidget) -> None:
        """The simulated rig and its scene."""
        self.twin = self._make(tr("Simulated rig"), "",
                               tr("Start two simulated cameras that look at a simulated hand."))
        self.shows = Menu(tr("Simulated hand does"), parent)
        self.caps = Menu(tr("Cover a simulated camera"), parent)
        self.scene = Menu(tr("Scene of the simulated rig"), parent)
        self.open_scene = self._make(tr("Open a scene …"), "",
                                     tr("Start the simulated rig on a scene file: its light, its cameras, and what "
                                        "stands before them."))
        self.save_scene = self._make(tr("Save the scene …"), "",
                                     tr("Write what the simulated rig is and shows to a file. Commands that simulate "
                                        "read it with --scene."))
        self.scene.addActions([self.open_scene, self.save_scene])

    def _make_rig(self, parent: QWidget) -> None:
        """Rigs, recordings, outputs, the settings."""
        self.open = self._make(tr("Open rig file …"), "Ctrl+O", tr("Open a rig that was set up before."))
        self.own_cameras = self._make(tr("Cameras of this computer …"), "",
                                      tr("Choose webcams, films or network cameras, look at them, and track with "
                                         "them."))
        self.nodes = self._make(tr("Connect nodes …"), "", tr("Enter the addresses of two nodes, see whether they "
                                                              "answer, and write a rig file for them."))
        self.export = self._make(tr("Export recording …"), "Ctrl+E",
                                 tr("Write a recording's hand as a file for other programs: tables, motion capture, "
                                    "animation."))
        self.open_recording = self._make(tr("Open recording …"), "Ctrl+Shift+O",
                                         tr("Track a recording and play it, in a window of its own."))
        self.recordings = self._make(tr("Recordings …"), "",
                                     tr("All recordings: how long and how well tracked; open, rename, delete."))
        self.films = self._make(tr("Track films …"), "", tr("Track a bare hand in films that you have already, and "
                                                            "replay it beside their pictures."))
        self.outputs = self._make(tr("Outputs …"), "", tr("Live streams to other programs: OSC, VMC, WebSocket, web "
                                                          "view and others; which run, and how they go."))
        self.mouse = self._make(tr("3-D mouse …"), "", tr("Work a cursor in three dimensions with the hand: pick "
                                                          "balls, move them, and take a target test."))
        self.add_object = self._make(tr("Add a tracked object …"), "",
                                     tr("Track an object with tags or colour markers beside the hand: choose its "
                                        "object file."))
        self.objects = Menu(tr("Remove a tracked object"), parent)
        self.save_rig = self._make(tr("Save rig"), "Ctrl+S",
                                   tr("Write the rig as it is now to its file; what stood there is kept beside it."))
        self.close_rig = self._make(tr("Close rig"), "Ctrl+W",
                                    tr("End what the app started and go back to the first page."))
        self.settings = self._make(tr("Settings …"), "Ctrl+,", tr("Look, folders, what opens at the start, and keys."))
        self.quit = self._make(tr("Quit"), "Ctrl+Q", tr("End what the app started and close it."))

    def _make_calibrate(self, parent: QWidget) -> None:
        """Calibrations, and what the rig file says."""
        self.next_steps = self._make(tr("What to do next …"), "",
                                     tr("Say what you have, and see the steps that are missing."))
        self.wizards = [self._make(f"{tr(wizard.title)} …", "", tr(wizard.meaning)) for wizard in calibrations()]
        self.fit = self._make(tr("Fit the hand to pictures …"), "",
                              tr("Drag joints in the cameras' pictures, move sliders, and let edges finish it: the "
                                 "hand's lengths and pose."))
        self.earlier = self._make(tr("Bring back an earlier calibration …"), "",
                                  tr("Every calibration keeps what it replaced; choose one by date and reason."))
        self.tracker = self._make(tr("Tracker …"), "",
                                  tr("Which tracker makes a hand of the markers, and what it may assume."))
        self.networks = self._make(tr("Hand networks …"), "",
                                   tr("Install the networks that find landmarks of a bare hand on this computer."))
        self.cameras = self._make(tr("Cameras …"), "", tr("Lenses and positions that the rig file says."))
        self.markers = self._make(tr("Markers …"), "", tr("The marker set that the rig file says."))
        self.hand = self._make(tr("Hand …"), "", tr("The hand's bones that the rig file says."))
        self.properties = Menu(tr("Properties"), parent)
        self.properties.menuAction().setToolTip(tr("What the rig file says, to read."))
        self.properties.addActions([self.cameras, self.markers, self.hand])
        self.files = self._make(tr("How to calibrate"), "", tr("Opens the guide."))

    def _make_view(self) -> None:
        """What is drawn, and how."""
        self.frame = self._make(tr("Frame the hand"), "F", tr("Bring the hand into the middle of the scene."))
        self.home = self._make(tr("Reset the view"), "Home", tr("Back to the view from behind the cameras."))
        self.names = self._make(tr("Marker names"), "", tr("Names beside the markers in the scene."), checkable=True)
        self.now = self._make(tr("Hand as of now"), "N", tr("Draw the hand where it is when you see it, not where it "
                                                            "was in the newest pictures, 10 to 40 ms before. The "
                                                            "estimator predicts it."), checkable=True)
        self.clouds = self._make(tr("Uncertainty"), "U", tr("How well places are known, as ellipsoids: the true place "
                                                            "lies inside in 97 of 100 cases (three sigma)."),
                                 checkable=True)
        self.cloud_kinds = [self._make(tr(title), "", tr(meaning), checkable=True) for _, title, meaning in CLOUD_KINDS]
        self.cloud_sizes = [
            self._make("1 ×", "", tr("Ellipsoids in true size."), checkable=True),
            self._make(f"{LARGER} ×", "", tr("Ellipsoids {larger} times as large, because a good place is known to a "
                                             "millimetre.", larger=LARGER), checkable=True)]
        self.layers = self._make(tr("Layers of the hand …"), "",
                                 tr("Which link of the tracked hand hides which before a camera, as masks over its "
                                    "picture."))
        self.alone = self._make(tr("Scene alone"), "6",
                                tr("Hide every panel, to look from afar; again brings them back."), checkable=True)
        self.dark = self._make(tr("Dark"), "", tr("Light text on dark ground."), checkable=True)
        self.light = self._make(tr("Light"), "", tr("Dark text on light ground."), checkable=True)
        self.reset = self._make(tr("Reset layout and settings"), "", tr("Forget layout, last rig and switches."))

    def _make_help(self) -> None:
        """The guide and the versions."""
        self.guide = self._make(tr("Guide"), "F1", tr("The page of the guide that explains the panel in use."))
        self.keys = self._make(tr("Keys"), "", tr("The guide's page about keys."))
        self.about = self._make(tr("About RHOT …"), "", tr("Versions for a report of a fault, and licences."))

    def _make(self, text: str, key: str, meaning: str, *, checkable: bool = False) -> QAction:
        action = QAction(text, self)
        action.setCheckable(checkable)
        action.setToolTip(meaning)
        if key:
            action.setShortcut(QKeySequence(key))
        return action

    def _name(self) -> None:
        """Names by which settings know the actions."""
        for name, action in vars(self).items():
            if isinstance(action, QAction):
                action.setObjectName(name)
        for prefix, actions, names in (("wizard", self.wizards, [wizard.name for wizard in calibrations()]),
                                       ("cloud", self.cloud_kinds, [kind for kind, _, _ in CLOUD_KINDS]),
                                       ("cloud", self.cloud_sizes, ["in true size", "larger"])):
            for action, name in zip(actions, names, strict=True):
                action.setObjectName(f"{prefix} {name}")

    def all(self) -> list[QAction]:
        """Every action, so that the window knows their keys."""
        return [child for child in self.children() if isinstance(child, QAction)]

    def scene_bar(self) -> SceneBar:
        """The scene's own toolbar."""
        return SceneBar(self.clouds, self.cloud_kinds, self.cloud_sizes, [self.names])


class _ElidingLabel(QLabel):
    """One line of text at the right that ends in an ellipsis where the toolbar has no room for all of it."""

    def sizeHint(self) -> QSize:  # noqa: N802
        """No width of its own, only what the others leave: the menus are whole before it is."""
        return QSize(0, super().sizeHint().height())

    def minimumSizeHint(self) -> QSize:  # noqa: N802
        """The same: a toolbar hides its last widgets when the others cannot become narrower."""
        return self.sizeHint()

    def paintEvent(self, event: object) -> None:  # noqa: N802
        """The text as far as it fits."""
        text = self.fontMetrics().elidedText(self.text(), Qt.TextElideMode.ElideRight, self.width())
        painter = QPainter(self)
        self.style().drawItemText(painter, self.rect(), _RIGHT, self.palette(), self.isEnabled(),
                                  text, self.foregroundRole())
        painter.end()


class MainMenuBar(QMenuBar):
    """Rig, Calibrate, View, Help: at the top of the screen where the platform has its menus there, else in the toolbar.

    `panels` are the switches of the panels.
    """

    def __init__(self, actions: Actions, panels: Sequence[QAction], parent: QWidget) -> None:
        super().__init__(parent)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        a = actions
        self.rig = self._add(tr("Rig"), [
            a.twin, a.own_cameras, a.open, a.nodes, None, a.open_recording, a.recordings, a.films, a.video, a.bookmark,
            a.export, None, a.add_object, a.objects.menuAction(), None,
            a.outputs, a.mouse, a.shows.menuAction(), a.caps.menuAction(), a.scene.menuAction(),
            a.properties.menuAction(), a.save_rig, a.close_rig, None, a.settings, a.quit])
        self.calibrate = self._add(tr("Calibrate"), [
            a.next_steps, None, *a.wizards, a.fit, None, a.earlier, None, a.tracker, a.networks, None, a.files])
        self.view = self._add(tr("View"), [
            *panels, a.alone, None, a.frame, a.home, a.names, a.clouds, a.now, a.layers, None,
            a.dark, a.light, None, a.reset])
        self.help = self._add(tr("Help"), [a.guide, a.keys, None, a.about])
        give_letters(self.actions())

    def _add(self, title: str, entries: Sequence[QAction | None]) -> Menu:
        menu = Menu(title, self)
        menu.fill(entries)
        self.addMenu(menu)
        return menu


class MainToolBar(QToolBar):
    """Start, Record and the menus, which so take no height of their own; at the right the rig's name and the state.

    In a narrow window the menus that do not fit stand behind an arrow; the state stays in sight.
    """

    def __init__(self, actions: Actions, menus: MainMenuBar, scheme: Scheme, parent: QWidget) -> None:
        super().__init__(tr("Main"), parent)
        self.setObjectName("main toolbar")
        self.setMovable(False)
        self.setFloatable(False)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.PreventContextMenu)
        self.setIconSize(QSize(_ICON_PX, 18))
        self.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self._changing = (actions.start, actions.record)
        self.addActions(self._changing)
        self.addSeparator()
        self.menus = menus
        self.addWidget(menus)
        self.source_label = QToolButton()
        self.source_label.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.source_label.clicked.connect(actions.bookmark.trigger)
        self._source_place = self.addWidget(self.source_label)
        self._source_place.setVisible(False)
        self.rig_label = _ElidingLabel("")
        self.rig_label.setProperty("muted", True)
        self.rig_label.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        self.addWidget(self.rig_label)
        self.show_rig("", "", edited=False)
        self.badge = StateBadge(scheme)
        self.addWidget(self.badge)
        self.set_scheme(actions, scheme, running=False, recording=False)

    def show_rig(self, name: str, path: str, *, edited: bool) -> None:
        """Name of the rig, "" for none; `edited` says that its file does not say the same."""
        text = tr("rig: {name} (edited)", name=name) if edited else tr("rig: {name}", name=name) if name else ""
        text += "  " if text else ""
        if text != self.rig_label.text() or path not in self.rig_label.toolTip():
            self.rig_label.setText(text)
            unsaved = tr("The engine's rig differs from this file; Rig, Save rig writes it.") if edited else ""
            self.rig_label.setToolTip(f"{path}\n{unsaved}".rstrip())

    def show_source(self, text: str, meaning: str) -> None:
        """That what is seen is being recorded, or is a replay; "" for neither. While recording a click sets a bookmark.
        """
        text = self.source_label.fontMetrics().elidedText(text, Qt.TextElideMode.ElideMiddle, _SOURCE_PX)
        if text != self.source_label.text():
            self.source_label.setText(text)
            self.source_label.setToolTip(meaning)
            self._source_place.setVisible(bool(text))

    def set_scheme(self, actions: Actions, scheme: Scheme, *, running: bool, recording: bool) -> None:
        """Words and icons of the two buttons that change."""
        self._fix_widths(scheme)
        actions.start.setText(tr(_START_WORDS[running]))
        actions.start.setIcon(shape_icon("stop" if running else "play", scheme.accent, width=_ICON_PX))
        actions.record.setText(tr(_RECORD_WORDS[recording]))
        actions.record.setIcon(shape_icon("stop" if recording else "disc", scheme.fault, width=_ICON_PX))
        show_overflow(self.menus, scheme.text)
        self.badge.set_scheme(scheme)
        self.source_label.setStyleSheet(f"color: {scheme.accent}; font-weight: 700;")

    def _fix_widths(self, scheme: Scheme) -> None:
        """A button whose word changes is as wide as its longest, or the menus would move under the mouse."""
        for action, words in zip(self._changing, (_START_WORDS, _RECORD_WORDS), strict=True):
            button = self.widgetForAction(action)
            action.setIcon(shape_icon("stop", scheme.accent, width=_ICON_PX))
            widths = []
            for word in words:
                action.setText(tr(word))
                widths.append(button.sizeHint().width())
            button.setFixedWidth(max(widths))
