"""``rhot hand``: look at a hand file, make one of a given length and side, write it out as rows, draw it."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rhot_app.errors import RigError, input_file, positive_number
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.hand.anatomy import HandAnatomy
    from rhot_app.hand.articulated import Articulated


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot hand``."""
    parser.add_argument("file", type=input_file, nargs="?", metavar="HAND",
                        help="a rhot-hand or rhot-articulated file; without it, the rig's hand or the shipped one")
    parser.add_argument("--length", type=positive_number, metavar="MM",
                        help="hand length to scale to, mm, from the wrist to the tip of the stretched middle finger")
    parser.add_argument("--proportions", choices=("table", "file"),
                        help="with --length: bones as published parts of it (the default), or as in the file")
    parser.add_argument("--side", choices=("right", "left"), help="which hand; the file's own without it")
    parser.add_argument("--name", help="what the file is to call it")
    parser.add_argument("--rows", action="store_true", help="make it a rhot-articulated file: Denavit-Hartenberg rows")
    add_out_argument(parser, "write the hand here")
    add_rig_argument(parser, "put the hand into this rig file, which keeps its former version", exists=False)
    parser.add_argument("--draw", type=Path, metavar="FILE.png", help="draw it from two sides")
    add_json_argument(parser)
    add_examples(parser, "rhot hand --length 185 --out mine.json", "rhot hand mine.json --draw mine.png")


def run(args: argparse.Namespace) -> int:
    """Make, check, write and show; raises RigError for what cannot be, before anything is written."""
    import msgspec

    from rhot_app.hand.articulated import Articulated
    from rhot_app.project import load_rig
    from rhot_app.rig_history import accept

    rig = load_rig(args.rig) if args.rig else None
    hand = _wanted(args, rig.hand if rig else None)
    _require_places(args)
    if rig and isinstance(hand, Articulated):
        raise RigError(f"--rig {args.rig}: a rig tracks a rhot-hand, not a rhot-articulated object.")
    picture = _picture(hand) if args.draw else b""
    if args.out:
        _write(args.out, hand)
    if args.draw:
        _store(args.draw, picture)
    if rig and not isinstance(hand, Articulated):
        accept(args.rig, msgspec.structs.replace(rig, hand=hand), "hand")
    fields = _object_fields(hand) if isinstance(hand, Articulated) else _hand_fields(hand)
    fields["written"] = [str(path) for path in (args.out, args.draw, args.rig) if path]
    print(json.dumps(fields) if args.json else "\n".join(_lines(fields)))
    return 0


def _wanted(args: argparse.Namespace, worn: HandAnatomy | None) -> HandAnatomy | Articulated:
    """The hand that the arguments ask for; `worn`: the rig's, to begin with when no file is named."""
    import msgspec

    from rhot_app.hand.articulated import Articulated, articulated_hand, scaled_to_length

    hand = worn if worn is not None and args.file is None else _read(args.file)
    if args.proportions and args.length is None:
        raise RigError("--proportions says how to scale to a length; give that with --length.")
    try:
        if isinstance(hand, Articulated):
            if args.proportions == "table":
                raise RigError(f"{args.file}: a rhot-articulated object has no bones by name; scale it with "
                               "--proportions file.")
            hand = hand if args.length is None else scaled_to_length(hand, 1e-3 * args.length)
        else:
            hand = hand if args.length is None else _scaled(hand, args)
    except ValueError as exc:
        raise RigError(f"--length {args.length:g}: {exc}.") from exc
    hand = msgspec.structs.replace(hand, side=args.side or hand.side, name=args.name or _name(hand, args))
    return articulated_hand(hand) if args.rows and not isinstance(hand, Articulated) else hand


def _scaled(hand: HandAnatomy, args: argparse.Namespace) -> HandAnatomy:
    from rhot_app.hand.anthropometry import hand_length, require_human_length, scaled_by_hand_length, scaled_hand

    length = 1e-3 * args.length
    if args.proportions == "file":
        require_human_length(length)
        return scaled_hand(hand, length / hand_length(hand))
    return scaled_by_hand_length(hand, length)


