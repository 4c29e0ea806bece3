"""Tiny ONNX networks, written byte by byte: the mean colour of the image, through two linear layers."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

SIDE = 48
POINTS = 21


def _varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value & 127 | 128]), value >> 7
    return out + bytes([value])


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _bytes(field: int, value: bytes | str) -> bytes:
    data = value.encode() if isinstance(value, str) else value
    return _varint(field << 3 | 2) + _varint(len(data)) + data


def _tensor(name: str, values: np.ndarray) -> bytes:
    return b"".join(_number(1, size) for size in values.shape) + _number(2, 1) + _bytes(8, name) + _bytes(
        9, values.astype("<f4").tobytes())


def _node(kind: str, inputs: list[str], output: str, **attributes: int) -> bytes:
    return (b"".join(_bytes(1, name) for name in inputs) + _bytes(2, output) + _bytes(3, output) + _bytes(4, kind)
            + b"".join(_bytes(5, _bytes(1, name) + _number(3, value) + _number(20, 2))
                       for name, value in attributes.items()))


def _value(name: str, shape: tuple[int, ...]) -> bytes:
    dimensions = b"".join(_bytes(1, _number(1, size)) for size in shape)
    return _bytes(1, name) + _bytes(2, _bytes(1, _number(1, 1) + _bytes(2, dimensions)))


def linear_network(weights: np.ndarray, bias: np.ndarray, score: tuple[np.ndarray, float] | None,
                   side: int = SIDE) -> bytes:
    """ONNX: points = weights (N, 3) @ mean RGB + bias (N,); score = sigmoid(its weights (3,) @ mean RGB + its bias)."""
    nodes = [_node("GlobalAveragePool", ["image"], "pooled"), _node("Flatten", ["pooled"], "mean", axis=1),
             _node("Gemm", ["mean", "w", "b"], "points", transB=1)]
    tensors = [_tensor("w", weights), _tensor("b", bias)]
    outputs = [_value("points", (1, len(bias)))]
    if score is not None:
        nodes += [_node("Gemm", ["mean", "ws", "bs"], "logit", transB=1), _node("Sigmoid", ["logit"], "score")]
        tensors += [_tensor("ws", score[0].reshape(1, 3)), _tensor("bs", np.array([score[1]]))]
        outputs.append(_value("score", (1, 1)))
    graph = (b"".join(_bytes(1, node) for node in nodes) + _bytes(2, "tiny")
             + b"".join(_bytes(5, tensor) for tensor in tensors) + _bytes(11, _value("image", (1, 3, side, side)))
             + b"".join(_bytes(12, output) for output in outputs))
    return _number(1, 7) + _bytes(7, graph) + _bytes(8, _number(2, 13))


def spread_points() -> np.ndarray:
    """(21, 3) px: points on a spiral in the middle two thirds of the input; their extent is exactly that."""
    angle = np.linspace(0.0, 4.0 * np.pi, POINTS)
    points = np.column_stack([np.cos(angle) * angle, np.sin(angle) * angle, 0.0 * angle])
    low, high = points.min(axis=0), points.max(axis=0)
    extent = np.array([2.0 / 3.0 * SIDE] * 2 + [1.0])
    points = (points - 0.5 * (low + high)) * extent / np.maximum(high - low, 1e-9)
    return points + np.array([0.5 * (SIDE - 1)] * 2 + [0.0])


def place(folder: Path, *, network: bytes | None = None, **changes: str) -> Path:
    """A card and its network in a folder; `changes` replace lines of the card by their key."""
    folder.mkdir(parents=True, exist_ok=True)
    if network is None:
        network = linear_network(np.zeros((3 * POINTS, 3)), spread_points().ravel(),
                                 (np.array([20.0, -10.0, -10.0]), -5.0))
    (folder / "tiny.onnx").write_bytes(network)
    lines = {
        "name": '"tiny"', "licence": '"CC0-1.0"', "network.file": '"tiny.onnx"',
        "network.sha256": f'"{hashlib.sha256(network).hexdigest()}"', "network.input_px": f"[{SIDE}, {SIDE}]",
        "points.count": str(POINTS), "points.sigma": "0.01", "points.output": '"points"',
        "points.score_output": '"score"'} | {key.replace("__", "."): value for key, value in changes.items()}
    card = folder / "tiny.toml"
    card.write_text("".join(f"{key} = {value}\n" for key, value in lines.items() if value))
    return card
