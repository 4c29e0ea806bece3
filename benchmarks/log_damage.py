"""What damage costs a raw log: flipped bytes, and the death of the program that records.

    python benchmarks/log_damage.py [--flips 1000] [--kills 100] [--json FILE]

A log of 10,000 records is read once for every flipped byte behind its header. A recorder that takes 1,000 records a
second is killed (SIGKILL) at a random moment; the log must open, and what is missing is the time from its last record
to the kill.
"""

from __future__ import annotations

import multiprocessing
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from tables import arguments, publish, table

from rhot_app.recording.raw_log import LogReader, Record, RecordKind, encode_header, encode_record
from rhot_app.recording.recorder import Recorder

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from synthetic_node import synthetic_rig

RECORDS = 10_000


def flips(count: int, rng: np.random.Generator, folder: Path) -> dict[str, float]:
    """The most and the mean number of records lost to one flipped byte, and how often nothing says so."""
    header = encode_header(synthetic_rig(), {})
    records = [Record(RecordKind.DATAGRAM, 1 + k % 2, 8_000_000 * k, rng.bytes(int(rng.integers(60, 400))))
               for k in range(RECORDS)]
    data = bytearray(header + b"".join(encode_record(record) for record in records))
    path, whole, lost, silent, wrong = folder / "flips.log", set(records), [], 0, 0
    for at in rng.integers(len(header), len(data), count).tolist():
        byte = data[at]
        data[at] ^= int(rng.integers(1, 256))
        path.write_bytes(data)
        data[at] = byte
        reader = LogReader(path)
        found = list(reader)
        reader.close()
        lost.append(RECORDS - len(found))
        wrong += not whole.issuperset(found)
        silent += not (reader.losses.damage or reader.torn_bytes)
    return {"flips": count, "lost_max": max(lost), "lost_mean": sum(lost) / count, "not_said": silent,
            "wrong_records": wrong}


def kills(count: int, rng: np.random.Generator, folder: Path) -> dict[str, float]:
    """How many killed recordings open, and the longest time that one misses, s."""
    opened, missing_s, damaged = 0, [], 0
    for k in range(count):
        path = folder / f"{k}.log"
        child = multiprocessing.get_context("fork").Process(target=record_for_ever, args=(path,))
        child.start()
        while not path.exists():
            time.sleep(0.001)
        begun_ns = time.monotonic_ns()
        time.sleep(float(rng.uniform(0.0, 1.5)))
        child.kill()
        killed_ns = time.monotonic_ns()
        child.join()
        reader = LogReader(path)
        last_ns = max((record.t_master_ns for record in reader), default=begun_ns)
        opened += 1
        damaged += bool(reader.losses.damage)
        missing_s.append(1e-9 * (killed_ns - last_ns))
    return {"kills": count, "opened": opened, "damaged": damaged, "missing_max_s": max(missing_s),
            "missing_mean_s": sum(missing_s) / count}


def record_for_ever(path: Path) -> None:
    """Record a thousand datagrams a second until somebody kills it."""
    recorder = Recorder(path, synthetic_rig())
    while True:
        recorder.put(RecordKind.DATAGRAM, 1, time.monotonic_ns(), b"x" * 200)
        time.sleep(0.001)


def main() -> int:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--flips", type=int, default=1000)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    with tempfile.TemporaryDirectory() as work:
        flipped, killed = flips(args.flips, rng, Path(work)), kills(args.kills, rng, Path(work))
    publish(args, {"flips": flipped, "kills": killed}, table(["damage", "result"], [
        [f"each of {args.flips} flipped bytes in {RECORDS} records",
         f"at most {flipped['lost_max']} lost, {flipped['lost_mean']:.2f} on average; {flipped['not_said']} not "
         f"reported, {flipped['wrong_records']} wrong"],
        [f"{args.kills} killed recordings",
         f"{killed['opened']} opened, {killed['damaged']} damaged; at most {1e3 * killed['missing_max_s']:.0f} ms "
         f"missing, {1e3 * killed['missing_mean_s']:.0f} ms on average"]]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
