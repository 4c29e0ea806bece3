"""A scene as a file: what differs from the twin's defaults, what stands before the cameras, and the seed.

``--scene FILE`` reads it, and `--set NAME=VALUE` changes one field of it (docs/twin.md). The ``shot.json`` that every
simulated recording has is one, too. Whatever cannot be is said of the option or file that asked for it.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, get_args, get_type_hints

import msgspec

from rhot_app.calibration.board.standard_board import BOARD, CHARUCO
from rhot_app.errors import SimulatorError
from rhot_app.simulator.scene.motion_file import find_motion
from rhot_app.simulator.scene.scene import Scene, TwinSettings, make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BareHandShow, HandShow, Show
from rhot_node.files import decode_document, decode_json, in_words, read_document_bytes, write_document

FORMAT: Final = "rhot-scene"
VERSION: Final = 1
SHOT_FORMAT: Final = "rhot-shot"
SHOW: Final = "show."
_UNKNOWN: Final = re.compile(r"unknown field `([^`]*)`")


class SceneFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """``scene.json``. `settings`: fields of resources/twin/defaults.json that differ from it. `show`: what stands
    before the cameras, told apart by its field "show"."""

    settings: dict[str, Any] = {}
    show: dict[str, Any] = {}
    seed: int = 1
    format: Literal["rhot-scene"] = FORMAT
    version: Literal[1] = VERSION


class _ShotScene(msgspec.Struct, frozen=True):
    """What a ``shot.json`` says of its scene."""

    settings: dict[str, Any]
    seed: int
    show: dict[str, Any] = {}


@dataclass
class SceneFields:
    """The fields of a scene, and which option or file asked for each."""

    settings: dict[str, Any] = field(default_factory=dict)
    show: dict[str, Any] = field(default_factory=dict)
    seed: int = 1
    origins: dict[str, str] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)

    def set(self, name: str, value: Any, origin: str, text: str | None = None) -> None:
        """Choose one field, `lamp.kelvin` of the settings or `show.tone` of what is shown; `seed` is the seed. `text`:
        what was read as the value, which a field of text takes itself."""
        if name == "seed":
            self.seed = _seed(value, origin)
            return
        place, *path = self._path(name)
        *outer, last = path
        for key in outer:
            place = place.setdefault(key, {})
            if not isinstance(place, dict):
                raise SimulatorError(f"{origin}: {key} has no fields.")
        place[last] = value
        self.origins = {known: one for known, one in self.origins.items() if not known.startswith(f"{name}.")}
        self.origins[name] = origin
        self.texts.pop(name, None)
        if text is not None and not isinstance(value, str | None):
            self.texts[name] = text

    def _path(self, name: str) -> tuple[Any, ...]:
        shown = name.startswith(SHOW)
        return self.show if shown else self.settings, *name.removeprefix(SHOW if shown else "").split(".")

    def scene(self) -> Scene:
        """The scene. Raises RigError, SimulatorError."""
        self._take_texts(TwinSettings, self.settings, "")
        try:
            settings = msgspec.convert(_merged(msgspec.to_builtins(twin_defaults()), self.settings), TwinSettings)
        except msgspec.ValidationError as exc:
            raise SimulatorError(self._objection(str(exc), TwinSettings, "", "the scene")) from exc
        return make_scene(settings, self.seed)

    def shown(self) -> Show:
        """What stands before the cameras. Raises SimulatorError."""
        fields = {"show": "hand", **self.show}
        kind = next((one for one in get_args(Show) if one.__struct_config__.tag == fields["show"]), Show)
        self._take_texts(kind, fields, SHOW)
        if fields["show"] == "board":
            fields.setdefault("size", CHARUCO if fields.get("pattern") == "charuco" else BOARD)
        try:
            shown: Show = msgspec.convert(fields, kind)
            return shown
        except msgspec.ValidationError as exc:
            raise SimulatorError(self._objection(str(exc), kind, SHOW, f"--show {fields['show']}")) from exc

    def require(self) -> None:
        """Raises what `scene` and `shown` raise, and SimulatorError where there is no such motion of the hand."""
        self.scene()
        shown = self.shown()
        if isinstance(shown, HandShow | BareHandShow):
            find_motion(shown.motion)

    def _take_texts(self, kind: Any, fields: dict[str, Any], prefix: str) -> None:
        """Give the fields of text that a `kind` has the texts that could be read as something else (9,6, or 1)."""
        for name, hint in (get_type_hints(kind) if isinstance(kind, type) else {}).items():
            if prefix + name in self.texts and str in (hint, *get_args(hint)):
                fields[name] = self.texts[prefix + name]

    def _objection(self, problem: str, kind: Any, prefix: str, whole: str) -> str:
        """What msgspec says of a field of a `kind`, said of the option or file that chose it."""
        place, _, words = in_words(problem, kind).rpartition(": " if " - at " in problem else "\0")
        unknown = _UNKNOWN.search(problem)
        name = prefix + ".".join([*([place] if place else []), *([unknown[1]] if unknown else [])])
        pattern = re.escape(name).replace(re.escape("[...]"), r"(\.[^.]+)?") + r"(\..*)?"
        origin = next((origin for known, origin in self.origins.items() if re.fullmatch(pattern, known)), None)
        sentence = words if words.endswith((".", "?")) else f"{words}."
        return f"{whole} cannot be: {name}: {sentence}" if origin is None else f"{origin}: {sentence}"


def read_scene(path: Path) -> SceneFields:
    """The fields of a scene file, or of a recording's ``shot.json``. Raises SimulatorError."""
    data = read_document_bytes(path, SimulatorError)
    document = decode_json(data, str(path), SimulatorError)
    if isinstance(document, dict) and document.get("format") == SHOT_FORMAT:
        try:
            found: SceneFile | _ShotScene = msgspec.convert(document, _ShotScene)
        except msgspec.ValidationError as exc:
            raise SimulatorError(f"{path}: this is not a whole {SHOT_FORMAT} file ({exc}).") from exc
    else:
        found = decode_document(data, SceneFile, format_name=FORMAT, version=VERSION, where=str(path),
                                error=SimulatorError)
    fields = SceneFields()
    fields.set("seed", found.seed, f"{path}: seed")
    for prefix, chosen in (("", found.settings), (SHOW, found.show)):
        for name, value in _leaves(chosen):
            if prefix or name not in ("format", "version"):
                fields.set(prefix + name, value, f"{path}: {prefix}{name}")
    return fields


