"""What the cameras saw at the moment that is shown, with the tracked hand drawn over it."""

from __future__ import annotations

from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget

from rhot_app.errors import RecordingError
from rhot_app.geometry.camera import CameraModel
from rhot_app.project import Rig
from rhot_app.sources.frame_sets import RecordedFilm
from rhot_app.sources.recorded_pictures import FilmReader
from rhot_app.state import HandState
from rhot_app.ui.language import tr
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.panels.camera_panel import CameraPanel, Skeleton
from rhot_app.ui.replay.run import CODES
from rhot_app.ui.replay.session import Replay


class FilmPanel(CameraPanel):
    """`show_run` whenever the run changes, `show_moment` for every state. `failure`: why there is no picture, ""."""

    def __init__(self, scheme: Scheme, parent: QWidget | None = None) -> None:
        super().__init__(scheme, parent)
        self.setProperty("guide", "recording")
        self.films: tuple[RecordedFilm, ...] = ()
        self.failure = ""
        self._cameras: dict[str, CameraModel] = {}
        self._readers: dict[str, FilmReader] = {}
        self._numbers: dict[str, int | None] = {}

    def show_run(self, replay: Replay | None) -> None:
        """Another recording, or another run of it; None for none."""
        self.failure = ""
        self.films = replay.run.tracked.films if replay is not None else ()
        for reader in self._readers.values():
            reader.close()
        self._readers = {}
        nodes = [replay.run.rig.nodes[film.camera] for film in self.films] if replay is not None else []
        self._cameras = {node.name: CameraModel.from_rig(node.intrinsics, node.pose) for node in nodes}
        self.show_rig(replay.run.rig if replay is not None and self.films else None)

    def show_rig(self, rig: Rig | None) -> None:
        """Views for the cameras of which there is a film."""
        super().show_rig(rig)
        self._numbers = {}
        for name, view in self.views.items():
            view.setVisible(name in self._cameras)
            view.setToolTip(tr("Camera {name}: the picture nearest to this moment, and the tracked hand. Dotted bones "
                               "are guessed.", name=name))

    def show_moment(self, t_master_ns: int, state: HandState | None) -> None:
        """The pictures of a moment, the master's clock, and the hand of its state."""
        hands = [] if state is None else [state] if state.other is None else [state, state.other]
        for film, (name, camera) in zip(self.films, self._cameras.items(), strict=True):
            view, number = self.views[name], film.number_at(t_master_ns)
            if number != self._numbers.get(name, -1):
                self._numbers[name] = number
                view.show_picture(self._picture(name, film, number))
            view.show_skeletons([Skeleton(camera.project(hand.joint_positions), hand.joint_knowledge)
                                 for hand in hands if hand.condition in CODES])

    def _picture(self, name: str, film: RecordedFilm, number: int | None) -> QImage:
        """A picture of a film, a null one where it has none."""
        picture = None
        try:
            if number is not None:
                if name not in self._readers:
                    self._readers[name] = FilmReader(film.video.source)
                picture = self._readers[name].picture(number)
        except RecordingError as exc:
            self.failure = str(exc)
        if picture is None:
            return QImage()
        height, width = picture.shape[:2]
        return QImage(picture.data, width, height, 3 * width, QImage.Format.Format_RGB888).copy()
