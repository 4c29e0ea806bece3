"""Files that people name: only regular ones are read and replaced, and a file is written all at once or not at all.

JSON documents among them are read with limits, and with errors that name file and field.
"""

from __future__ import annotations

import contextlib
import errno
import json
import math
import os
import re
import stat
import tempfile
import zipfile
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any, BinaryIO, Final, TypeVar

import msgspec

from rhot_node.errors import nearest, printable

T = TypeVar("T")

KIB: Final = 1 << 10
MIB: Final = 1 << 20
"""Bytes (IEC 80000-13)."""

BYTES_MAX: Final = 256 * MIB
"""Of a file that is read as a whole: an uncompressed picture of a large camera, a network."""

TABLE_BYTES_MAX: Final = 64 * MIB
TABLE_LINES_MAX: Final = 1_000_000
"""Of a text table: an hour of landmarks at 100 Hz has a third of either."""

ARRAYS_BYTES_MAX: Final = 512 * MIB
"""Of the arrays in an archive, unpacked."""

JSON_BYTES_MAX: Final = 16 * MIB
JSON_DEPTH_MAX: Final = 64
"""Objects and lists within each other; the deepest of our documents has nine."""

PRINTABLE: Final = r"\A[^\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]*\Z"
"""Pattern of a field that people read: no control characters, also not those that turn the direction of writing."""

