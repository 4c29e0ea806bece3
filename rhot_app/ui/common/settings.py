"""What the app remembers between runs, in one INI file of the user's configuration folder: rig, layout, look."""

from __future__ import annotations

from pathlib import Path

from platformdirs import user_config_path
from PySide6.QtCore import QByteArray, QSettings

_FILE = "app.ini"


class Settings:
    """Remembered values with their defaults. `reset` forgets them all."""

    def __init__(self, path: Path | None = None) -> None:
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
