"""Drawings in true scale as SVG and PDF: boxes, lines, circles and text on sheets of paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_MM_PER_POINT = 25.4 / 72.0
_FONT = "Helvetica"

Ink = tuple[float, float, float]
"""Red, green and blue, 0..1."""

_BOLD, _BLACK_STROKE = ' font-weight="bold"', ' stroke="black"'
BLACK: Ink = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Box:
    """A filled rectangle; its upper left corner and its size, mm, y down."""

    x: float
    y: float
    width: float
    height: float
    ink: Ink = BLACK


@dataclass(frozen=True, slots=True)
class Disc:
    """A black circle; its middle and its radius, mm, y down."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, slots=True)
class Stroke:
    """A line through `points` (x, y), mm, `width` mm thick."""

    points: tuple[tuple[float, float], ...]
    width: float
    ink: Ink = BLACK


@dataclass(frozen=True, slots=True)
class Text:
    """A line of text from (x, y) on its base line; `height` of the letters' font, mm."""

    x: float
    y: float
    height: float
    text: str
    bold: bool = False
    ink: Ink = BLACK


@dataclass(frozen=True, slots=True)
class Drawing:
    """One page of `width` x `height` mm; everything that is not a box, a disc, a stroke or text is white. Strokes lie
    on the boxes, text on both."""

    width: float
    height: float
    boxes: tuple[Box, ...]
    texts: tuple[Text, ...]
    title: str
    strokes: tuple[Stroke, ...] = ()
    discs: tuple[Disc, ...] = ()

    def to_svg(self) -> bytes:
        """The page as SVG; one user unit is one millimetre."""
        lines = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{_number(self.width)}mm" '
            f'height="{_number(self.height)}mm" viewBox="0 0 {_number(self.width)} {_number(self.height)}">',
            f"<title>{_escaped(self.title)}</title>",
            f'<rect width="{_number(self.width)}" height="{_number(self.height)}" fill="white"/>',
            '<g fill="black" shape-rendering="crispEdges">',
            *(f'<rect x="{_number(box.x)}" y="{_number(box.y)}" width="{_number(box.width)}" '
              f'height="{_number(box.height)}"{_svg_ink("fill", box.ink)}/>' for box in self.boxes),
            "</g>",
            *(f'<circle cx="{_number(disc.x)}" cy="{_number(disc.y)}" r="{_number(disc.radius)}"/>'
              for disc in self.discs),
            *(f'<polyline fill="none"{_svg_ink("stroke", stroke.ink) or _BLACK_STROKE} '
              f'stroke-width="{_number(stroke.width)}" '
              f'points="{_svg_points(stroke)}"/>'
              for stroke in self.strokes),
            *(f'<text x="{_number(text.x)}" y="{_number(text.y)}" font-family="{_FONT}, Arial, sans-serif" '
              f'font-size="{_number(text.height)}"{_BOLD if text.bold else ""}'
              f'{_svg_ink("fill", text.ink)}>{_escaped(text.text)}</text>' for text in self.texts),
            "</svg>", ""]
        return "\n".join(lines).encode()

    def to_pdf(self) -> bytes:
        """The page as PDF 1.4."""
        return pdf_of((self,), self.title)

    def pdf_content(self) -> bytes:
        """The page's marks; PDF counts in points from the lower left corner."""
        lines, ink = [], BLACK
        for box in self.boxes:
            if box.ink != ink:
                lines += [b"f", _pdf_ink(box.ink, b"rg")]
                ink = box.ink
            lines.append(f"{_points(box.x)} {_points(self.height - box.y - box.height)} {_points(box.width)} "
                         f"{_points(box.height)} re".encode())
        lines.append(b"f")
        if self.discs:
            lines += [_pdf_ink(BLACK, b"rg"), *(self._pdf_disc(disc) for disc in self.discs)]
            ink = BLACK
        for stroke in self.strokes:
            ends = [f"{_points(x)} {_points(self.height - y)} {'l' if k else 'm'}".encode()
                    for k, (x, y) in enumerate(stroke.points)]
            lines += [_pdf_ink(stroke.ink, b"RG"), f"{_points(stroke.width)} w".encode(), *ends, b"S"]
        for text in self.texts:
            if text.ink != ink:
                lines.append(_pdf_ink(text.ink, b"rg"))
                ink = text.ink
            lines.append(b"BT /%s %s Tf %s %s Td (%s) Tj ET" % (
                b"B" if text.bold else b"F", _points(text.height).encode(), _points(text.x).encode(),
                _points(self.height - text.y).encode(), _pdf_text(text.text)))
        return b"\n".join(lines)

    def _pdf_disc(self, disc: Disc) -> bytes:
        """Four curves, a quarter each; their round is good to 3e-4 of the radius."""
        x, y, r = disc.x, self.height - disc.y, disc.radius
        k = 4.0 / 3.0 * (np.sqrt(2.0) - 1.0) * r
        curves = [(r, k, k, r, 0.0, r), (-k, r, -r, k, -r, 0.0), (-r, -k, -k, -r, 0.0, -r), (k, -r, r, -k, r, 0.0)]
        lines = [f"{_points(x + r)} {_points(y)} m"]
        lines += [" ".join(_points(start + step) for start, step in zip((x, y) * 3, curve, strict=True)) + " c"
                  for curve in curves]
        return "\n".join([*lines, "f"]).encode()


