"""Broken, changed and repeated datagrams against both sides of the wire, without and with the right key.

    python benchmarks/fuzz.py [--count 10000000] [--seed 1] [--short] [--json FILE]

`wild`: random bytes, truncations, surplus, flipped bits, splices and replays of genuine tagged datagrams, as anybody on
the network can send them. Not one may be taken; the genuine ones among them must be. `keyed`: as many that were changed
and then tagged with the right key, as a broken program of our own would send them. None may raise, and what is taken
must be plausible. Rate (per second of processor time) and memory are read in every tenth of a run; exit code 1 when
anything was wrong or they were not flat.
"""

from __future__ import annotations

import gc
import logging
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
from fuzz_targets import Door, Landmarks, NodeSide, Replies, Searches, Target, WronglyTakenError
from numpy.typing import NDArray
from tables import arguments, publish, table

from rhot_node.wire.codec import TAG_LENGTH

BATCH = 2048
TENTHS = 10
RATE_LEAST = 0.5  # of the median tenth: other programs take caches and clock rate away
MEMORY_MOST_MB = 8.0  # growth after the first tenth
FLIPS = (1, 1, 1, 2, 3, 8)  # bits, by chance
SEQUENCE = slice(20, 24)  # where a header has its number
KINDS, SHARES = ("flip", "cut", "random", "splice", "surplus", "replay"), (0.55, 0.15, 0.1, 0.1, 0.05, 0.05)

Bytes = NDArray[np.uint8]


class Mutator:
    """Makes many datagrams out of one, a batch at a time; seeded."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def batch(self, source: bytes, count: int) -> tuple[Bytes, NDArray[np.intp]]:
        """`count` changed copies of `source`: (count, L) bytes, and how many of each row are meant, of any length up to
        twice the source's."""
        length = len(source)
        rows = np.zeros((count, 2 * length + 1), np.uint8)
        rows[:, :length] = np.frombuffer(source, np.uint8)
        lengths = np.full(count, length)
        kinds = self._rng.choice(len(KINDS), count, p=SHARES)
        self._flip(rows, np.flatnonzero(kinds == KINDS.index("flip")), length)
        cut, random, splice, surplus = (np.flatnonzero(kinds == KINDS.index(kind))
                                        for kind in ("cut", "random", "splice", "surplus"))
        lengths[cut] = self._rng.integers(0, length, len(cut))
        lengths[random] = self._rng.integers(0, 2 * length, len(random))
        rows[random] = self._rng.integers(0, 256, (len(random), rows.shape[1]), dtype=np.uint8)
        for row, (begin, end) in zip(splice, np.sort(self._rng.integers(0, length + 1, (len(splice), 2))), strict=True):
            rows[row, begin:end] = self._rng.integers(0, 256, end - begin, dtype=np.uint8)
        lengths[surplus] += self._rng.integers(1, length + 1, len(surplus))
        return rows, lengths

    def chance(self, count: int, share: float) -> NDArray[np.bool_]:
        """True for about a `share` of `count`."""
        return self._rng.random(count) < share

    def _flip(self, rows: Bytes, chosen: NDArray[np.intp], length: int) -> None:
        flips = self._rng.choice(FLIPS, len(chosen))
        for k in range(max(FLIPS)):
            now = chosen[flips > k]
            at = self._rng.integers(0, length, len(now))
            rows[now, at] ^= np.left_shift(1, self._rng.integers(0, 8, len(now))).astype(np.uint8)


