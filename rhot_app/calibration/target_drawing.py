"""A printable page as rectangles and text in millimetres, written as PDF or SVG in true scale."""

from __future__ import annotations

from dataclasses import dataclass

_MM_PER_POINT = 25.4 / 72.0
_FONT = "Helvetica"


@dataclass(frozen=True, slots=True)
class Box:
    """A black rectangle; its upper left corner and its size, mm, y down."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Text:
    """A line of text from (x, y) on its base line; `height` of the letters' font, mm."""

    x: float
    y: float
    height: float
    text: str


@dataclass(frozen=True, slots=True)
class Drawing:
    """One page of `width` x `height` mm; everything that is not a box or text is white."""

    width: float
    height: float
    boxes: tuple[Box, ...]
    texts: tuple[Text, ...]
    title: str

    def to_svg(self) -> bytes:
        """The page as SVG; one user unit is one millimetre."""
        lines = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{_number(self.width)}mm" '
            f'height="{_number(self.height)}mm" viewBox="0 0 {_number(self.width)} {_number(self.height)}">',
            f"<title>{_escaped(self.title)}</title>",
            f'<rect width="{_number(self.width)}" height="{_number(self.height)}" fill="white"/>',
            '<g fill="black" shape-rendering="crispEdges">',
            *(f'<rect x="{_number(box.x)}" y="{_number(box.y)}" width="{_number(box.width)}" '
              f'height="{_number(box.height)}"/>' for box in self.boxes),
            "</g>",
            *(f'<text x="{_number(text.x)}" y="{_number(text.y)}" font-family="{_FONT}, Arial, sans-serif" '
              f'font-size="{_number(text.height)}">{_escaped(text.text)}</text>' for text in self.texts),
            "</svg>", ""]
        return "\n".join(lines).encode()

    def to_pdf(self) -> bytes:
        """The page as PDF 1.4."""
        box = f"[0 0 {_points(self.width)} {_points(self.height)}]"
        content = self._pdf_content()
        objects = [
            b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
            b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
            (f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Contents 4 0 R "
             "/Resources << /Font << /F 5 0 R >> >> >>").encode(),
            b"<< /Length %d >>\nstream\n%s\nendstream" % (len(content), content),
            f"<< /Type /Font /Subtype /Type1 /BaseFont /{_FONT} /Encoding /WinAnsiEncoding >>".encode(),
            b"<< /Title (" + _pdf_text(self.title) + b") >>",
        ]
        data, offsets = bytearray(b"%PDF-1.4\n"), []
        for number, body in enumerate(objects, start=1):
            offsets.append(len(data))
            data += b"%d 0 obj\n%s\nendobj\n" % (number, body)
        start = len(data)
        data += b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
        data += b"".join(b"%010d 00000 n \n" % offset for offset in offsets)
        data += b"trailer\n<< /Size %d /Root 1 0 R /Info 6 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (len(objects) + 1, start)
        return bytes(data)

    def _pdf_content(self) -> bytes:
        """The page's marks; PDF counts in points from the lower left corner."""
        lines = [f"{_points(box.x)} {_points(self.height - box.y - box.height)} {_points(box.width)} "
                 f"{_points(box.height)} re".encode() for box in self.boxes]
        lines.append(b"f")
        lines += [b"BT /F %s Tf %s %s Td (%s) Tj ET" % (
            _points(text.height).encode(), _points(text.x).encode(), _points(self.height - text.y).encode(),
            _pdf_text(text.text)) for text in self.texts]
        return b"\n".join(lines)


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
