"""JSON files that people edit: read with errors that name file and field, written all at once or not at all."""

from __future__ import annotations

import contextlib
import json
import os
import re
import tempfile
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

import msgspec

T = TypeVar("T")

_PLACE = re.compile(r"(?P<what>.*) - at `\$\.?(?P<place>[^`]*)`", re.DOTALL)
_COMPLAINTS = (
    (re.compile(r"^Object contains unknown field `(.*)`$"),
     r'there is no field "\1"; is it misspelt, or in the wrong place?'),
    (re.compile(r"^Object missing required field `(.*)`$"), r'the field "\1" is missing.'),
    (re.compile(r"^Invalid (?:enum )?value (.*)$"), r"\1 is not one of the values that this field can have."),
)
_KIND = re.compile(r"`([^`]*)`")
_KINDS = {"int": "a whole number", "float": "a number", "str": "text", "bool": "true or false", "null": "null",
          "array": "a list", "object": "an object {...}"}


def resource_path(*parts: str) -> Path:
    """Path of a file that ships with the project, e.g. ``resource_path("markers", "rhot6.json")``."""
    return Path(str(files("resources").joinpath(*parts)))


def decode_document(data: bytes, kind: type[T], *, format_name: str, version: int, where: str,
                    error: type[Exception]) -> T:
    """Decode one versioned JSON document into the msgspec type `kind`.

    The document is an object whose ``format`` and ``version`` fields must equal the arguments; they are checked
    before anything else so that a wrong file is named as such. `where` (usually the path) begins every message.

    Raises `error` with a sentence that names the place and the field.
    """
    try:
        raw: Any = json.loads(data)
    except UnicodeDecodeError as exc:
        raise error(f"{where}: this is no text, so no {format_name} file. Is it the right file?") from exc
    except json.JSONDecodeError as exc:
        raise error(f"{where}: not valid JSON ({exc}). Is the file complete?") from exc
    if not isinstance(raw, dict) or raw.get("format") != format_name:
        found = raw.get("format") if isinstance(raw, dict) else type(raw).__name__
        raise error(f'{where}: this is not a "{format_name}" file (its "format" is {found!r}).')
    if raw.get("version") != version:
        raise error(f"{where}: version {raw.get('version')!r} of {format_name} is not supported; "
                    f"this program reads version {version}.")
    try:
        return msgspec.json.decode(data, type=kind)
    except msgspec.ValidationError as exc:
        raise error(f"{where}: {_in_words(str(exc), kind)}") from exc
    except msgspec.DecodeError as exc:
        raise error(f"{where}: {_not_strict(exc)}") from exc


def _not_strict(exc: msgspec.DecodeError) -> str:
    """JSON that Python's own reader lets pass: NaN and infinite numbers."""
    return f"not valid JSON ({exc}). NaN and Infinity are no numbers there."


def _in_words(message: str, kind: type) -> str:
    """What msgspec found wrong, field first, for people who edit the file; a message that is not its own stays."""
    match = _PLACE.fullmatch(message)
    what, place = (match["what"], match["place"]) if match else (message, "")
    values = _values_at(kind, place) if what.startswith("Invalid") else []
    for pattern, words in _COMPLAINTS:
        what = pattern.sub(words, what)
    if what.startswith("Expected `"):
        what = "expected" + _KIND.sub(_kind_in_words, what.removeprefix("Expected")).replace(", got", ", not") + "."
    if values:
        what = f"{what.removesuffix('.')}: {' or '.join(values)}."
    return f"{place}: {what}" if place else what


def _values_at(kind: type, place: str) -> list[str]:
    """The values that a field can have, as JSON, if they are few and known; `place` as in `nodes[...].kind`."""
    kinds = [msgspec.inspect.type_info(kind)]
    for name in [re.sub(r"\[.*", "", part) for part in place.split(".")]:
        kinds = [inner for one in kinds for inner in _members(one)]
        kinds = [field.type for one in kinds if isinstance(one, msgspec.inspect.StructType)
                 for field in one.fields if field.encode_name == name]
    return [json.dumps(value) for one in kinds for inner in _members(one)
            if isinstance(inner, msgspec.inspect.LiteralType) for value in inner.values]


def _members(kind: msgspec.inspect.Type) -> list[msgspec.inspect.Type]:
    """A type, or those that it is a union or a list of."""
    if isinstance(kind, msgspec.inspect.UnionType):
        return [inner for one in kind.types for inner in _members(one)]
    if isinstance(kind, msgspec.inspect.ListType | msgspec.inspect.VarTupleType):
        return _members(kind.item_type)
    return [kind]


def _kind_in_words(kinds: re.Match[str]) -> str:
    return " or ".join(_KINDS.get(kind, kind) for kind in kinds[1].split(" | "))


def read_document(path: Path, kind: type[T], *, format_name: str, version: int, error: type[Exception]) -> T:
    """Read and decode `path` as `decode_document` does; a missing or unreadable file is an `error` too."""
    try:
        data = path.read_bytes()
    except FileNotFoundError as exc:
        raise error(f"{path}: no such file.") from exc
    except OSError as exc:
        raise error(f"{path}: cannot be read ({exc.strerror}).") from exc
    return decode_document(data, kind, format_name=format_name, version=version, where=str(path), error=error)


def write_document(path: Path, document: Any) -> None:
    """Write a msgspec document as indented JSON, atomically: a reader sees the old file or the new one, whole."""
    write_atomically(path, msgspec.json.format(msgspec.json.encode(document), indent=2) + b"\n")


def write_atomically(path: Path, data: bytes, *, private: bool = False) -> None:
    """Write `data` to a temporary file beside `path`, flush it to disk, then rename it over `path`.

    A `private` file has mode 0600 from its first moment on; when root writes it, it belongs to the folder's owner.
    Raises OSError when the folder is missing or not writable; `path` is then unchanged.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")  # of mode 0600
    try:
        with os.fdopen(handle, "wb") as file:
            if private and os.geteuid() == 0:
                folder = path.parent.stat()
                os.fchown(file.fileno(), folder.st_uid, folder.st_gid)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if not private:
            mode = path.stat().st_mode & 0o777 if path.exists() else 0o644
            Path(name).chmod(mode)
        Path(name).replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(name).unlink()
        raise