def write_scene(path: Path, fields: SceneFields) -> None:
    """Write a scene that can be as a file. Raises SimulatorError, RigError, OSError."""
    fields.scene()
    write_document(path, SceneFile(fields.settings, msgspec.to_builtins(fields.shown()), fields.seed))


def value_of(text: str) -> Any:
    """The value of `NAME=VALUE`: JSON where it is (3000, true, null), numbers between commas as a list, else text."""
    for attempt in (text, *([f"[{text}]"] if "," in text else [])):
        try:
            value = json.loads(attempt)
        except (ValueError, RecursionError):
            continue
        if not isinstance(value, dict):
            return value
    return text


def _seed(value: Any, origin: str) -> int:
    if type(value) is not int or not 0 <= value < 2**32:
        raise SimulatorError(f"{origin}: a seed is a whole number from 0 on.")
    return value


def _leaves(fields: dict[str, Any]) -> list[tuple[str, Any]]:
    """Each field by its dotted name; a group of fields gives its own."""
    found: list[tuple[str, Any]] = []
    for name, value in fields.items():
        found += [(f"{name}.{inner}", one) for inner, one in _leaves(value)] if isinstance(value, dict) and value else [
            (name, value)]
    return found


def _merged(fields: dict[str, Any], chosen: dict[str, Any]) -> dict[str, Any]:
    """The fields, changed where something was chosen."""
    return fields | {name: _merged(fields[name], value) if isinstance(value, dict) and isinstance(
        fields.get(name), dict) else value for name, value in chosen.items()}