def wild(target: Target, mutator: Mutator, count: int) -> None:
    """A batch of strangers' datagrams; raises WronglyTakenError when one is taken, or a genuine one is not."""
    genuine = target.genuine()
    if not all(target.feed(data) for data in genuine):
        raise WronglyTakenError(f"{target.name}: a genuine datagram was refused; {target.refused()}")
    sources = [*genuine, *target.public()]
    for data in sources:
        rows, lengths = mutator.batch(data, count // len(sources))
        flat, width = rows.tobytes(), rows.shape[1]
        for at, length in zip(range(0, len(flat), width), lengths.tolist(), strict=True):
            if target.feed(flat[at:at + length]):
                raise WronglyTakenError(f"{target.name}: a stranger's datagram was taken: {flat[at:at + length].hex()}")


def keyed(target: Target, mutator: Mutator, count: int) -> int:
    """A batch that was changed and then tagged again; returns how many were taken."""
    target.renew()
    genuine, taken = target.genuine(), 0
    for data in genuine:
        body = data[:-TAG_LENGTH]
        rows, lengths = mutator.batch(body, count // len(genuine))
        number = int.from_bytes(body[SEQUENCE], "little")
        fresh = (number + 1 + np.arange(len(rows), dtype=np.uint32)).view(np.uint8).reshape(-1, 4)
        kept = mutator.chance(len(rows), 0.999)  # a number that was changed takes the window with it
        rows[kept, SEQUENCE] = fresh[kept]
        flat, width, seal = rows.tobytes(), rows.shape[1], target.seal
        for at, length in zip(range(0, len(flat), width), lengths.tolist(), strict=True):
            body = flat[at:at + length]
            taken += target.feed(body + seal.tag(body))
    return taken


def memory_mb() -> float:
    """Resident memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def run(phase: str, count: int, seed: int) -> dict[str, object]:
    """One phase; raises WronglyTakenError, or whatever a datagram made the code raise."""
    targets: tuple[Target, ...] = (Door(), NodeSide(), Replies(), NodeSide(), Door(), Searches(),
                                   Landmarks())
    mutator, done, taken = Mutator(seed), 0, 0
    sent: Counter[str] = Counter()
    for target in targets:  # what is compiled and allocated once does not count
        wild(target, mutator, BATCH)
        keyed(target, mutator, BATCH)
        target.renew()
    before = Counter[str]()
    for target in targets:
        before.update(target.refused())
    rates, memories, begun_s, marked = [], [], time.process_time(), 0
    while done < count:
        target = targets[done // BATCH % len(targets)]
        if phase == "wild":
            wild(target, mutator, BATCH)
        else:
            taken += keyed(target, mutator, BATCH)
        done += BATCH
        sent[target.name] += BATCH
        if done - marked >= count / TENTHS or done >= count:
            now_s = time.process_time()
            gc.collect()
            rates.append((done - marked) / (now_s - begun_s))
            memories.append(memory_mb())
            begun_s, marked = time.process_time(), done
    refused: Counter[str] = Counter()
    for target in targets:
        refused.update(target.refused())
    refused -= before
    return {"phase": phase, "datagrams": done, "to": dict(sent), "taken": taken,
            "rate_per_s": [round(rate) for rate in rates], "memory_mb": [round(memory, 1) for memory in memories],
            "refused": dict(refused.most_common())}


def flat(figures: dict[str, object]) -> bool:
    """Whether neither rate nor memory went anywhere."""
    rates, memories = (np.array(figures[key], dtype=float) for key in ("rate_per_s", "memory_mb"))
    return bool(rates.min() >= RATE_LEAST * np.median(rates) and memories[-1] - memories[0] <= MEMORY_MOST_MB)


def main() -> int:
    """Run both phases and print."""
    parser = arguments(__doc__)
    parser.add_argument("--count", type=int, default=10_000_000, help="datagrams of each phase")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--short", action="store_true", help="too short a run to judge rate and memory by")
    args = parser.parse_args()
    logging.disable(logging.CRITICAL)  # every start and stop is logged
    try:
        results = {phase: run(phase, args.count, args.seed) for phase in ("wild", "keyed")}
    except WronglyTakenError as exc:
        print(exc, file=sys.stderr)
        return 2
    publish(args, results, table(
        ["run", "datagrams", "accepted", "per second of one core", "memory, MB"],
        [[said, results[phase]["datagrams"], results[phase]["taken"],
          *(" to ".join(str(end(results[phase][key])) for end in (min, max)) for key in ("rate_per_s", "memory_mb"))]
         for phase, said in (("wild", "without the key"), ("keyed", "with the key"))]))
    return 0 if args.short or all(flat(figures) for figures in results.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
