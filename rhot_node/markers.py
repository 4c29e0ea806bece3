"""Marker sets: which markers exist, what colour each has, where on the hand it sits, what shape it has.

The file format (``rhot-markers``, JSON) is described in docs/markers.md.
"""

from __future__ import annotations

import math
import zlib
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from rhot_node.errors import SettingsError
from rhot_node.files import PRINTABLE, read_document, write_document

FORMAT: Final = "rhot-markers"
VERSION: Final = 1

Byte = Annotated[int, Meta(ge=0, le=255)]
Millimetres = Annotated[float, Meta(gt=0, le=1000)]
MarkerId = Annotated[str, Meta(min_length=1, max_length=32, pattern=r"\A[A-Za-z0-9_.-]+\Z")]

Shape = Literal["disc", "sphere", "capsule", "band", "blob", "landmark"]
Patch = Literal["segment", "nail", "pulp", "ring"]
Side = Literal["dorsal", "palmar", "radial", "ulnar"]

FLAT_PATCHES: Final = ("nail", "pulp")
"""Paint on one side of a fingertip: its centre lies on the skin, not on the bone's axis."""


class ChromaModel(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A colour as the detector sees it: a sector of the chroma plane, full-range BT.601 (JPEG) YCbCr.

    `cb` and `cr` are the marker's mean chroma minus 128, -128..127. A pixel belongs to the marker when its
    chroma angle atan2(cr, cb) is within `hue_tolerance_deg` of the marker's and its magnitude is at least
    `magnitude_min` (grey levels); luma outside `luma_min..luma_max` is ignored (black noise, burnt highlights).
    """

    cb: Annotated[float, Meta(ge=-128, le=128)]
    cr: Annotated[float, Meta(ge=-128, le=128)]
    hue_tolerance_deg: Annotated[float, Meta(gt=0, le=90)] = 14.0
    magnitude_min: Annotated[float, Meta(ge=4, le=180)] = 24.0
    luma_min: Byte = 12
    luma_max: Byte = 250

    @property
    def magnitude(self) -> float:
        """Chroma magnitude of the marker's mean colour, grey levels."""
        return math.hypot(self.cb, self.cr)

    @property
    def hue_rad(self) -> float:
        """Chroma angle atan2(cr, cb), rad."""
        return math.atan2(self.cr, self.cb)


class RangeModel(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The thesis's colour model: lower and upper bounds in HSV (OpenCV: H 0..179) or RGB.

    In HSV a lower hue above the upper one means a range across red: ``[170, ...]`` to ``[8, ...]``.
    """

    space: Literal["hsv", "rgb"]
    lower: tuple[Byte, Byte, Byte]
    upper: tuple[Byte, Byte, Byte]


class Marker(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """One marker. Sizes and how the paint lies are read by the master only; a node works without them.

    What stands at its default is not written, so that a file without a newer field is read by older programs.
    """

    id: MarkerId
    chroma: ChromaModel
    display_rgb: tuple[Byte, Byte, Byte]
    role: str | None = None  # place on the hand, e.g. "thumb_tip", "wrist"; None: a free point
    shape: Shape = "blob"
    range: RangeModel | None = None  # for the reference detector; derived from `chroma` when absent
    radius_mm: Millimetres | None = None
    length_mm: Millimetres | None = None
    patch: Patch = "segment"  # the part of a fingertip's last segment that is painted
    gap_deg: Annotated[float, Meta(ge=0, le=330)] = 0.0  # of a ring or a band: the angle without the marker's colour
    gap_side: Side = "palmar"  # where the middle of the gap lies
    rest_rgb: tuple[Byte, Byte, Byte] | None = None  # colour of the tape or band beside the marker's; None: none there
    rest_mm: Annotated[float, Meta(ge=0, le=200)] = 0.0  # length of the rest towards the elbow

    def __post_init__(self) -> None:
        tip, wrist = (self.role or "").endswith("_tip"), (self.role or "").removeprefix("other_") == "wrist"
        for fault, rule in (
                (self.patch != "segment" and not tip,
                 f'patch "{self.patch}" is for fingertips; give it a role such as "index_tip"'),
                (self.patch in FLAT_PATCHES and self.shape not in ("disc", "blob"),
                 f'patch "{self.patch}" is flat; give it the shape "disc"'),
                (self.gap_deg > 0.0 and self.patch != "ring" and not wrist,
                 'gap_deg is of a wrist\'s band or of the patch "ring"'),
                (self.rest_mm > 0.0 and not wrist, "rest_mm is of a wrist's band"),
                (self.rest_mm > 0.0 and self.rest_rgb is None, "rest_mm needs rest_rgb, the rest's colour"),
                (self.rest_rgb is not None and self.gap_deg == 0.0 and self.rest_mm == 0.0,
                 "rest_rgb needs gap_deg or rest_mm, which say where that colour is")):
            if fault:
                raise ValueError(f"marker {self.id!r}: {rule}")


class MarkerSet(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An ordered set of markers; a marker's index in it is its number on the wire."""

    markers: Annotated[tuple[Marker, ...], Meta(min_length=1, max_length=64)]
    name: Annotated[str, Meta(pattern=PRINTABLE)] = ""
    format: Literal["rhot-markers"] = FORMAT
    version: Literal[1] = VERSION

    def __post_init__(self) -> None:
        ids = [marker.id for marker in self.markers]
        doubled = sorted({name for name in ids if ids.count(name) > 1})
        if doubled:
            raise ValueError(f"marker id {doubled[0]!r} is used more than once; every id must be unique")
        for marker in self.markers:
            if marker.chroma.magnitude < 4:
                raise ValueError(f"marker {marker.id!r} has no colour (cb and cr are both near 0); "
                                 "grey, black and white cannot be told from the room")

    @property
    def ids(self) -> tuple[str, ...]:
        """Marker ids in wire order."""
        return tuple(marker.id for marker in self.markers)

    @property
    def checksum(self) -> int:
        """CRC-32 of the ids in order: node and master compare it to notice that they use different sets."""
        return zlib.crc32("\n".join(self.ids).encode())


def load_markers(path: Path) -> MarkerSet:
    """Read a marker file; raises SettingsError naming file and field."""
    return read_document(path, MarkerSet, format_name=FORMAT, version=VERSION, error=SettingsError)


def save_markers(path: Path, markers: MarkerSet) -> None:
    """Write a marker file atomically; raises OSError."""
    write_document(path, markers)
