"""How often the certificate's 95 % intervals hold what is true of the simulated rig, and a wrong one is named.

    python benchmarks/certificate_intervals.py [--seeds N] [--pictures] [--json FILE]

Prints, for every figure whose truth is known, in how many of the certificates its interval holds it, and its mean half
width; then, for rigs whose baseline is wrong by 1 %, how often the line differs and names the baseline. With --pictures
the nodes' own detector sees rendered pictures, which takes some minutes a seed.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import msgspec
import numpy as np
from tables import arguments, publish, table

from rhot_app.certificate.certify import certify
from rhot_app.certificate.document import Certificate
from rhot_app.certificate.recordings import ProtocolFile, read_recording
from rhot_app.certificate.simulated import Lengths, record_protocol
from rhot_app.project import Rig
from rhot_app.simulator.scene.scene import build_rig, make_scene, twin_defaults

LENGTHS = Lengths()
FACTORS = (0.99, 1.01)

TRUTHS = (("depth", "scale error", 0.0), ("depth", "zero", 0.0), ("depth", "exponent z of eq. 7.4", -1.0),
          ("rod", "length error", 0.0), ("rod", "length error across the view", 0.0),
          ("rod", "length error along the view", 0.0), ("upright", "to the right", 0.0), ("upright", "away", 0.0),
          ("latency", "screen to the picture's timestamp", 1e3 * LENGTHS.screen_s),
          ("timing", "network, p50", 0.120 + 0.060 * np.log(2.0)),
          ("timing", "network, p99", 0.120 + 0.060 * np.log(100.0)))
"""(line, figure, what is true of the twin)."""


def with_baseline(rig: Rig, factor: float) -> Rig:
    """The rig with every camera farther from the first by that factor."""
    nodes = tuple(msgspec.structs.replace(node, pose=msgspec.structs.replace(
        node.pose, translation_m=tuple(factor * x for x in node.pose.translation_m))) for node in rig.nodes)
    return msgspec.structs.replace(rig, nodes=nodes)


def delay_ms(folder: Path, protocol: ProtocolFile, rig: Rig) -> float:
    """The true time from the screen's order to the arrival at the master, by the log's own frames."""
    assert protocol.flash is not None
    recording = read_recording(folder / protocol.flash.log, rig)
    marker = recording.marker(protocol.flash.marker)
    lit = np.isfinite(recording.pixels[:, marker, 0])
    ages = [np.mean((recording.arrivals_ns - recording.exposed_ns[:, marker])[lit & (recording.cameras == camera)])
            for camera in range(recording.camera_count)]
    return 1e3 * LENGTHS.screen_s + 1e-6 * float(np.mean(ages))


def main() -> int:
    """Run all seeds and print the tables."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--pictures", action="store_true")
    args = parser.parse_args()
    first: dict[str, list[str]] = {}
    held: dict[str, list[bool]] = {}
    widths: dict[str, list[float]] = {}
    named: dict[str, list[bool]] = {}
    verdicts: dict[str, list[str]] = {}
    for seed in range(1, args.seeds + 1):
        with tempfile.TemporaryDirectory() as name:
            folder, scene = Path(name), make_scene(twin_defaults(), seed)
            protocol, rig = record_protocol(scene, folder, sketched=not args.pictures), build_rig(scene)
            made = certify(folder, protocol, rig)
            for code, what, truth in (*TRUTHS, ("latency", "screen to master", delay_ms(folder, protocol, rig))):
                found = made.line(code).figure(what)
                if found is not None and found.value is not None:
                    first.setdefault(f"{code}: {what}", [
                        f"{found.value:.3f} ({found.interval.low:.3f} to {found.interval.high:.3f})", f"{truth:.3g}"])
                    held.setdefault(f"{code}: {what}", []).append(bool(found.interval.holds(truth)))
                    widths.setdefault(f"{code}: {what}", []).append(found.interval.half_width)
            for line in made.lines:
                verdicts.setdefault(line.code, []).append(line.verdict)
            for factor in FACTORS:
                _judge_wrong(certify(folder, ProtocolFile(ruler=protocol.ruler, rod=protocol.rod),
                                     with_baseline(rig, factor)), factor, named)
        print(f"seed {seed} of {args.seeds}", file=sys.stderr)
    total = [one for each in held.values() for one in each]
    wrong = [one for each in named.values() for one in each]
    perfect = [one for each in verdicts.values() for one in each]
    publish(args, {"held": held, "half_widths": widths, "named": named, "verdicts": verdicts},
            table(["figure", "seed 1 (95 % interval)", "true", "intervals that hold it", "mean half width"],
                  [[what, *first[what], f"{sum(each)} of {len(each)}", float(np.mean(widths[what]))]
                   for what, each in held.items()]),
            f"{sum(total)} of {len(total)} intervals hold the truth. {perfect.count('differs')} of {len(perfect)} "
            f"lines of a perfect rig differ. A baseline wrong by 1 % is named in {sum(wrong)} of {len(wrong)} lines.")
    return 0


def _judge_wrong(made: Certificate, factor: float, named: dict[str, list[bool]]) -> None:
    for code in ("depth", "rod"):
        line = made.line(code)
        named.setdefault(f"{code}, baseline x {factor:g}", []).append(
            line.verdict == "differs" and "baseline" in line.cause)


if __name__ == "__main__":
    sys.exit(main())
