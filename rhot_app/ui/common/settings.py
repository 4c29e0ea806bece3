"""What the app remembers between runs, in one INI file of the user's configuration folder: rig, layout, look."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from platformdirs import user_config_path, user_documents_path
from PySide6.QtCore import QByteArray, QObject, QSettings, Signal

from rhot_app.ui.language import tr_noop

_FILE = "app.ini"
STARTS: Final = (("page", tr_noop("The first page")), ("last", tr_noop("The rig that was opened last")),
                 ("twin", tr_noop("The simulated rig")))
"""What can be opened at the start, with its title."""


class Settings(QObject):
    """Remembered values with their defaults. `reset` forgets them all. `flag_changed` gives a switch's name."""

    flag_changed = Signal(str)

    def __init__(self, path: Path | None = None) -> None:
        super().__init__()
        self.path = path or user_config_path("rhot", appauthor=False) / _FILE
        self._store = QSettings(str(self.path), QSettings.Format.IniFormat)

    def reset(self) -> None:
        """Forget everything, as on the first start."""
        self._store.clear()
        self._store.sync()

    def sync(self) -> None:
        """Write to disk now."""
        self._store.sync()

    def _text(self, key: str, default: str) -> str:
        value = self._store.value(key, default)
        return value if isinstance(value, str) else default

    @property
    def last_rig(self) -> str:
        """Path of the rig file opened last, "" for none."""
        return self._text("rig/last", "")

    @last_rig.setter
    def last_rig(self, path: str) -> None:
        self._store.setValue("rig/last", path)

    @property
    def scheme(self) -> str:
        """"dark" or "light"."""
        return self._text("look/scheme", "dark")

    @scheme.setter
    def scheme(self, name: str) -> None:
        self._store.setValue("look/scheme", name)

    @property
    def language(self) -> str:
        """Code of the language of the window, "system" for the desktop's."""
        return self._text("look/language", "system")

    @language.setter
    def language(self, code: str) -> None:
        self._store.setValue("look/language", code)

    @property
    def start(self) -> str:
        """What is opened when the app starts, one of `STARTS`."""
        name = self._text("start/open", "page")
        return name if name in dict(STARTS) else "page"

    @start.setter
    def start(self, name: str) -> None:
        self._store.setValue("start/open", name)

    @property
    def recordings_folder(self) -> Path:
        """Where recordings are made; it may not exist yet."""
        chosen = self._text("folders/recordings", "")
        return Path(chosen) if chosen else user_documents_path() / "RHOT"

    @property
    def exports_folder(self) -> Path | None:
        """Where exported files are offered to be written; None: beside their recording."""
        chosen = self._text("folders/exports", "")
        return Path(chosen) if chosen else None

    def choose_folder(self, name: str, path: Path | None) -> None:
        """Another folder of "recordings" or "exports"; None: as on the first start."""
        self._store.setValue(f"folders/{name}", "" if path is None else str(path))

    def key(self, action: str) -> str | None:
        """The key that the person chose for an action, "" for no key; None: the one that it was made with."""
        return self._text(f"keys/{action}", "") if self._store.contains(f"keys/{action}") else None

    def set_key(self, action: str, key: str | None) -> None:
        """Remember the key of an action; None forgets it."""
        if key is None:
            self._store.remove(f"keys/{action}")
        else:
            self._store.setValue(f"keys/{action}", key)

    @property
    def motion(self) -> str:
        """Motion of the simulated hand chosen last."""
        return self._text("twin/motion", "grasp")

    @motion.setter
    def motion(self, name: str) -> None:
        self._store.setValue("twin/motion", name)

    @property
    def video(self) -> bool:
        """Whether recordings have video."""
        return self._text("record/video", "no") == "yes"

    @video.setter
    def video(self, on: bool) -> None:
        self._store.setValue("record/video", "yes" if on else "no")

    def flag(self, name: str, default: bool = True) -> bool:
        """A switch of the View menu."""
        return self._text(f"view/{name}", "yes" if default else "no") == "yes"

    def set_flag(self, name: str, value: bool) -> None:
        """Remember a switch of the View menu."""
        self._store.setValue(f"view/{name}", "yes" if value else "no")
        self.flag_changed.emit(name)

    def remembered(self, name: str) -> str:
        """What a wizard remembers by this name, "" for nothing."""
        return self._text(f"wizards/{name}", "")

    def remember(self, name: str, text: str) -> None:
        """Have a wizard's entry there the next time."""
        self._store.setValue(f"wizards/{name}", text)

    def layout(self) -> tuple[QByteArray, QByteArray] | None:
        """Window geometry and dock layout; None when nothing is remembered."""
        geometry, state = self._store.value("window/geometry"), self._store.value("window/state")
        if isinstance(geometry, QByteArray) and isinstance(state, QByteArray):
            return geometry, state
        return None

    def set_layout(self, geometry: QByteArray, state: QByteArray) -> None:
        """Remember window geometry and dock layout."""
        self._store.setValue("window/geometry", geometry)
        self._store.setValue("window/state", state)

    def forget_layout(self) -> None:
        """Back to the standard layout at the next start."""
        self._store.remove("window")
