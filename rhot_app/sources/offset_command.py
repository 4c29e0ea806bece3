"""``rhot offset``: how much later films of one scene began than the first one, by their sound or by a flash."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from rhot_app.errors import RecordingError, input_file
from rhot_app.options import add_json_argument
from rhot_node.terminal import add_examples


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot offset``."""
    parser.add_argument("films", nargs="+", metavar="NAME=FILM",
                        help="two or more films of one scene, by their cameras; paths alone are named as the files")
    parser.add_argument("--by", choices=("sound", "flash"), default="sound",
                        help="what all films have: the sound (default), or a light that goes on once")
    add_json_argument(parser)
    add_examples(parser, "rhot offset left=left.mp4 right=right.mp4",
                 "rhot offset left=left.mp4 right=right.mp4 --by flash")


def run(args: argparse.Namespace) -> int:
    """Compare every film with the first one and print what to add to its times. Raises RecordingError."""
    films = named_films(args.films)
    from rhot_app.progress import ProgressLine
    from rhot_app.sources.film_offset import offset_sentence, offsets_of

    line = ProgressLine("offsets")
    offsets = offsets_of(films, args.by, line.report)
    line.finish()
    if args.json:
        print(json.dumps({"by": args.by, "offsets_s": {name: one.seconds for name, one in offsets.items()},
                          "offsets_std_s": {name: one.std_s for name, one in offsets.items()}}))
        return 0
    print(" ".join(f"--offset-s {name}={one.seconds:.4f}" for name, one in list(offsets.items())[1:]))
    print(f"rhot: {offset_sentence(offsets, args.by)}", file=sys.stderr)
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
    return films