def _name(hand: HandAnatomy | Articulated, args: argparse.Namespace) -> str:
    """What it was called; a hand that was made here says so."""
    if args.length is None and args.side in (None, hand.side):
        return hand.name
    words = [f"{args.side or hand.side} hand", *([f"{args.length:g} mm"] if args.length is not None else [])]
    return ", ".join(words)


def _read(path: Path | None) -> HandAnatomy | Articulated:
    from rhot_app.hand.anatomy import load_hand
    from rhot_app.hand.articulated import FORMAT, load_articulated
    from rhot_node.files import read_json, resource_path

    if path is None:
        return load_hand(resource_path("hands", "right.json"))
    try:
        document = read_json(path, RigError)
    except RigError:
        return load_hand(path)  # which says what is wrong
    rows = isinstance(document, dict) and document.get("format") == FORMAT
    return load_articulated(path) if rows else load_hand(path)


def _require_places(args: argparse.Namespace) -> None:
    if args.draw is not None and args.draw.suffix.lower() != ".png":
        raise RigError(f"--draw {args.draw}: the picture is a PNG file; give it a name that ends in .png.")
    for path in (args.out, args.draw):
        if path is not None and not path.parent.is_dir():
            raise RigError(f"{path}: there is no folder {path.parent}. Make it first, or name another place.")


def _write(path: Path, hand: HandAnatomy | Articulated) -> None:
    from rhot_app.hand.anatomy import save_hand
    from rhot_app.hand.articulated import Articulated, save_articulated

    try:
        save_articulated(path, hand) if isinstance(hand, Articulated) else save_hand(path, hand)
    except OSError as exc:
        raise RigError(f"{path}: cannot be written ({exc.strerror}).") from exc


def _picture(hand: HandAnatomy | Articulated) -> bytes:
    """A PNG."""
    import cv2

    from rhot_app.hand.articulated import Articulated, articulated_hand
    from rhot_app.hand.articulated_model import build_articulated
    from rhot_app.hand.picture import draw

    image = draw(build_articulated(hand if isinstance(hand, Articulated) else articulated_hand(hand)))
    return bytes(cv2.imencode(".png", image[:, :, ::-1])[1])


def _store(path: Path, data: bytes) -> None:
    from rhot_node.files import write_atomically

    try:
        write_atomically(path, data)
    except OSError as exc:
        raise RigError(f"{path}: cannot be written ({exc.strerror}).") from exc


def _hand_fields(hand: HandAnatomy) -> dict[str, Any]:
    from rhot_app.hand.anthropometry import hand_length
    from rhot_app.hand.skeleton import BONES, FINGERS

    bones = {f"{finger}.{bone}": length for finger, names in zip(FINGERS, BONES, strict=True)
             for bone, length in zip(names, hand.fingers[finger].bones_mm, strict=True)}
    return {"name": hand.name, "side": hand.side, "length_mm": round(1e3 * hand_length(hand), 3), "bones_mm": bones}


def _object_fields(document: Articulated) -> dict[str, Any]:
    from rhot_app.hand.articulated_model import build_articulated

    model = build_articulated(document)
    return {"name": document.name, "side": document.side, "length_mm": document.length_mm,
            "bodies": [body.name for body in model.bodies], "frames": len(document.frames),
            "angles": list(model.angle_names), "state_numbers": len(model.rest),
            "degrees_of_freedom": len(model.rest) - 1}


def _lines(fields: dict[str, Any]) -> list[str]:
    """The same for people."""
    length = "" if fields["length_mm"] is None else f", {fields['length_mm']:.1f} mm long"
    lines = [f"{fields['name'] or 'unnamed'} ({fields['side']}{length})"]
    if "bones_mm" in fields:
        lines += [f"  {bone:18}{value:8.2f} mm" for bone, value in fields["bones_mm"].items()]
    else:
        lines.append(f"  {len(fields['bodies'])} bodies in {fields['frames']} frames, {fields['state_numbers']} state "
                     f"numbers, {fields['degrees_of_freedom']} degrees of freedom")
        lines.append(f"  bodies: {', '.join(fields['bodies'])}")
    return lines + [f"Written: {path}" for path in fields["written"]]