_READABLE = stat.S_IRUSR | stat.S_IWUSR | stat.S_IRGRP | stat.S_IROTH
_STRING = re.compile(rb'"(?:[^"\\]++|\\.)*+"', re.DOTALL)
_BRACKETS = re.compile(rb"[\[\]{}]")
_OTHER_FILES = ((stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISSOCK, "a socket"),
                (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"))

_PLACE = re.compile(r"(?P<what>.*) - at `\$\.?(?P<place>[^`]*)`", re.DOTALL)
_COMPLAINTS = (
    (re.compile(r"^Object missing required field `(.*)`$"), r'the field "\1" is missing.'),
    (re.compile(r"^Invalid (?:enum )?value (.*)$"), r"\1 is not one of the values that this field can have."),
)
_UNKNOWN_FIELD = re.compile(r"^Object contains unknown field `(.*)`$", re.DOTALL)
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
    raw = decode_json(data, where, error, format_name)
    if not isinstance(raw, dict) or raw.get("format") != format_name:
        found = raw.get("format") if isinstance(raw, dict) else type(raw).__name__
        raise error(f'{where}: this is not a "{format_name}" file (its "format" is {_brief(found)}).')
    if raw.get("version") != version:
        raise error(f"{where}: version {_brief(raw.get('version'))} of {format_name} is not supported; "
                    f"this program reads version {version}.")
    try:
        return msgspec.json.decode(data, type=kind)
    except msgspec.ValidationError as exc:
        raise error(f"{where}: {printable(in_words(str(exc), kind))}") from exc
    except msgspec.DecodeError as exc:
        raise error(f"{where}: {_not_strict(exc)}") from exc


def decode_json(data: bytes, where: str, error: type[Exception], format_name: str = "JSON") -> Any:
    """Any JSON document as Python's objects. `where` begins every message; `format_name` says what was expected.

    Raises `error`: not JSON, more than 16 MiB, nested deeper than 64, or a number that is not finite.
    """
    if len(data) > JSON_BYTES_MAX:
        raise error(f"{where}: more than {JSON_BYTES_MAX // MIB} MiB, so no {format_name} file. Is it the right file?")
    if _depth(data) > JSON_DEPTH_MAX:
        raise error(f"{where}: lists and objects nested deeper than {JSON_DEPTH_MAX}, so no {format_name} file. "
                    "Is it the right file?")
    try:
        return json.loads(data, parse_float=_finite, parse_constant=_finite)
    except UnicodeDecodeError as exc:
        raise error(f"{where}: this is no text, so no {format_name} file. Is it the right file?") from exc
    except json.JSONDecodeError as exc:
        raise error(f"{where}: not valid JSON ({exc}). Is the file complete?") from exc
    except RecursionError as exc:
        raise error(f"{where}: nested too deeply to be read. Is it the right file?") from exc
    except ValueError as exc:
        reason = str(exc) if isinstance(exc, _NotFiniteError) else "a number has too many digits"
        raise error(f"{where}: not valid JSON ({reason}).") from exc


def decode_message(data: bytes, kind: type[T] | msgspec.json.Decoder[T]) -> T:
    """A JSON message of another program as the msgspec type `kind`. Raises msgspec.DecodeError whatever is wrong: also
    when it is longer or nested deeper than a document may be."""
    if len(data) > JSON_BYTES_MAX or _depth(data) > JSON_DEPTH_MAX:
        raise msgspec.DecodeError("JSON is too long or nested too deeply")
    try:
        return kind.decode(data) if isinstance(kind, msgspec.json.Decoder) else msgspec.json.decode(data, type=kind)
    except RecursionError as exc:
        raise msgspec.DecodeError("JSON is too long or nested too deeply") from exc


class _NotFiniteError(ValueError):
    """A number of a JSON document that is none, or is out of a float's range."""


def _finite(text: str) -> float:
    """A number of a document. NaN and infinite numbers, which Python would let pass, are none."""
    value = float(text)
    if not math.isfinite(value):
        raise _NotFiniteError(f"{text[:20]} is no number. NaN, Infinity and numbers beyond 1e308 are none there")
    return value


def _depth(data: bytes) -> int:
    """How deep lists and objects of a JSON document are nested."""
    depth = deepest = 0
    for bracket in _BRACKETS.findall(_STRING.sub(b"", data)):
        depth += 1 if bracket in b"[{" else -1
        deepest = max(deepest, depth)
    return deepest


def _brief(value: Any) -> str:
    """A value of a document for a message."""
    text = repr(value) if isinstance(value, str | int | float | bool | None) else type(value).__name__
    return text if len(text) <= 80 else f"{text[:80]}..."


def _not_strict(exc: msgspec.DecodeError) -> str:
    """JSON that Python's own reader lets pass: NaN and infinite numbers."""
    return f"not valid JSON ({exc}). NaN and Infinity are no numbers there."


def in_words(message: str, kind: type) -> str:
    """What msgspec found wrong, field first, for people who edit the file; a message that is not its own stays."""
    match = _PLACE.fullmatch(message)
    what, place = (match["what"], match["place"]) if match else (message, "")
    values = _values_at(kind, place) if what.startswith("Invalid") else []
    unknown = _UNKNOWN_FIELD.match(what)
    if unknown:
        near = nearest(unknown[1], _fields_at(kind, place))
        what = f'there is no field "{unknown[1]}"; ' + (f'did you mean "{near}"?' if near else
                                                         "is it misspelt, or in the wrong place?")
    for pattern, words in _COMPLAINTS:
        what = pattern.sub(words, what)
    if what.startswith("Expected `"):
        what = "expected" + _KIND.sub(_kind_in_words, what.removeprefix("Expected")).replace(", got", ", not") + "."
    if values:
        what = f"{what.removesuffix('.')}: {' or '.join(values)}."
    return f"{place}: {what}" if place else what


def _values_at(kind: type, place: str) -> list[str]:
    """The values that a field can have, as JSON, if they are few and known; `place` as in `nodes[...].kind`."""
    return [json.dumps(value) for one in _types_at(kind, place)
            if isinstance(one, msgspec.inspect.LiteralType) for value in one.values]


def _fields_at(kind: type, place: str) -> list[str]:
    """The fields that an object can have there."""
    return [field.encode_name for one in _types_at(kind, place)
            if isinstance(one, msgspec.inspect.StructType) for field in one.fields]


def _types_at(kind: type, place: str) -> list[msgspec.inspect.Type]:
    """What can stand at a place of a document, those of unions and lists each for itself."""
    kinds = _members(msgspec.inspect.type_info(kind))
    for name in [re.sub(r"\[.*", "", part) for part in place.split(".") if part]:
        fields = [field.type for one in kinds if isinstance(one, msgspec.inspect.StructType)
                  for field in one.fields if field.encode_name == name]
        kinds = [inner for one in fields for inner in _members(one)]
    return kinds


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
    return decode_document(read_document_bytes(path, error), kind, format_name=format_name, version=version,
                           where=str(path), error=error)


def read_json(path: Path, error: type[Exception]) -> Any:
    """Read any JSON file as `decode_json` does; a missing or unreadable file is an `error` too."""
    return decode_json(read_document_bytes(path, error), str(path), error)


def read_document_bytes(path: Path, error: type[Exception]) -> bytes:
    """The bytes of a file of at most 16 MiB. Raises `error` with a sentence when it cannot be read."""
    try:
        return read_input(path, JSON_BYTES_MAX)
    except FileNotFoundError as exc:
        raise error(f"{path}: no such file.") from exc
    except (OSError, ValueError) as exc:
        raise error(f"{path}: cannot be read ({why(exc)}).") from exc


def read_input(path: Path, limit: int = BYTES_MAX) -> bytes:
    """The bytes of a regular file. Raises OSError when it is none, or longer than `limit` bytes."""
    with open_input(path) as file:
        data = file.read(limit + 1)
    if len(data) > limit:
        size = f"{limit // MIB} MiB" if limit >= MIB else f"{limit // KIB} KiB"
        raise OSError(errno.EFBIG, f"it has more than {size}", str(path))
    return data


def read_table(path: Path) -> bytes:
    """The bytes of a text table. Raises OSError when it is no regular file, or has too many bytes or lines."""
    data = read_input(path, TABLE_BYTES_MAX)
    if max(data.count(b"\n"), data.count(b"\r")) > TABLE_LINES_MAX:
        raise OSError(errno.EFBIG, f"it has more than {TABLE_LINES_MAX} lines", str(path))
    return data


@contextlib.contextmanager
def open_archive(path: Path) -> Iterator[BinaryIO]:
    """A zip archive of arrays, to be loaded from. Raises OSError when it is no regular file, or too large unpacked;
    zipfile.BadZipFile when it is no archive."""
    with open_input(path) as file:
        with zipfile.ZipFile(file) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > ARRAYS_BYTES_MAX:
            raise OSError(errno.EFBIG, f"it unpacks to more than {ARRAYS_BYTES_MAX // MIB} MiB", str(path))
        file.seek(0)
        yield file


def open_input(path: Path, buffering: int = -1) -> BinaryIO:
    """Open a regular file for reading; a pipe or a device, which might never end, is refused. Raises OSError."""
    require_file(path)  # before it is opened: that alone does something to some devices
    file = os.fdopen(os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK), "rb", buffering)
    try:
        _require_regular(os.fstat(file.fileno()).st_mode, path, "read")
    except OSError:
        file.close()
        raise
    return file


def require_file(path: Path) -> None:
    """Raises OSError unless there is a regular file at `path`: for libraries that open it themselves."""
    _require_regular(path.stat().st_mode, path, "read")


def require_replaceable(path: Path) -> None:
    """Raises OSError when something else than a regular file stands at `path`, where one is to be written."""
    with contextlib.suppress(FileNotFoundError):
        _require_regular(path.stat().st_mode, path, "replaced")


def why(exc: OSError | ValueError) -> str:
    """Why a file cannot be opened, as a clause: what the system says, or that its name is none."""
    return (exc.strerror or str(exc)) if isinstance(exc, OSError) else "a file's name has no NUL"


def _require_regular(mode: int, path: Path, done: str) -> None:
    if not stat.S_ISREG(mode):
        kind = next((name for test, name in _OTHER_FILES if test(mode)), "something else")
        code = errno.EISDIR if stat.S_ISDIR(mode) else errno.EINVAL
        raise OSError(code, f"it is {kind}; only files are {done}", str(path))


def free_bytes(folder: Path) -> int:
    """What an ordinary user may still write in `folder`; raises OSError."""
    facts = os.statvfs(folder)
    return facts.f_bavail * facts.f_frsize


def sync_folder(path: Path) -> None:
    """Have the disk take the name of a new file, too: without it a power cut may lose the whole file."""
    with contextlib.suppress(OSError):  # some file systems cannot
        handle = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def write_document(path: Path, document: Any) -> None:
    """Write a msgspec document as indented JSON, atomically: a reader sees the old file or the new one, whole."""
    write_atomically(path, encode_document(document))


def encode_document(document: Any) -> bytes:
    """A msgspec document as indented JSON."""
    return msgspec.json.format(msgspec.json.encode(document), indent=2) + b"\n"


def write_atomically(path: Path, data: bytes, *, private: bool = False) -> None:
    """Write `data` as the whole of `path`, as `replacing` does."""
    with replacing(path, private=private) as file:
        file.write(data)


@contextlib.contextmanager
def replacing(path: Path, *, private: bool = False) -> Iterator[BinaryIO]:
    """A temporary file beside `path` to write to: flushed to disk and renamed over `path` when the block ends.

    A `private` file has mode 0600 from its first moment on; when root writes it, it belongs to the folder's owner.
    Raises OSError when the folder is missing or not writable, or when `path` is no regular file; it is then unchanged.
    """
    require_replaceable(path)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")  # of mode 0600
    try:
        with os.fdopen(handle, "wb") as file:
            if private and os.geteuid() == 0:
                folder = path.parent.stat()
                os.fchown(file.fileno(), folder.st_uid, folder.st_gid)
            yield file
            file.flush()
            os.fsync(file.fileno())
        if not private:
            Path(name).chmod(stat.S_IMODE(path.stat().st_mode) if path.exists() else _READABLE)
        Path(name).replace(path)
        sync_folder(path)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(name).unlink()
        raise
