"""``rhot certify``: measure a rig as chapter 7 of the thesis does, and write its certificate."""

from __future__ import annotations

import argparse
import contextlib
import shutil
import sys
import tempfile
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.errors import CertificateError
from rhot_app.options import add_json_argument, add_out_argument, add_rig_argument, add_seed_argument
from rhot_node.compiled import announce_compilation
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.certificate.document import Certificate
    from rhot_app.certificate.recordings import ProtocolFile
    from rhot_app.progress import ProgressLine
    from rhot_app.project import Rig

DIFFERS = 1
"""Exit code of a certificate with a line that differs: the work is done, and its result is no."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot certify``."""
    add_rig_argument(parser, "the rig file that is certified")
    parser.add_argument("--recordings", type=Path, default=None, metavar="DIR",
                        help="recordings made before, with protocol.json; without it, and without --step and "
                             "--simulated, the running engine records now, step by step in this terminal")
    parser.add_argument("--step", action="append", default=[], metavar="NAME...=FILE",
                        help="a raw log as one step, in the place of that of --recordings, with what was measured by "
                             "hand: static:palm=FILE (or back; neither when it was no hand), ruler:MM:MARKER=FILE "
                             "(repeatable), rod:MM:UPPER,LOWER=FILE and plumb:UPPER,LOWER=FILE, from marker to marker")
    parser.add_argument("--simulated", action="store_true",
                        help="the whole protocol on the simulated rig, unattended; --rig is then optional")
    parser.add_argument("--sketched", action="store_true", help="the simulated rig without pictures, much faster")
    add_seed_argument(parser, "the simulated rig")
    parser.add_argument("--keep", type=Path, default=None, metavar="DIR", help="new folder that keeps the recordings")
    add_out_argument(parser, "new folder for certificate.html, .pdf and .json (default: certificate-DATE-TIME)",
                     metavar="DIR")
    parser.add_argument("--compare", type=Path, nargs=2, default=None, metavar=("OLD", "NEW"),
                        help="two certificates (their folders or JSON files): what changed beyond the intervals")
    add_json_argument(parser)
    add_examples(parser, "rhot certify --rig desk.json --keep recordings",
                 "rhot certify --simulated --sketched --out certificate")


def run(args: argparse.Namespace) -> int:
    """Collect, solve, judge, report; returns 1 when a line differs."""
    from rhot_app.progress import ProgressLine, within

    if args.compare is not None:
        return _compare(args)
    out = args.out or Path(f"certificate-{datetime.now():%Y%m%d-%H%M%S}")
    _check(args, out)
    announce_compilation()
    line = ProgressLine("certificate", sys.stderr)
    with contextlib.ExitStack() as stack:
        folder = args.recordings or _folder(args, out, stack)
        rig, protocol = _recorded(args, folder, line)
        from rhot_app.certificate.certify import certify
        from rhot_app.certificate.report import write_report

        try:
            certificate = certify(folder, protocol, rig, within(line.report, 0.5 if args.simulated else 0.0, 1.0))
        except OSError as exc:
            raise CertificateError(f"{folder}: cannot be read ({exc.strerror}).") from exc
        write_report(out, certificate, recordings=(folder, protocol) if _guided(args) else None)
    line.finish()
    _tell(certificate, out, as_json=args.json)
    return DIFFERS if certificate.count("differs") else 0


def _check(args: argparse.Namespace, out: Path) -> None:
    """Before the work, not after."""
    if args.rig is None and not args.simulated:
        raise CertificateError("--rig FILE says which rig is certified; or give --simulated.")
    if args.simulated and (args.recordings is not None or args.step):
        raise CertificateError("--simulated makes its own recordings: leave out --recordings and --step, or it.")
    if args.sketched and not args.simulated:
        raise CertificateError("--sketched is of the simulated rig: give --simulated too.")
    for folder in (out, args.keep, Path(f"{out}-recordings") if _guided(args) else None):
        if folder is not None and folder.exists():
            raise CertificateError(f"{folder} exists already; choose another folder or remove it.")
        if folder is not None and not folder.absolute().parent.is_dir():
            raise CertificateError(f"{folder.absolute().parent} is not a folder; create it first.")
    if not (args.recordings or args.step or args.simulated or sys.stdin.isatty()):
        raise CertificateError("there is no terminal to ask in: give --recordings DIR, --step NAME=FILE or "
                               "--simulated.")


def _guided(args: argparse.Namespace) -> bool:
    """Whether a person records now."""
    return not (args.recordings or args.step or args.simulated)


def _folder(args: argparse.Namespace, out: Path, stack: contextlib.ExitStack) -> Path:
    """Where recordings are made: kept, or thrown away at the end. What a person has recorded is thrown away only when
    it stands in the certificate as well."""
    if args.keep is None and not _guided(args):
        return Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="rhot-certify-")))
    folder = Path((args.keep or Path(f"{out}-recordings")).absolute())
    folder.mkdir()
    if args.keep is None:
        stack.push(lambda kind, error, trace: _leave(folder, kind is None))
    return folder


def _leave(folder: Path, done: bool) -> bool:
    """Remove the recordings, or say where they are."""
    if done:
        shutil.rmtree(folder)
    else:
        print(f"What was recorded is in {folder}; --recordings goes on with it.", file=sys.stderr)
    return False


def _recorded(args: argparse.Namespace, folder: Path, line: ProgressLine) -> tuple[Rig, ProtocolFile]:
    """The rig, and what there is of it; recordings are made where none are given."""
    from rhot_app.certificate.collect import collect, merged, protocol_of_steps
    from rhot_app.certificate.recordings import read_protocol
    from rhot_app.progress import within
    from rhot_app.project import load_rig

    rig = None if args.rig is None else load_rig(args.rig)
    if args.simulated:
        from rhot_app.certificate.simulated import record_protocol
        from rhot_app.simulator.scene.scene import build_rig, make_scene, twin_defaults

        scene = make_scene(twin_defaults(), args.seed)
        protocol = record_protocol(scene, folder, sketched=args.sketched, progress=within(line.report, 0.0, 0.5))
        return rig or build_rig(scene), protocol
    assert rig is not None
    if args.step or args.recordings is not None:
        given = protocol_of_steps(args.step)
        return rig, given if args.recordings is None else merged(read_protocol(args.recordings), given)
    from rhot_app.engine.client import EngineClient

    with EngineClient(states=False, events=False) as engine:
        return rig, collect(folder, rig, engine, input)


def _tell(certificate: Certificate, out: Path, *, as_json: bool) -> None:
    if as_json:
        import msgspec

        print(msgspec.json.encode({"out": str(out.absolute()), "summary": certificate.summary,
                                   "certificate": certificate}).decode())
        return
    print(certificate.summary)
    for line in certificate.lines:
        print(f"  [{line.verdict}] {line.title}: "
              f"{' '.join(text for text in (line.sentence, line.cause, line.remedy) if text)}")
    print(f"Written: {out / 'certificate.html'}, certificate.pdf, certificate.json")


def _compare(args: argparse.Namespace) -> int:
    from rhot_app.certificate.document import compare, read_certificate

    found, notes = compare(*(read_certificate(path) for path in args.compare))
    changed = [one for one in found if one.changed]
    if args.json:
        import json

        print(json.dumps({"compared": len(found), "changed": [one.sentence for one in changed], "notes": notes}))
        return 0
    print(f"{len(changed)} of {len(found)} figures changed beyond their intervals.")
    for sentence in [*(one.sentence for one in changed), *notes]:
        print(f"  {sentence}")
    return 0
