"""A certificate as a page for people: HTML with charts, PDF of the same drawing, JSON with the raw numbers.

All three or none appear: the folder is renamed into place when it is complete.
"""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rhot_app.certificate.charts import chart_of
from rhot_app.certificate.document import Certificate, Figure, Line, Word, number
from rhot_app.certificate.recordings import ProtocolFile, copy_protocol
from rhot_app.errors import CertificateError
from rhot_app.simulator.film.film import new_folder
from rhot_app.vector_graphics import BLACK, Box, Drawing, Ink, Stroke, Text, pdf_of
from rhot_node.files import write_document

INKS: dict[Word, Ink] = {"agrees": (0.10, 0.45, 0.20), "differs": (0.75, 0.12, 0.10),
                         "not measured": (0.55, 0.40, 0.0)}
"""Of the verdicts; each also stands in words, because a colour alone says nothing to some readers."""

_WIDTH, _HEIGHT, _MARGIN = 210.0, 297.0, 18.0  # mm, A4
_LINE_MM, _TEXT_MM = 4.4, 3.1
_GREY: Ink = (0.4, 0.4, 0.4)
_MOST_FIGURES = 14  # of a line on paper; the HTML and the JSON have all


def write_report(out: Path, certificate: Certificate, *,
                 recordings: tuple[Path, ProtocolFile] | None = None) -> None:
    """Write ``certificate.html``, ``.pdf`` and ``.json`` into the new folder `out`; with `recordings`, the protocol of
    a folder, its logs too, as ``out/recordings``. Raises CertificateError."""
    try:
        if out.exists():
            raise CertificateError(f"{out} exists already; choose another folder or remove it.")
        if not out.absolute().parent.is_dir():
            raise CertificateError(f"{out.absolute().parent} is not a folder; create it first.")
        with new_folder(out.absolute()) as work:
            write_document(work / "certificate.json", certificate)
            (work / "certificate.html").write_text(to_html(certificate), encoding="utf-8")
            (work / "certificate.pdf").write_bytes(to_pdf(certificate))
            if recordings is not None:
                copy_protocol(*recordings, work / "recordings")
    except OSError as exc:
        raise CertificateError(f"{out}: cannot be written ({exc.strerror}).") from exc


def _about(certificate: Certificate) -> list[str]:
    lines = [f"Made {certificate.created} by {certificate.program}. Rig file: SHA-256 {certificate.rig_sha256[:16]}.",
             "Every interval holds the true value in about 95 of 100 certificates."]
    if certificate.simulated:
        lines.append("This is the simulated rig: it shows that the measurement works, and says nothing of a real rig.")
    return lines


def _in_short(line: Line) -> str:
    return " ".join(text for text in (line.sentence, line.cause) if text)


def _value(one: Figure) -> str:
    return f"{number(one.value, _spread(one))} {one.unit}".strip()


def _range(one: Figure) -> str:
    return "" if one.low is None and one.high is None else (
        f"{number(one.interval.low, _spread(one))} to {number(one.interval.high, _spread(one))}")


def _spread(one: Figure) -> float:
    return 0.0 if one.value is None or one.low is None or one.high is None else one.interval.half_width


# -- HTML --------------------------------------------------------------------------------------------------------------

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1c1c1c; background: #fff; max-width: 60rem; margin: 2rem auto;
       padding: 0 1rem; }