def pdf_of(pages: Sequence[Drawing], title: str) -> bytes:
    """Pages as one PDF 1.4, in true scale."""
    first = 6  # object of the first page; each page is followed by its content
    kids = " ".join(f"{first + 2 * k} 0 R" for k in range(len(pages)))
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        f"<< /Type /Pages /Kids [{kids}] /Count {len(pages)} >>".encode(),
        f"<< /Type /Font /Subtype /Type1 /BaseFont /{_FONT} /Encoding /WinAnsiEncoding >>".encode(),
        f"<< /Type /Font /Subtype /Type1 /BaseFont /{_FONT}-Bold /Encoding /WinAnsiEncoding >>".encode(),
        b"<< /Title (" + _pdf_text(title) + b") >>",
    ]
    for k, page in enumerate(pages):
        content = page.pdf_content()
        objects += [
            (f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {_points(page.width)} {_points(page.height)}] "
             f"/Contents {first + 2 * k + 1} 0 R /Resources << /Font << /F 3 0 R /B 4 0 R >> >> >>").encode(),
            b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content)]
    data, offsets = bytearray(b"%PDF-1.4\n"), []
    for number, body in enumerate(objects, start=1):
        offsets.append(len(data))
        data += b"%d 0 obj\n%s\nendobj\n" % (number, body)
    start = len(data)
    data += b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
    data += b"".join(b"%010d 00000 n \n" % offset for offset in offsets)
    data += b"trailer\n<< /Size %d /Root 1 0 R /Info 5 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (len(objects) + 1, start)
    return bytes(data)


def _svg_points(stroke: Stroke) -> str:
    return " ".join(f"{_number(x)},{_number(y)}" for x, y in stroke.points)


def _svg_ink(attribute: str, ink: Ink) -> str:
    """Nothing for black, which is the group's own."""
    hexadecimal = "".join(f"{round(255 * part):02x}" for part in ink)
    return "" if ink == BLACK else f' {attribute}="#{hexadecimal}"'


def _pdf_ink(ink: Ink, operator: bytes) -> bytes:
    return " ".join(_number(part) for part in ink).encode() + b" " + operator


def _points(millimetres: float) -> str:
    return _number(millimetres / _MM_PER_POINT)


def _number(value: float) -> str:
    """Four decimals are a ten-thousandth of a millimetre; no exponents, no trailing zeros."""
    return f"{value:.4f}".rstrip("0").rstrip(".")


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _pdf_text(text: str) -> bytes:
    escaped = text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
    return escaped.encode("cp1252", "replace")
