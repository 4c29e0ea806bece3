"""A certificate as a page for people: HTML with charts, PDF of the same drawing, JSON with the raw numbers.

All three or none appear: the folder is renamed into place when it is complete.
"""

from __future__ import annotations

import html
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.certificate.charts import chart_of
from rhot_app.certificate.document import Certificate, Figure, Line, Word, number
from rhot_app.certificate.recordings import ProtocolFile, copy_protocol
from rhot_app.errors import CertificateError
from rhot_app.simulator.film.film import new_folder
from rhot_app.vector_graphics import BLACK, Ink, new_pdf, printable, rgb_of
from rhot_node.files import write_document

if TYPE_CHECKING:
    from fpdf import FPDF

INKS: dict[Word, Ink] = {"agrees": (0.10, 0.45, 0.20), "differs": (0.75, 0.12, 0.10),
                         "not measured": (0.55, 0.40, 0.0)}
"""Of the verdicts; each also stands in words, because a colour alone says nothing to some readers."""

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
    chart = chart_of(line)
    if chart is not None:
        parts.append(chart.draw().to_svg().decode())
    if line.figures:
        parts.append("<table><tr><th>Figure</th><th class=\"n\">Value</th><th class=\"n\">95 % interval</th>"
                     "<th>The thesis</th></tr>")
        parts += [f"<tr><td>{html.escape(one.name)}</td><td class=\"n\">{html.escape(_value(one))}</td>"
                  f"<td class=\"n\">{_range(one)}</td><td>{html.escape(one.thesis)}</td></tr>" for one in line.figures]
        parts.append("</table>")
    return "".join(parts)


def to_pdf(certificate: Certificate) -> bytes:
    """The same on A4: a table of verdicts, then a section for each line."""
    title = f"Certificate of {certificate.rig}"
    pdf = new_pdf(title, foot=printable(title))
    _write(pdf, title, 18.0, bold=True)
    pdf.ln(1.0)
    _write(pdf, certificate.summary)
    for text in _about(certificate):
        _write(pdf, text, ink=_GREY)
    pdf.ln(3.0)
    _table(pdf, (37.0, 27.0, 110.0), ("Line", "Verdict", "In words"),
           [(line.title, line.verdict, _in_short(line)) for line in certificate.lines], INKS)
    for line in certificate.lines:
        _write_section(pdf, line)
    return bytes(pdf.output())


def _write(pdf: FPDF, text: str, points: float = 8.8, *, bold: bool = False, ink: Ink = BLACK) -> None:
    """A paragraph."""
    pdf.set_font("Helvetica", "B" if bold else "", points)
    pdf.set_text_color(*rgb_of(ink))
    pdf.multi_cell(0.0, 0.5 * points, printable(text), align="L", new_x="LMARGIN", new_y="NEXT")


def _table(pdf: FPDF, widths: tuple[float, ...], heads: tuple[str, ...], rows: list[tuple[str, ...]],
           inks: Mapping[Word, Ink] | None = None) -> None:
    """Heads above a line, rows that break between pages; `inks`: of cells that say so."""
    from fpdf.fonts import FontFace

    styles: dict[str, FontFace] = {}
    for word, ink in (inks or {}).items():
        styles[word] = FontFace(emphasis="BOLD", color=rgb_of(ink))
    pdf.set_font("Helvetica", "", 8.0)
    pdf.set_text_color(0, 0, 0)
    pdf.set_draw_color(*rgb_of(_GREY))
    pdf.set_line_width(0.15)
    with pdf.table(col_widths=widths, width=sum(widths), align="LEFT", text_align="LEFT", line_height=4.0,
                   borders_layout="SINGLE_TOP_LINE", headings_style=FontFace(emphasis="BOLD")) as table:
        for cells in (heads, *rows):
            row = table.row()
            for text in cells:
                row.cell(printable(text), style=styles.get(text))


def _write_section(pdf: FPDF, line: Line) -> None:
    chart = chart_of(line)
    drawing = None if chart is None else chart.draw()
    pdf.ln(5.0)
    if pdf.will_page_break(30.0 + (drawing.height if drawing is not None else 0.0)):
        pdf.add_page()
    pdf.set_draw_color(*rgb_of(_GREY))
    pdf.line(pdf.l_margin, pdf.get_y(), pdf.w - pdf.r_margin, pdf.get_y())
    pdf.ln(1.0)
    _write(pdf, f"{line.title}: {line.verdict}", 12.5, bold=True, ink=INKS[line.verdict])
    for text in (line.sentence, line.cause, line.remedy):
        if text:
            _write(pdf, text)
    pdf.ln(1.5)
    if drawing is not None:
        drawing.draw_on(pdf, pdf.l_margin, pdf.get_y())
        pdf.ln(drawing.height + 2.0)
    if not line.figures:
        return
    shown = line.figures[:_MOST_FIGURES]
    _table(pdf, (67.0, 23.0, 35.0, 49.0), ("Figure", "Value", "95 % interval", "The thesis"),
           [(one.name, _value(one), _range(one), one.thesis) for one in shown])
    if len(line.figures) > len(shown):
        _write(pdf, f"{len(line.figures) - len(shown)} more figures are in certificate.html and certificate.json.",
               ink=_GREY)
