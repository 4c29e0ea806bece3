"""What a person reads in the window passes `tr`, and the translations fit: complete, with the same
placeholders, and made into the file that the app loads."""

from __future__ import annotations

import ast
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from resources.translations.update import collect, release, shown_names
from rhot_app.ui.language import LANGUAGES, placeholders

ROOT = Path(__file__).parents[2]
UI = ROOT / "rhot_app" / "ui"
TRANSLATIONS = ROOT / "resources" / "translations"
LANGUAGE_FILES = sorted(TRANSLATIONS.glob("rhot_*.ts"))

ENGINE = ROOT / "rhot_app" / "engine"
MARKS = {"tr", "tr_noop"}
ADVICE = {"advise", "words"}
"""What marks the engine's sentences, which the window translates."""

SHOWING = {
    "setText", "setToolTip", "setWindowTitle", "setTitle", "setAccessibleName", "setPlaceholderText", "setLabelText",
    "setSpecialValueText", "setHorizontalHeaderLabels", "addItem", "addTab", "addRow", "addMenu", "drawText",
    "QLabel", "QAction", "QPushButton", "QCheckBox", "QRadioButton", "QMenu", "QToolBar", "QDockWidget", "Column",
    "EmptyState", "plain_button"}
"""What is given to these is read, a single word as well."""

INTERNAL = {
    "setObjectName", "setProperty", "property", "findChild", "setStyleSheet", "fromString", "QKeySequence",
    "flag", "set_flag", "remembered", "remember", "strftime", "Thread", "put_away", "tip", "TypeError", "parse_rig",
    "add_argument", "exception", "debug"}
"""What is given to these is never read: names, keys, styles, logs."""

NO_WORDS = {
    "rhot_app/ui/app.py": "the command line is English",
    "rhot_app/ui/demo_command.py": "the command line is English",
    "rhot_app/ui/handfit/fit_command.py": "the command line is English",
    "rhot_app/ui/scene/mesh_item.py": "shaders",
}
NOT_TRANSLATED = {
    "names in the settings and the session": (
        "in true size", "clouds larger", "clouds of {}", "next steps", "board printed", "fit/anchor sd px",
        "show the recording's folder", "simulated nodes", "pose source", "pose source detail", "pose tracker",
        "lens camera", "to come", "under way"),
    "terms of `tip`, keys of tables": ("node rate", "fingertip difference", "first {}", "other {}", "left", "right"),
    "columns of copied tables": ("time [s]", "all p50", "all p99"),
    "reasons in a rig's history, which others may read": (
        "choosing the tracker {}", "hand {} times as large", "{}, fitted to pictures", "hand fitted to pictures",
        "{} what was before the {}"),
    "versions for a report of a fault, licences, proper names": (
        "RHOT", "RHOT {}", "Python {}", "Qt {}", "System {}", "Screen {}", "License :: OSI Approved :: ",
        "three.js (web view)", "JSON over WebSocket", "Lab Streaming Layer",
        "AprilGrid (Kalibr)"),
    "only its width counts": ("00:00.00 of 00:00.00",),
}
"""Texts that stay English, by the reason."""

NO_WORD = re.compile(r"\b(?:sigma|Ctrl|Shift)\b|\*\.\w+|\{\}")
"""The same in every language; other units and abbreviations have less than three letters."""


def functions_around(stack: list[ast.AST]) -> Iterator[str]:
    """Names of what a node is given to, the nearest first."""
    for node in reversed(stack):
        if isinstance(node, ast.Call):
            yield node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        elif not isinstance(node, (ast.keyword, ast.IfExp, ast.BoolOp, ast.JoinedStr, ast.FormattedValue, ast.Tuple,
                                   ast.List)):
            return


def texts(tree: ast.AST) -> Iterator[tuple[ast.expr, str, list[ast.AST]]]:
    """String literals but docstrings, keys of dictionaries and what is compared, with what is around them. "{}" stands
    for the values of an f-string."""
    docstrings = {id(node.body[0].value) for node in ast.walk(tree)
                  if isinstance(getattr(node, "body", None), list) and node.body
                  and isinstance(node.body[0], ast.Expr)}

    def visit(node: ast.AST, stack: list[ast.AST]) -> Iterator[tuple[ast.expr, str, list[ast.AST]]]:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield node, node.value, stack
        if isinstance(node, ast.JoinedStr):
            yield node, "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values), stack
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "format_spec") or (name, type(node)) == ("keys", ast.Dict):
                continue
            if isinstance(node, (ast.Compare, ast.Subscript)) and name in ("comparators", "slice", "left"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST) and not (isinstance(node, ast.JoinedStr)
                                                       and isinstance(child, ast.Constant)):
                    yield from visit(child, [*stack, node])

    yield from visit(tree, [])


