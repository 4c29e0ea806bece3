"""``rhot offset``: how much later films of one scene began than the first one, by their sound or by a flash."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from rhot_app.errors import RecordingError, input_file
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot offset``."""
    parser.add_argument("films", nargs="+", metavar="NAME=FILM",
                        help="two or more films of one scene, by their cameras; paths alone are named as the files")
    parser.add_argument("--by", choices=("sound", "flash"), default="sound",
                        help="what all films have: the sound (default), or a light that goes on once")
    parser.add_argument("--json", action="store_true", help="print one JSON object on standard output")
    add_examples(parser, "rhot offset left=left.mp4 right=right.mp4",
                 "rhot offset left=left.mp4 right=right.mp4 --by flash")


def run(args: argparse.Namespace) -> int:
    """Compare every film with the first one and print what to add to its times. Raises RecordingError."""
    films = named_films(args.films)
    from rhot_app.progress import ProgressLine
    from rhot_app.sources.film_offset import offsets_of

    line = ProgressLine("offsets")
    offsets = offsets_of(films, args.by, line.report)
    line.finish()
    words = " ".join(f"--offset-s {name}={seconds:.4f}" for name, seconds in list(offsets.items())[1:])
    print(json.dumps({"by": args.by, "offsets_s": offsets}) if args.json else words)
    return 0


def named_films(texts: list[str]) -> dict[str, Path]:
    """The films by name. Raises RecordingError and RhotError."""
    films: dict[str, Path] = {}
    for text in texts:
        name, _, path = text.rpartition("=") if not Path(text).exists() else ("", "", text)
        name = name or Path(path).stem
        if name in films:
            raise RecordingError(f"{text}: there are two films of {name}; name them, as in left={path}.")
        films[name] = input_file(path)
    if len(films) < 2:
        raise RecordingError("one film has no offset; give two or more of one scene.")
    return films