h1 { margin-bottom: 0; } h2 { margin: 2.5rem 0 .3rem; border-top: 1px solid #ccc; padding-top: 1rem; }
table { border-collapse: collapse; width: 100%; margin: .8rem 0; }
th { text-align: left; font-weight: 600; border-bottom: 2px solid #888; }
td, th { padding: .2rem .8rem .2rem 0; vertical-align: top; } td { border-bottom: 1px solid #e4e4e4; }
td.n { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; } th.n { text-align: right; }
.word { font-weight: 700; } .muted { color: #666; } svg { max-width: 100%; height: auto; }
@media print { h2 { break-after: avoid; } svg { break-inside: avoid; } }
"""


def to_html(certificate: Certificate) -> str:
    """One file without scripts or links to elsewhere."""
    rows = "".join(f"<tr><td><a href=\"#{line.code}\">{html.escape(line.title)}</a></td>{_word(line)}"
                   f"<td>{html.escape(_in_short(line))}</td></tr>" for line in certificate.lines)
    about = "".join(f"<p class=\"muted\">{html.escape(text)}</p>" for text in _about(certificate))
    return (f"<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Certificate of "
            f"{html.escape(certificate.rig)}</title><style>{_STYLE}</style></head><body>"
            f"<h1>Certificate of {html.escape(certificate.rig)}</h1><p>{html.escape(certificate.summary)}</p>{about}"
            f"<table><tr><th>Line</th><th>Verdict</th><th>In words</th></tr>{rows}</table>"
            f"{''.join(_section(line) for line in certificate.lines)}</body></html>\n")


def _word(line: Line) -> str:
    colour = "".join(f"{round(255 * part):02x}" for part in INKS[line.verdict])
    return f"<td class=\"word\" style=\"color:#{colour};white-space:nowrap\">{line.verdict}</td>"


def _section(line: Line) -> str:
    parts = [f"<h2 id=\"{line.code}\">{html.escape(line.title)}: {line.verdict}</h2>"]
    parts += [f"<p>{html.escape(text)}</p>" for text in (line.sentence, line.cause, line.remedy) if text]
    drawing = chart_of(line)
    if drawing is not None:
        parts.append(drawing.to_svg().decode())
    if line.figures:
        parts.append("<table><tr><th>Figure</th><th class=\"n\">Value</th><th class=\"n\">95 % interval</th>"
                     "<th>The thesis</th></tr>")
        parts += [f"<tr><td>{html.escape(one.name)}</td><td class=\"n\">{html.escape(_value(one))}</td>"
                  f"<td class=\"n\">{_range(one)}</td><td>{html.escape(one.thesis)}</td></tr>" for one in line.figures]
        parts.append("</table>")
    return "".join(parts)


# -- PDF ---------------------------------------------------------------------------------------------------------------

@dataclass
class _Paper:
    """Pages that fill from the top."""

    title: str
    pages: list[Drawing] = field(default_factory=list)
    y: float = _MARGIN
    boxes: list[Box] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)
    strokes: list[Stroke] = field(default_factory=list)

    def need(self, height: float) -> None:
        """A new page unless so much is left of this one."""
        if self.y + height > _HEIGHT - _MARGIN:
            self.turn()

    def turn(self) -> None:
        """Finish this page."""
        foot = Text(_MARGIN, _HEIGHT - 10.0, 2.6, f"{self.title}, page {len(self.pages) + 1}", ink=_GREY)
        self.pages.append(Drawing(_WIDTH, _HEIGHT, tuple(self.boxes), (*self.texts, foot), self.title,
                                  tuple(self.strokes)))
        self.boxes, self.texts, self.strokes, self.y = [], [], [], _MARGIN

    def write(self, text: str, size: float = _TEXT_MM, *, x: float = _MARGIN, right: float = _WIDTH - _MARGIN,
              bold: bool = False, ink: Ink = BLACK) -> None:
        """A paragraph from here on."""
        for line in wrapped(text, size, right - x, bold=bold):
            self.need(_LINE_MM)
            self.y += size * 1.42
            self.texts.append(Text(x, self.y - 0.35 * size, size, line, bold, ink))

    def rule(self) -> None:
        """A thin line across."""
        self.strokes.append(Stroke(((_MARGIN, self.y), (_WIDTH - _MARGIN, self.y)), 0.15, _GREY))
        self.y += 1.0

    def cells(self, cells: Sequence[tuple[float, float, str]], *, bold: bool = False, word: Word | None = None) -> None:
        """One row of a table: (left, right, text) each, wrapped."""
        columns = [(left, wrapped(text, 2.8, right - left, bold=bold)) for left, right, text in cells]
        height = 4.0 * max(len(lines) for _, lines in columns) + 0.6
        self.need(height)
        for left, lines in columns:
            for k, text in enumerate(lines):
                marked = word is not None and text == word
                self.texts.append(Text(left, self.y + 3.1 + 4.0 * k, 2.8, text, bold or marked,
                                       INKS[word] if word is not None and marked else BLACK))
        self.y += height

    def draw(self, drawing: Drawing) -> None:
        """A chart, in true size."""
        self.need(drawing.height)
        x, y = _MARGIN, self.y
        self.boxes += [Box(box.x + x, box.y + y, box.width, box.height, box.ink) for box in drawing.boxes]
        self.strokes += [Stroke(tuple((a + x, b + y) for a, b in stroke.points), stroke.width, stroke.ink)
                         for stroke in drawing.strokes]
        self.texts += [Text(text.x + x, text.y + y, text.height, text.text, text.bold, text.ink)
                       for text in drawing.texts]
        self.y += drawing.height + 2.0


def to_pdf(certificate: Certificate) -> bytes:
    """The same on A4: a table of verdicts, then a section for each line."""
    paper = _Paper(f"Certificate of {certificate.rig}")
    paper.write(paper.title, 6.5, bold=True)
    paper.y += 1.0
    paper.write(certificate.summary)
    for text in _about(certificate):
        paper.write(text, ink=_GREY)
    paper.y += 3.0
    edges = (_MARGIN, 55.0, 82.0, _WIDTH - _MARGIN)
    paper.cells(_row(edges, ("Line", "Verdict", "In words")), bold=True)
    paper.rule()
    for line in certificate.lines:
        paper.cells(_row(edges, (line.title, line.verdict, _in_short(line))), word=line.verdict)
    for line in certificate.lines:
        _write_section(paper, line)
    paper.turn()
    return pdf_of(paper.pages, paper.title)


def _row(edges: Sequence[float], texts: Sequence[str]) -> list[tuple[float, float, str]]:
    return [(left, right - 2.0, text) for left, right, text in zip(edges[:-1], edges[1:], texts, strict=True)]


def _write_section(paper: _Paper, line: Line) -> None:
    drawing = chart_of(line)
    paper.y += 5.0
    paper.need(30.0 + (drawing.height if drawing is not None else 0.0))
    paper.rule()
    paper.write(f"{line.title}: {line.verdict}", 4.4, bold=True, ink=INKS[line.verdict])
    for text in (line.sentence, line.cause, line.remedy):
        if text:
            paper.write(text)
    paper.y += 1.5
    if drawing is not None:
        paper.draw(drawing)
    if not line.figures:
        return
    edges = (_MARGIN, 85.0, 108.0, 143.0, _WIDTH - _MARGIN)
    paper.cells(_row(edges, ("Figure", "Value", "95 % interval", "The thesis")), bold=True)
    paper.rule()
    for one in line.figures[:_MOST_FIGURES]:
        paper.cells(_row(edges, (one.name, _value(one), _range(one), one.thesis)))
    if len(line.figures) > _MOST_FIGURES:
        paper.write(f"{len(line.figures) - _MOST_FIGURES} more figures are in certificate.html and certificate.json.",
                    ink=_GREY)


_WIDTHS = {**dict.fromkeys("ijl'|", 0.222), **dict.fromkeys("ftI.,:;/!()[] ", 0.278), "r": 0.333, "-": 0.333,
           "m": 0.833, "M": 0.833, "w": 0.722, "W": 0.944, **dict.fromkeys("ckszxvyJ", 0.5), "%": 0.889, "–": 0.556,
           **dict.fromkeys("ABEKPSVXY", 0.667), **dict.fromkeys("CDHNRU", 0.722), **dict.fromkeys("GOQ", 0.778)}
"""Of Helvetica's letters, ems (Adobe's font metrics); all others are 0.556 or narrower."""


def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """mm that a text of that size takes in Helvetica; bold letters are at most a tenth wider."""
    return size * sum(_WIDTHS.get(letter, 0.556) for letter in text) * (1.1 if bold else 1.0)


def wrapped(text: str, size: float, width: float, *, bold: bool = False) -> list[str]:
    """The text in lines that fit into `width` mm; a word that does not fit stands alone."""
    lines, line = list[str](), ""
    for word in text.split():
        longer = f"{line} {word}" if line else word
        if line and text_width(longer, size, bold=bold) > width:
            lines.append(line)
            line = word
        else:
            line = longer
    return [*lines, line] if line or not lines else lines


