"""PDF files as another program reads and draws them."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import numpy as np

MM_PER_POINT = 25.4 / 72.0


def pages_of(pdf: bytes, px_per_mm: float = 4.0) -> Iterator[tuple[str, np.ndarray]]:
    """Text and picture (H, W, 3) of every page."""
    import pypdfium2

    with contextlib.closing(pypdfium2.PdfDocument(pdf)) as document:
        for page in document:
            with contextlib.closing(page), contextlib.closing(page.get_textpage()) as text:
                picture = page.render(scale=px_per_mm * MM_PER_POINT).to_numpy().copy()
                yield text.get_text_bounded(), picture[..., :3]