def unmarked(source: str) -> Iterator[tuple[int, str]]:
    """(line, text) of words that a person reads and that pass no `tr`."""
    for node, text, stack in texts(ast.parse(source)):
        around = list(functions_around(stack))
        if set(around) & (MARKS | INTERNAL) or not re.search("[A-Za-z]{3}", NO_WORD.sub("", text)):
            continue
        if re.search(r"\S\s+\S", text) or set(around[:1]) & SHOWING:
            yield node.lineno, text


def marked(source: str, marks: set[str] = MARKS) -> Iterator[tuple[str, str]]:
    """(text, comment or plural) of the literals that pass `tr`."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in marks:
            words = [part.value for part in node.args[:2] if isinstance(part, ast.Constant)]
            if words and isinstance(words[0], str):
                yield words[0], words[1] if len(words) > 1 and isinstance(words[1], str) else ""


@cache
def translations(path: Path) -> dict[tuple[str, str], list[str]]:
    """By (text, comment): the forms of the translation, none while it is unfinished."""
    found = {}
    for message in ElementTree.parse(path).iter("message"):
        translation = message.find("translation")
        assert translation is not None
        forms = [form.text or "" for form in translation.iter("numerusform")] or [translation.text or ""]
        unfinished = translation.get("type") == "unfinished"
        found[message.findtext("source", ""), message.findtext("comment", "")] = [] if unfinished else forms
    return found


@cache
def written() -> set[tuple[str, str]]:
    """All (text, comment) that can be translated."""
    return {*(key for source in UI.rglob("*.py") for key in marked(source.read_text())),
            *((text, "") for source in ENGINE.rglob("*.py") for text, _ in marked(source.read_text(), ADVICE)),
            *((text, "") for text in shown_names())}


def test_what_a_person_reads_passes_tr() -> None:
    allowed = {text for group in NOT_TRANSLATED.values() for text in group}
    found = [f"{name}:{line}: {text!r}" for path in sorted(UI.rglob("*.py"))
             if (name := str(path.relative_to(ROOT))) not in NO_WORDS
             for line, text in unmarked(path.read_text()) if text not in allowed]
    assert not found, "write tr(\"...\"), or say in this file why not:\n" + "\n".join(found)


@pytest.mark.parametrize(("source", "found"), [
    ('label.setText("Two words")', ["Two words"]), ('label.setText(tr("Two words"))', []),
    ('QPushButton("Open")', ["Open"]), ('say(f"saved {path}")', ["saved {}"]), ('name = "key"', []),
    ('say(tr("{n} file", "{n} files", len(names)))', []), ('part.setObjectName("a name")', []),
    ('"""Two words."""', []), ('words = {"a key": 1}', []), ('label.setText(f"{value:.1f} mm")', []),
    ('QLabel("rig" if rig else "no rig")', ["rig", "no rig"])])
def test_words_without_tr_are_found(source: str, found: list[str]) -> None:
    assert [text for _, text in unmarked(source)] == found


def test_tr_has_literals() -> None:
    """`pyside6-lupdate` collects nothing else."""
    wrong = [f"{path.relative_to(ROOT)}:{node.lineno}" for path in sorted(UI.rglob("*.py"))
             for node in ast.walk(ast.parse(path.read_text()))
             if isinstance(node, ast.Call) and getattr(node.func, "id", "") in MARKS
             and isinstance(node.args[0], (ast.JoinedStr, ast.BinOp))]
    assert not wrong, f"tr() of an f-string or a sum: use named placeholders: {', '.join(wrong)}"


def test_every_language_has_a_file_and_every_file_a_language() -> None:
    assert {path.stem.removeprefix("rhot_") for path in LANGUAGE_FILES} == LANGUAGES.keys() - {"en"}


@pytest.mark.parametrize("path", LANGUAGE_FILES, ids=lambda path: path.stem)
def test_translations_are_renewed_and_complete(path: Path) -> None:
    known = translations(path)
    assert known.keys() == written(), "run resources/translations/update.py"
    open_ = [text for text, comment in sorted(written()) if not known[text, comment] or not all(known[text, comment])]
    assert not open_, f"not in {path.name}:\n" + "\n".join(open_)


@pytest.mark.parametrize("path", LANGUAGE_FILES, ids=lambda path: path.stem)
def test_no_placeholder_differs(path: Path) -> None:
    wrong = [f"{text!r} -> {form!r}" for (text, _), forms in translations(path).items() for form in forms
             if placeholders(form) != placeholders(text)]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("path", LANGUAGE_FILES, ids=lambda path: path.stem)
def test_what_the_app_loads_is_what_is_written(path: Path, tmp_path: Path) -> None:
    release(path, tmp_path / "made.qm")
    same = (tmp_path / "made.qm").read_bytes() == path.with_suffix(".qm").read_bytes()
    assert same, "run resources/translations/update.py"


def test_sentences_are_collected_as_this_file_reads_them(tmp_path: Path) -> None:
    """The tool of Qt and the tests here agree about a file that has every form."""
    begun = tmp_path / "rhot_fr.ts"
    collect(begun)
    assert translations(begun).keys() == written()
