"""Documents are read, so their sentences are short: at most 35 words, and lines of at most 100 characters.

A table cell is prose too, but a row cannot be broken, so its line may be long. Code blocks are no prose. A code span
counts as one word.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs" / "guide").glob("*.md"))]
MOST_WORDS = 35
MOST_CHARACTERS = 100

LIST_ITEM = re.compile(r"^\s*(?:[*+-]|\d+\.)\s+")
SENTENCE_END = re.compile(r"(?<=[.?!])[\"')*]*\s+(?=[\"'(*\[]*[A-Z0-9x])")
ABBREVIATIONS = re.compile(r"\b(?:[Ee]q|[Ff]ig|al|vs|e\.g|i\.e)\.")


def lines_of_prose(text: str) -> Iterator[tuple[int, str]]:
    """(number, line) outside of code blocks, fenced or indented; from 1 on. Blank lines separate blocks."""
    fenced, blank_before, in_list, code = False, True, False, False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
            yield number, ""
            continue
        if fenced:
            continue
        if not line.strip():
            blank_before = True
            yield number, ""
            continue
        in_list = bool(LIST_ITEM.match(line)) or (in_list and line.startswith(" "))
        code = line.startswith("    ") and not in_list and (blank_before or code)
        blank_before = False
        if not code:
            yield number, line


def blocks(text: str) -> Iterator[tuple[int, str]]:
    """(first line, text) of every paragraph, list item, heading and table cell."""
    start, block = 0, ""
    for number, line in lines_of_prose(text):
        row, heading = line.startswith("|"), line.startswith("#")
        if (not line or row or heading or LIST_ITEM.match(line)) and block:
            yield start, block
            block = ""
        if row:
            for cell in re.split(r"(?<!\\)\|", line):
                yield number, cell.strip()
        elif heading:
            yield number, line.lstrip("# ")
        elif line:
            start, block = (start, f"{block} {line.strip()}") if block else (number, LIST_ITEM.sub("", line, count=1))
    if block:
        yield start, block


def sentences(block: str) -> list[str]:
    """The sentences of a block; links by their words, code spans as one word."""
    text = re.sub(r"``.+?``|`[^`]*`", "x", block)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = ABBREVIATIONS.sub(lambda found: found.group()[:-1], text)
    return SENTENCE_END.split(text)


def words(sentence: str) -> int:
    return sum(any(character.isalnum() for character in word) for word in sentence.split())


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(ROOT)) for page in PAGES])
def test_no_sentence_is_long(page: Path) -> None:
    long = [f"{page.relative_to(ROOT)}:{number}: {words(sentence)} words: {sentence}"
            for number, block in blocks(page.read_text())
            for sentence in sentences(block) if words(sentence) > MOST_WORDS]
    assert not long, "\n".join(long)


@pytest.mark.parametrize("page", PAGES, ids=[str(page.relative_to(ROOT)) for page in PAGES])
def test_no_line_is_long(page: Path) -> None:
    long = [f"{page.relative_to(ROOT)}:{number}: {len(line)} characters: {line}"
            for number, line in lines_of_prose(page.read_text())
            if len(line) > MOST_CHARACTERS and not line.startswith(("|", "!["))
            and not re.fullmatch(r"\s*\S+", line)]
    assert not long, "\n".join(long)


@pytest.mark.parametrize(("text", "counts"), [
    ("One two. Three `rhot demo --seed 1` five.", [2, 3]),
    ("* a b\n  c\n* d", [3, 1]),
    ("**A b.** C + d e.", [2, 3]),
    ("| a b | c. D e |", [2, 1, 2]),
    ("a b\n\n    code that is long\n\nc", [2, 1]),
    ("```\ncode\n```\na [b c](d.md) (eq. 2.3) e", [6]),
])
def test_sentences_are_counted(text: str, counts: list[int]) -> None:
    found = [words(sentence) for _, block in blocks(text) for sentence in sentences(block)]
    assert [count for count in found if count] == counts
