"""``rhot history``: the earlier versions of a rig file, and bringing one back."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from rhot_app.calibration.commands.arguments import add_rig_or_file, rig_of
from rhot_app.errors import positive_count
from rhot_app.options import add_json_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.rig_history import Version


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot history``."""
    add_rig_or_file(parser)
    parser.add_argument("--restore", type=positive_count, metavar="N",
                        help="bring version N of the list back; what is there now becomes a version itself")
    add_json_argument(parser)
    add_examples(parser, "rhot history --rig desk.json", "rhot history --rig desk.json --restore 2")


def run(args: argparse.Namespace) -> int:
    """List the versions, newest first, or restore one."""
    from rhot_app import rig_history
    from rhot_app.errors import RigError

    rig = rig_of(args)
    versions = rig_history.versions(rig)
    if not versions and not rig.exists():
        raise RigError(f"{rig}: no such file, and no earlier version of it.")
    if args.restore is None:
        _show(args, versions)
        return 0
    if not 1 <= args.restore <= len(versions):
        counted = "; counting begins at 1, the newest" if versions else ""
        raise RigError(f"{rig} has no version {args.restore}: {_count(versions)}{counted}.")
    chosen = versions[args.restore - 1]
    rig_history.restore(rig, chosen)
    if args.json:
        print(json.dumps({"restored": _entry(args.restore, chosen), "written": str(rig)}))
    else:
        print(f"{rig} is again as it was before the {chosen.replaced_by} of {_when(chosen)}.")
    return 0


def _show(args: argparse.Namespace, versions: list[Version]) -> None:
    if args.json:
        print(json.dumps({"versions": [_entry(number, version) for number, version in enumerate(versions, 1)]}))
        return
    print(f"{rig_of(args)}: {_count(versions)}.")
    for number, version in enumerate(versions, 1):
        print(f"  {number}  until {_when(version)}, before: {version.replaced_by}")


def _entry(number: int, version: Version) -> dict[str, object]:
    return {"number": number, "replaced_at": version.replaced_at.isoformat(), "replaced_by": version.replaced_by,
            "path": str(version.path)}


def _count(versions: list[Version]) -> str:
    return {0: "no earlier versions", 1: "one earlier version"}.get(len(versions), f"{len(versions)} earlier versions")


def _when(version: Version) -> str:
    return version.replaced_at.astimezone().strftime("%Y-%m-%d %H:%M:%S")
