"""Drawings in true scale as SVG and PDF: boxes, lines, circles and text on sheets of paper."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from fpdf import FPDF

_MM_PER_POINT = 25.4 / 72.0
_MARGIN_MM, _FOOT_MM, _FOOT_POINTS = 18.0, 12.0, 7.4
_FONT, _ENCODING = "Helvetica", "cp1252"  # of the fonts that every PDF reader has

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
    """A line of text on the base line of (x, y), which is its start, middle or end; `height` of the font, mm."""

    x: float
    y: float
    height: float
    text: str
    bold: bool = False
    ink: Ink = BLACK
    anchor: Literal["start", "middle", "end"] = "start"


Mark = Box | Disc | Stroke | Text


@dataclass(frozen=True, slots=True)
class Drawing:
    """One white page of `width` x `height` mm with `marks`, of which later ones lie on earlier ones."""

    width: float
    height: float
    marks: tuple[Mark, ...]
    title: str

    def to_svg(self) -> bytes:
        """The page as SVG; one user unit is one millimetre."""
        size = f'width="{_number(self.width)}{{0}}" height="{_number(self.height)}{{0}}"'
        lines = [f'<svg xmlns="http://www.w3.org/2000/svg" {size.format("mm")} '
                 f'viewBox="0 0 {_number(self.width)} {_number(self.height)}">',
                 f"<title>{_escaped(self.title)}</title>", f'<rect {size.format("")} fill="white"/>']
        for kind, marks in groupby(self.marks, type):
            drawn = [_svg(mark) for mark in marks]
            lines += ['<g shape-rendering="crispEdges">', *drawn, "</g>"] if kind is Box else drawn
        return "\n".join([*lines, "</svg>", ""]).encode()

    def to_pdf(self) -> bytes:
        """The page as PDF, in true scale."""
        pdf = new_pdf(self.title)
        pdf.add_page(format=(self.width, self.height))
        self.draw_on(pdf)
        return bytes(pdf.output())

    def draw_on(self, pdf: FPDF, left: float = 0.0, top: float = 0.0) -> None:
        """Draw it on the last page of `pdf`, its upper left corner at (`left`, `top`) mm."""
        for mark in self.marks:
            match mark:
                case Box():
                    pdf.set_fill_color(*rgb_of(mark.ink))
                    pdf.rect(left + mark.x, top + mark.y, mark.width, mark.height, style="F")
                case Disc():
                    pdf.set_fill_color(0, 0, 0)
                    pdf.circle(left + mark.x, top + mark.y, mark.radius, style="F")
                case Stroke():
                    pdf.set_draw_color(*rgb_of(mark.ink))
                    pdf.set_line_width(mark.width)
                    pdf.polyline([(left + x, top + y) for x, y in mark.points])
                case Text():
                    pdf.set_font(_FONT, "B" if mark.bold else "", mark.height / _MM_PER_POINT)
                    pdf.set_text_color(*rgb_of(mark.ink))
                    text = printable(mark.text)
                    pdf.text(left + mark.x - _SHARES[mark.anchor] * pdf.get_string_width(text), top + mark.y, text)


_SHARES = {"start": 0.0, "middle": 0.5, "end": 1.0}  # of a text that is left of its place


def _svg(mark: Mark) -> str:
    match mark:
        case Box(x, y, width, height, ink):
            return (f'<rect x="{_number(x)}" y="{_number(y)}" width="{_number(width)}" height="{_number(height)}"'
                    f'{_svg_ink("fill", ink)}/>')
        case Disc(x, y, radius):
            return f'<circle cx="{_number(x)}" cy="{_number(y)}" r="{_number(radius)}"/>'
        case Stroke(points, width, ink):
            return (f'<polyline fill="none"{_svg_ink("stroke", ink) or _BLACK_STROKE} stroke-width="{_number(width)}" '
                    f'points="{" ".join(f"{_number(x)},{_number(y)}" for x, y in points)}"/>')
    return (f'<text x="{_number(mark.x)}" y="{_number(mark.y)}" font-family="{_FONT}, Arial, sans-serif" '
            f'font-size="{_number(mark.height)}" text-anchor="{mark.anchor}"{_BOLD if mark.bold else ""}'
            f'{_svg_ink("fill", mark.ink)}>{_escaped(mark.text)}</text>')


def new_pdf(title: str, foot: str = "") -> FPDF:
    """A PDF in mm, which printers do not scale. With a `foot`, A4 pages that turn by themselves and have it and their
    number below; without one, no pages yet."""
    from fpdf import FPDF, ViewerPreferences

    class Pdf(FPDF):
        def footer(self) -> None:
            if foot:
                self.set_y(-_FOOT_MM)
                self.set_font(_FONT, "", _FOOT_POINTS)
                self.set_text_color(100, 100, 100)
                self.cell(0.0, 4.0, f"{foot}, page {self.page_no()}")

    pdf = Pdf(unit="mm")
    pdf.core_fonts_encoding = _ENCODING
    pdf.viewer_preferences = ViewerPreferences(print_scaling="None")
    pdf.set_title(title)
    pdf.set_margins(_MARGIN_MM, _MARGIN_MM)
    pdf.set_auto_page_break(bool(foot), _MARGIN_MM)
    if foot:
        pdf.add_page()
    return pdf


def printable(text: str) -> str:
    """The text as a PDF's own fonts can show it: "?" stands for what they lack."""
    return text.encode(_ENCODING, "replace").decode(_ENCODING)


def _svg_ink(attribute: str, ink: Ink) -> str:
    """Nothing for black, which is the group's own."""
    hexadecimal = "".join(f"{round(255 * part):02x}" for part in ink)
    return "" if ink == BLACK else f' {attribute}="#{hexadecimal}"'


def rgb_of(ink: Ink) -> tuple[int, int, int]:
    """The ink as 0..255."""
    red, green, blue = (round(255 * part) for part in ink)
    return red, green, blue


def _number(value: float) -> str:
    """Four decimals are a ten-thousandth of a millimetre; no exponents, no trailing zeros."""
    return f"{value:.4f}".rstrip("0").rstrip(".")


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
