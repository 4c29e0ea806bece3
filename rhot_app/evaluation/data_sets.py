"""Takes: motions filmed once and seen by the nodes' own detector, as raw logs with the truth beside them.

Trackers are compared on takes: the same datagrams for every one of them, as often as wanted, without waiting. What was
filmed once is kept in a folder and found again by its order. What films may have changed meanwhile: the log
says so, and whoever shows figures should (`DataSet.outdated`), or film anew.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import msgspec

from rhot_app.project import Rig, load_rig
from rhot_app.recording.raw_log import LogReader, Record
from rhot_app.simulator.film.film import TRUTH_NAME, Progress, for_each_camera, new_folder
from rhot_app.simulator.film.ideal_observations import ORDINARY, ideal_observations
from rhot_app.simulator.film.node_log import CABLE, Network, Sending, detected, write_node_log
from rhot_app.simulator.film.shot import RIG_NAME, make_shot, save_shot
from rhot_app.simulator.film.truth import Truth, load_truth, save_truth, true_object
from rhot_app.simulator.scene.scene import Scene
from rhot_node.files import read_input, resource_path

LOG_NAME: Final = "take.rhotlog"

Watch = Callable[[str], Progress | None]
"""Says how the filming of a take goes: given what is filmed, who is told of its frames."""


@dataclass(frozen=True, eq=False)
class Order:
    """What a take shall show: a motion (name or file) in a scene, for how long, and over which network it is sent.
    `sketched`: without pictures (`rhot_app.simulator.film.ideal_observations`), a hundred times faster. `unpainted`:
    ids of markers that the hand does not wear, though the rig has them."""

    scene: Scene
    motion: str
    seconds: float
    network: Network = CABLE
    sketched: bool = False
    unpainted: frozenset[str] = frozenset()

    @property
    def title(self) -> str:
        """What it is, for people."""
        return f"{Path(self.motion).name}, {self.seconds:g} s, seed {self.scene.seed}"

    def name(self) -> str:
        """A folder name that differs with the order."""
        facts = [msgspec.to_builtins(self.scene.settings), self.scene.seed, self.seconds, asdict(self.network),
                 asdict(ORDINARY) if self.sketched else False, _motion_digest(self.motion)]
        if self.unpainted:
            facts.append(sorted(self.unpainted))
        if self.scene.settings.markers.endswith(".json"):  # a file may say something else the next time
            facts.append(msgspec.to_builtins(self.scene.markers))
        digest = hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()
        kind = "sketched" if self.sketched else Path(self.scene.settings.markers).stem
        return f"{Path(self.motion).stem}-{self.seconds:g}s-{kind}-{self.scene.seed}-{digest[:12]}"


@dataclass(frozen=True, eq=False)
class DataSet:
    """A raw log, the rig that a perfect calibration would have found, and the truth. Scene time 0 is
    `rhot_app.simulator.film.node_log.T0_MASTER_NS`. `outdated`: another detector or twin would film it today."""

    folder: Path
    rig: Rig
    seconds: float
    outdated: bool

    @functools.cached_property
    def truth(self) -> Truth:
        """What really happened; raises SimulatorError when it cannot be read. That of half an hour is too large."""
        return load_truth(self.folder / TRUTH_NAME)

    def records(self) -> list[Record]:
        """All records of the log, in the order of arrival."""
        reader = LogReader(self.folder / LOG_NAME)
        try:
            return list(reader)
        finally:
            reader.close()


def data_sets_folder() -> Path:
    """Where takes are kept unless told otherwise."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rhot" / "takes"


def data_set(order: Order, folder: Path, watch: Watch = lambda title: None, *, anew: bool = False) -> DataSet:
    """The take in `folder`, filmed unless it is there already. Raises RhotError.

    Filming takes about as long as what is filmed; an interrupted one leaves nothing behind. `anew`: an outdated take is
    filmed anew, for figures of today's detector and twin.
    """
    folder.mkdir(parents=True, exist_ok=True)
    place = folder / order.name()
    if anew and place.exists() and _recorded(order, place).outdated:
        shutil.rmtree(place)
    if not place.exists():
        try:
            _film(order, place, watch(order.title))
        except OSError:
            if not place.exists():  # else somebody has filmed the same meanwhile
                raise
    return _recorded(order, place)


def _recorded(order: Order, place: Path) -> DataSet:
    reader = LogReader(place / LOG_NAME)
    reader.close()
    return DataSet(place, reader.rig, order.seconds, reader.about.get("sources") != _source_digest(order.sketched))


def _film(order: Order, place: Path, progress: Progress | None) -> None:
    shot = make_shot(order.scene, order.motion, order.seconds, order.unpainted)
    with new_folder(place) as work:
        save_shot(shot, work)
        rig = load_rig(work / RIG_NAME)
        sending = Sending(rig, order.network)
        if order.sketched:
            found = [ideal_observations(shot, index) for index in range(len(rig.nodes))]
            streams = tuple((sending.said(shot, index, seen), truth) for index, (seen, truth) in enumerate(found))
        else:
            streams = for_each_camera(shot, functools.partial(detected, sending, None), progress)
        notes = {"simulated": shot.scene_object.name, "sources": _source_digest(order.sketched)}
        write_node_log(work / LOG_NAME, rig, notes, [record for records, _ in streams for record in records])
        truths = tuple(truth for _, truth in streams)
        save_truth(work / TRUTH_NAME, true_object(shot.scene_object, shot.seconds, truths))


def _motion_digest(motion: str) -> str:
    """Of the file that the motion comes from; of its name where it is neither a file nor shipped."""
    for path in (resource_path("motions", f"{motion}.json"), Path(motion)):
        if path.is_file():
            return hashlib.sha256(read_input(path)).hexdigest()
    return motion


@functools.cache
def _source_digest(sketched: bool) -> str:
    """Of the programs that a take depends on besides its order: the twin's, and the detector's if it has pictures."""
    root = Path(__file__).parents[2]
    folders = [root / "rhot_app" / "simulator" / room for room in ("film", "render", "scene")]
    folders += [] if sketched else [root / "rhot_node" / "detect"]
    return hashlib.sha256(b"".join(path.read_bytes() for folder in folders
                                   for path in sorted(folder.glob("*.py")))).hexdigest()
