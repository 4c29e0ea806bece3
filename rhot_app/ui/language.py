"""The language of the window. English sentences are the keys of Qt translations in `resources/translations`.

A sentence is written as ``tr("The rig was saved to {path}.", path=path)``: a literal, never an f-string, because
`pyside6-lupdate` collects the literals. `resources/translations/update.py` renews the files.
"""

from __future__ import annotations

import string
from datetime import datetime
from functools import lru_cache
from typing import Any, Final

from PySide6.QtCore import QCoreApplication, QDateTime, QLibraryInfo, QLocale, QTranslator

from rhot_node.files import resource_path

LANGUAGES: Final = {"en": "English", "de": "Deutsch"}
"""By code: the name of the language in the language itself."""

_language = ["en"]
_translators: list[QTranslator] = []  # ours first, then Qt's own; empty for English


def tr(text: str, comment: str = "", n: int | None = None, /, **values: Any) -> str:
    """`text` in the language of the window, with `values` for its named placeholders, as `str.format` has them.

    With a count `n`, `text` is the singular and `comment` the plural, and `{n}` stands for the count:
    ``tr("{n} marker", "{n} markers", count)``. Otherwise `comment` tells two meanings of one English text apart.
    """
    pattern = _pattern(text, comment, n)
    if n is not None:
        return pattern.format(n=n, **values)
    return pattern.format(**values) if values else pattern


def tr_noop(text: str) -> str:
    """Mark a literal that stands in a table: `tr` translates it where it is shown (Qt: QT_TR_NOOP)."""
    return text


@lru_cache(maxsize=8192)
def _pattern(text: str, comment: str, n: int | None) -> str:
    """The translation without values; the English text where there is none, or one with other placeholders."""
    english = comment if n is not None and n != 1 else text
    found = _translators[0].translate("", text, comment, -1 if n is None else n) if _translators and text else None
    return found if found and placeholders(found) == placeholders(english) else english


def placeholders(text: str) -> list[str] | None:
    """The placeholders of a text with their formats, sorted; None when it has a brace that is none."""
    try:
        return sorted(f"{name}!{conversion}:{spec}" for _, name, spec, conversion in string.Formatter().parse(text)
                      if name is not None)
    except ValueError:
        return None


def language_of(choice: str) -> str:
    """The language for a choice of the settings: itself, or for "system" the first of the desktop's that there is."""
    if choice in LANGUAGES:
        return choice
    wanted = (name.replace("_", "-").partition("-")[0] for name in QLocale.system().uiLanguages())
    return next((name for name in wanted if name in LANGUAGES), "en")


def language() -> str:
    """The code of the language that is used."""
    return _language[0]


def date_text(at: datetime) -> str:
    """Day and minute, e.g. "01 May 2026, 10:00"."""
    return QLocale(language()).toString(QDateTime.fromSecsSinceEpoch(round(at.timestamp())),
                                        tr("dd MMM yyyy, HH:mm"))


def use_language(choice: str) -> None:
    """Translate from now on what is shown anew, Qt's own dialogs as well; ``"en"`` or an unknown code: English.

    Numbers keep the decimal point in every language, as files and copied figures have it.
    """
    QLocale.setDefault(QLocale.c())
    for old in _translators:
        QCoreApplication.removeTranslator(old)
    _translators.clear()
    _pattern.cache_clear()
    name = _language[0] = language_of(choice)
    for file in (resource_path("translations", f"rhot_{name}.qm"),
                 QLibraryInfo.path(QLibraryInfo.LibraryPath.TranslationsPath) + f"/qtbase_{name}.qm"):
        translator = QTranslator()
        if name != "en" and translator.load(str(file)):
            if QCoreApplication.instance() is not None:
                QCoreApplication.installTranslator(translator)
            _translators.append(translator)
