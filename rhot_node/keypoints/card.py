"""Model cards: which network finds the points, what it takes and what it gives. Format ``rhot-keypoints``, TOML.

docs/landmarks.md describes the fields. Files that a card names stand beside it. Nothing is downloaded. The table
`anatomy` is the master's and is passed over here.
"""

from __future__ import annotations

import hashlib
import os
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from rhot_node.errors import KeypointError
from rhot_node.files import read_input

Side = Annotated[int, Meta(ge=16, le=1024)]
Share = Annotated[float, Meta(gt=0, le=1)]
FileName = Annotated[str, Meta(pattern=r"\A[A-Za-z0-9][A-Za-z0-9_.-]{0,127}\Z")]

CARD_BYTES_MAX = 65_536


class Network(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An ONNX file and how an image enters it: (pixel - `mean`) * `scale`, per channel in the order `channels`."""

    file: FileName
    sha256: Annotated[str, Meta(pattern=r"\A[0-9a-f]{64}\Z")]
    input_px: tuple[Side, Side]  # width, height
    layout: Literal["nchw", "nhwc"] = "nchw"
    channels: Literal["rgb", "bgr"] = "rgb"
    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: tuple[float, float, float] = (1 / 255, 1 / 255, 1 / 255)


class Points(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The output: `count` points of `numbers` each, of which x and y come first, in pixels of the input or as a
    fraction of it. `sigma`: their standard deviation, as a part of the region's side."""

    count: Annotated[int, Meta(ge=3, le=64)]
    sigma: Share
    output: str = ""  # the network's name of it; empty: the only one
    numbers: Annotated[int, Meta(ge=2, le=8)] = 3
    unit: Literal["px", "fraction"] = "px"
    score_output: str = ""  # a probability that the object is there; empty: there is none
    upright: tuple[int, int] | None = None  # two points: the region is turned until the second is above the first


class Regions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The companion that finds the first region: rows of x0, y0, x1, y1 (fractions of the image) and a probability."""

    network: Network
    output: str = ""


class ModelCard(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A model card. `region_factor`: side of a region, by the greatest extent of the points in it."""

    name: Annotated[str, Meta(min_length=1, max_length=100)]
    licence: Annotated[str, Meta(min_length=1, max_length=100)]
    network: Network
    points: Points
    regions: Regions | None = None
    region_factor: Annotated[float, Meta(ge=1, le=4)] = 1.5
    anatomy: dict[str, Any] = {}
    format: Literal["rhot-keypoints"] = "rhot-keypoints"
    version: Literal[1] = 1

    def __post_init__(self) -> None:
        if self.points.upright is not None and not all(0 <= k < self.points.count for k in self.points.upright):
            raise ValueError(f"points.upright names a point that is not there; they are 0 to {self.points.count - 1}")


def card_path(name: str) -> Path:
    """Where the node looks for the card of `keypoints:NAME`."""
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "rhot" / "keypoints" / f"{name}.toml"


def load_card(path: Path) -> ModelCard:
    """Read a model card. Raises KeypointError naming file and field."""
    try:
        data = read_input(path, CARD_BYTES_MAX)
    except OSError as exc:
        raise KeypointError(f"{path}: there is no model card ({exc.strerror}). Place the card and its network there.") \
            from exc
    try:
        return msgspec.convert(tomllib.loads(data.decode()), ModelCard)
    except (ValueError, RecursionError, msgspec.ValidationError) as exc:
        raise KeypointError(f"{path}: not a model card ({exc}). docs/landmarks.md describes it.") from exc


def read_network(card: Path, network: Network) -> bytes:
    """The bytes of a card's network, whose hash agrees. Raises KeypointError."""
    path = card.parent / network.file
    try:
        data = read_input(path)
    except OSError as exc:
        raise KeypointError(f"{path}: the network of {card.name} cannot be read ({exc.strerror}). Place it beside the "
                            "card; RHOT downloads none.") from exc
    found = hashlib.sha256(data).hexdigest()
    if found != network.sha256:
        raise KeypointError(f"{path}: is not the network that {card.name} describes. Its SHA-256 is {found}; the card "
                            f"has {network.sha256}. Place the right file, or correct the card.")
    return data
