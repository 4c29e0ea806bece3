"""Every error a node raises on purpose. A message says what was wrong, where, and what to do next."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

NAME_LIMIT = 64
"""Characters of a name that somebody else gave something; those of our own nodes have as many."""


def printable(text: str, limit: int = 400) -> str:
    """What somebody else wrote, safe for a terminal and a log: one line, control characters as escapes, cut off at
    `limit` characters."""
    cut = text if len(text) <= limit else f"{text[:limit]}..."
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in cut)


def system_sentence(exc: OSError | MemoryError) -> str:
    """What the system refused, where nobody knew it better: a file with its name and the system's words."""
    if isinstance(exc, MemoryError):
        return "there is not enough memory for this."
    place = "" if exc.filename is None else f"{exc.filename}: "
    return f"{place}the system refuses it ({exc.strerror or exc})."


def nearest(word: str, known: Iterable[str]) -> str:
    """The one of what is `known` that somebody may have meant by `word`; "" where none is alike."""
    return next(iter(difflib.get_close_matches(word[:80], known, n=1, cutoff=0.7)), "")


class NodeError(Exception):
    """Root of all errors of this package; commands print it and exit with code 2."""


class SettingsError(NodeError):
    """A settings or marker file is missing, unreadable, or says something that cannot be."""


class CameraError(NodeError):
    """A camera or recording cannot be opened, stopped delivering, or changed its image size."""


class PictureError(NodeError):
    """A picture or a video of a file, or of a message, cannot be decoded. `reason`: why, as what follows its name."""

    def __init__(self, reason: str, path: object = None) -> None:
        super().__init__(f"{'the picture' if path is None else path} {reason}.")
        self.reason = reason


class LinkError(NodeError):
    """A network port cannot be opened or an address is not usable."""


class PluginError(NodeError):
    """A plug-in is missing, cannot be loaded, or does not do what it should."""


class KeypointError(NodeError):
    """A model card or its network is missing, another one than described, or does not fit the marker set."""


class TrustError(NodeError):
    """A key file is missing, open to others or broken, or a pairing was refused."""


class VideoError(NodeError):
    """A video cannot be recorded, read or removed."""


class WireError(NodeError):
    """A datagram is not one of ours. `reason` is a short key for counting, such as 'magic' or 'length'."""

    def __init__(self, reason: str, detail: str = "") -> None:
        super().__init__(f"{reason}: {detail}" if detail else reason)
        self.reason = reason
