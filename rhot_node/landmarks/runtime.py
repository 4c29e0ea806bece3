"""What runs a network: LiteRT where it is installed (extra `landmarks`), else OpenCV."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.errors import KeypointError

Tensor = NDArray[np.float32]
Network = Callable[[Tensor], list[Tensor]]
"""An image (H, W, 3) RGB, 0..1, in; the outputs, in the order of their names, out."""

LITERT: Final = "litert"
OPENCV: Final = "opencv"
RUNTIMES: Final = (LITERT, OPENCV)
_STDERR: Final = 2


def best_runtime() -> str:
    """LiteRT if it can be loaded."""
    with contextlib.suppress(Exception):  # it may be built for another numpy, or another processor
        import ai_edge_litert.interpreter  # noqa: F401
        return LITERT
    return OPENCV


def open_network(data: bytes, runtime: str, threads: int) -> Network:
    """A network of the format tflite. `threads`: of LiteRT; OpenCV's are those of the whole program. Raises
    KeypointError when the runtime is missing, or cannot read it."""
    if runtime not in RUNTIMES:
        raise KeypointError(f"there is no runtime {runtime!r} for networks; there are {', '.join(RUNTIMES)}.")
    try:
        return _litert(data, threads) if runtime == LITERT else _opencv(data)
    except ImportError as exc:
        raise KeypointError("LiteRT is not installed. Install the extra `landmarks` (pip install 'rhot[landmarks]'), "
                            f"or use the runtime {OPENCV}.") from exc
    except (cv2.error, ValueError, RuntimeError, AttributeError) as exc:
        raise KeypointError(f"{runtime} cannot read the network ({' '.join(str(exc).split())[:160]}).") from exc


def _litert(data: bytes, threads: int) -> Network:
    from ai_edge_litert.interpreter import Interpreter

    with _stderr_silenced():
        interpreter: Any = Interpreter(model_content=data, num_threads=threads)
        interpreter.allocate_tensors()
    image = interpreter.get_input_details()[0]["index"]
    names = {one["name"]: one["index"] for one in interpreter.get_output_details()}
    outputs = [names[name] for name in sorted(names)]

    def run(pixels: Tensor) -> list[Tensor]:
        interpreter.set_tensor(image, pixels[None])
        interpreter.invoke()
        return [np.asarray(interpreter.get_tensor(output), np.float32) for output in outputs]

    return run


@contextlib.contextmanager
def _stderr_silenced() -> Iterator[None]:
    """Keeps what LiteRT writes to standard error, which no setting of it turns off, away from a terminal; its errors
    are raised all the same."""
    try:
        kept = os.dup(_STDERR)
    except OSError:  # there is none
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        sys.stderr.flush()
        os.dup2(nowhere, _STDERR)
        yield
    finally:
        os.dup2(kept, _STDERR)
        os.close(kept)
        os.close(nowhere)


def _opencv(data: bytes) -> Network:
    net: Any = cv2.dnn.readNetFromTFLite(np.frombuffer(data, np.uint8))
    outputs, names = sorted(net.getUnconnectedOutLayersNames()), list(net.getLayerNames())
    layers = [net.getLayer(net.getLayerId(name)) for name in names]
    connected = [k for k, layer in enumerate(layers) if layer.type == "Gemm"]

    def feed(pixels: Tensor) -> None:
        net.setInput(np.ascontiguousarray(pixels.transpose(2, 0, 1)[None]))

    def run(pixels: Tensor) -> list[Tensor]:
        feed(pixels)
        return [np.asarray(output, np.float32) for output in net.forward(outputs)]

    if not connected:
        return run
    # OpenCV (4.11 to 4.14 at least) leaves out the bias of fully connected layers: these are computed here.
    features, heads = names[connected[0] - 1], []
    for output in outputs:
        last = names.index(output)
        is_probability = layers[last].type == "Sigmoid"
        weights, bias = layers[last - is_probability].blobs
        heads.append((weights, bias.ravel(), is_probability))

    def run_with_bias(pixels: Tensor) -> list[Tensor]:
        feed(pixels)
        value = net.forward(features).ravel()
        linear = [(weights @ value + bias, is_probability) for weights, bias, is_probability in heads]
        return [np.asarray(1.0 / (1.0 + np.exp(-out)) if is_probability else out, np.float32)[None]
                for out, is_probability in linear]

    return run_with_bias
