"""What is wrong, where, and what to do, in sentences; each is gone from the next status when it is mended. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rhot_app.calibration.check.camera_calibration import NOT_CALIBRATED, calibration_finding, times_unknown
from rhot_app.engine.node_meter import RECENT_NS, Recent
from rhot_app.engine.status import Advice, Level, NodeStatus, advise, words
from rhot_app.project import Intrinsics, Rig
from rhot_app.state import HandState
from rhot_node.network.presence import is_loopback

UNSEEN_S = 3.0
"""A marker that one camera has not seen for so long is worth a sentence."""

WIDE_BOUND_S = 2e-3
"""At 2 m/s a clock wrong by this much moves a marker by 4 mm."""

DISK_WARNING_S = 600.0
"""A person who is told so long before the disk is full can end what is being recorded in good order."""

MANY_LOST = 0.05
FLOOD_HZ = 1000.0
"""More than the frame rate that a node's settings allow (docs/node.md, `fps`)."""

_RECENT_MIN = 5  # refusals within two seconds that are not chance

_REFUSALS: dict[str, tuple[Level, str]] = {
    "marker_set": ("error", words("Node {name} uses another marker set than the rig; give both the same marker file.")),
    "no_landmarks": ("error", words("Node {name} sends landmarks of a hand, but no marker of the rig is one. Give the "
                                    "rig the marker set landmarks21, or the node another detector.")),
    "image_size": ("error", words("Node {name} sends images of {size} px, but the rig's intrinsics are for {expected} "
                                  "px; set the node's camera or calibrate it for this size.")),
    "time": ("warning", words("Node {name} sends frames with impossible times; its clock may have been set. If this "
                              "does not end, restart the node.")),
    "foreign_node": ("warning", words("Another node sends to the port of {name}; check the node ids and data ports.")),
    "version": ("error", words("Node {name} speaks another version of the wire; install the same version here and "
                               "there.")),
    "tag": ("warning", words("Datagrams that are not tagged with the key of node {name} are refused at its port: "
                             "somebody sends in its place.")),
    "untagged": ("warning", words("Datagrams without a tag are refused at the port of node {name}: somebody sends in "
                                  "its place, or the node was made open after it was paired.")),
    "failed": ("error", words("An observation kind failed over datagrams of node {name}. The log has its exception; "
                              "remove the plug-in that adds it, or report this.")),
    "jump": ("warning", words("Node {name} jumped in its sequence numbers; if this does not end, restart the node.")),
    "kernel_overflow": ("warning", words("The kernel drops datagrams of node {name}: this computer is too busy to read "
                                         "them. Close other programs, or allow a larger buffer with "
                                         "`sudo sysctl -w net.core.rmem_max=8388608`.")),
}
_LATE = words("Frames of node {name} on this computer come too late to be used. {busy}")
_OVERFLOW = "kernel_overflow"  # they came, but are missing in the sequence; said by `_REFUSALS`
_BUSY = words("This computer is too busy: close other programs, or lower the frame rate.")
_CABLE = words("Use a cable instead of wireless.")
_MALFORMED = frozenset({"magic", "length", "type", "flags", "header", "reserved", "count", "index", "size", "marker",
                        "range", "text", "kind"})


@dataclass(frozen=True, slots=True)
class NodeFacts:
    """One node at this moment: what clients see, and what happened in the last two seconds."""

    status: NodeStatus
    recent: Recent
    address: str
    udp_port: int
    expected_size: tuple[int, int]
    sent_size: tuple[int, int] | None
    buffer_bytes: int | None  # None: a replay
    wanted_buffer_bytes: int
    unseen_s: Sequence[float]  # per marker, since this camera last saw it
    streams_elsewhere: bool  # for another master
    not_started_s: float  # how long the node has been ready although it was told to start
    black: bool = False  # the camera's picture


def disk_advice(folder: str, seconds_left: float) -> list[Advice]:
    """That a recording will fill the disk soon: how soon, and what to do. A full disk ends the recording."""
    if seconds_left >= DISK_WARNING_S:
        return []
    minutes = int(seconds_left / 60.0)
    if minutes < 1:
        return [advise("The disk of {folder} will be full in less than a minute at the rate of this recording, which "
                       "then ends. Make room, or stop the recording.", level="error", subject="recording",
                       folder=folder)]
    if minutes == 1:
        return [advise("The disk of {folder} will be full in about a minute at the rate of this recording, which then "
                       "ends. Make room, or stop the recording.", subject="recording", folder=folder)]
    return [advise("The disk of {folder} will be full in {minutes} minutes at the rate of this recording, which then "
                   "ends. Make room, or stop the recording.", subject="recording", folder=folder, minutes=minutes)]


def node_advice(facts: NodeFacts, marker_ids: Sequence[str], running: bool, *, visibility: bool = True) -> list[Advice]:
    """All sentences about one node; `visibility` False leaves out what its camera does not see."""
    found = [*_state_advice(facts, running), *_buffer_advice(facts)]
    if facts.status.state == "streaming":
        found += [*_refusal_advice(facts), *_link_advice(facts, running)]
        if running and visibility and facts.recent.accepted:
            found += _visibility_advice(facts, marker_ids)
    return found


def no_marker_advice(all_facts: Sequence[NodeFacts], running: bool, painted: bool = True,
                     hand: str = "hand") -> list[Advice]:
    """The one sentence that replaces all others about visibility when no camera sees anything; none while a picture is
    black, which is said of each camera. `painted`: whether the rig has painted markers, not landmarks alone. `hand`:
    which one is looked for."""
    if any(facts.black for facts in all_facts):
        return []
    seconds = min((min(facts.unseen_s) for facts in all_facts), default=0.0)
    if running and seconds > UNSEEN_S and any(facts.recent.accepted for facts in all_facts):
        if not painted:
            return [advise("No camera has seen a {hand} for {seconds:.0f} s. Hold it into the pictures. Each node "
                           "needs the hand networks (`rhot-node landmarks install`) and \"detector\": \"landmarks\" in "
                           "its settings.", subject="sight", hand=hand, seconds=seconds)]
        return [advise("No camera has seen a marker for {seconds:.0f} s. Hold the hand into both pictures; if the "
                       "markers are visible there, calibrate their colours.", subject="sight", seconds=seconds)]
    return []


def start_pose_advice(state: HandState | None) -> list[Advice]:
    """What to do while hands that are tracked by their contours alone are not followed: they begin in a given pose."""
    if state is None or state.tracked or (state.other is not None and state.other.tracked):
        return []
    return [advise("No hand is followed. Take the pose that the pictures show in white, and hold it.", level="info",
                   subject="sight")]


def moved_advice(rig: Rig, moved: Mapping[int, str]) -> list[Advice]:
    """One sentence for each node that is not where it was, by id, when the rig was read or saved."""
    return [advise("Node {name} has moved from {before} to {address} and is used there. Save the rig, so that it is "
                   "looked for there the next time.", name=node.name, before=moved[node.node_id], address=node.address)
            for node in rig.nodes if moved.get(node.node_id, node.address) != node.address]


def hands_advice(rig: Rig) -> list[Advice]:
    """One sentence when the rig has a hand that its tracker does not follow."""
    if rig.other_hand is None or rig.tracker.kind != "classic":
        return []
    return [advise("The classic tracker follows the first hand only and takes the markers of the other one for free "
                   "points. Choose the estimator for two hands at once.", level="info", subject="information")]


def _state_advice(facts: NodeFacts, running: bool) -> list[Advice]:
    status = facts.status
    name = status.name
    if facts.buffer_bytes is None:
        return []
    if status.state == "ready" and status.text_datagrams:
        return [advise("Node {name}: text datagrams arrive, but tracking is not started: press Start.", level="info",
                       subject="tracking", name=name)]
    if status.state == "silent" and status.text_datagrams:
        return [advise("Node {name}: no text datagrams come in; send them to its data port.", level="info",
                       subject="tracking", name=name)]
    if status.turned_away:
        return [advise("Node {name} at {address} does not know this computer: it was reset or made open, or never "
                       "paired with it. Pair it: `rhot-node pair` on the node, `rhot pair {name} --rig FILE` here.",
                       level="error", subject="tracking", name=name, address=facts.address)]
    if status.state == "silent" and status.message:
        return [advise("Node {name} does not answer. {message}", level="error", subject="tracking", name=name,
                       message=status.message)]
    if status.state == "silent":
        unpaired = "" if status.paired else words(
            " The rig has no key for it: if it waits to be paired, run `rhot-node pair` there and `rhot pair` here.")
        return [advise("Node {name} does not answer at {address}:{port}. Is it switched on, is rhot-node running "
                       "there, and on the same network? It is looked for by its id.{unpaired}", level="error",
                       subject="tracking", name=name, address=facts.address, port=facts.udp_port, unpaired=unpaired)]
    if status.state == "fault":
        return [advise("Node {name}: {message}", level="error", subject="tracking", name=name,
                       message=status.message or words("it reports a fault; look at its log."))]
    if running and status.state == "ready" and facts.not_started_s > 1.0:
        return [advise("Node {name} is ready but does not follow the start; press Stop and Start. If that does not "
                       "help, restart the node.", subject="tracking", name=name)]
    if facts.streams_elsewhere:
        return [advise("Node {name} streams for another master; stop that one, or press Stop and Start here to take "
                       "the node back.", subject="tracking", name=name)]
    if status.text_datagrams:
        return [advise("Node {name} sends text datagrams: untrusted, without times, so fast movements are less exact.",
                       level="info", subject="information", name=name)]
    if not status.paired:
        return [advise("Node {name} is open, and what it says is untrusted: anybody on the network may steer it or "
                       'speak in its place. To change that, set its "trust" to "paired" and pair it.', level="info",
                       subject="information", name=name)]
    return []


def _buffer_advice(facts: NodeFacts) -> list[Advice]:
    if facts.buffer_bytes is None or facts.buffer_bytes >= facts.wanted_buffer_bytes:
        return []
    return [advise("Node {name}: the system grants a receive buffer of {granted} KiB only, so a busy moment may lose "
                   "datagrams. Run `sudo sysctl -w net.core.rmem_max={wanted}` and start again.",
                   name=facts.status.name, granted=facts.buffer_bytes // 1024, wanted=facts.wanted_buffer_bytes)]


def _refusal_advice(facts: NodeFacts) -> list[Advice]:
    found = []
    dropped = facts.recent.dropped
    for reason, (level, sentence) in _REFUSALS.items():
        if reason == "time" and is_loopback(facts.address):
            level, sentence = "warning", _LATE
        if dropped.get(reason, 0) >= _RECENT_MIN:
            size = "{} x {}".format(*facts.sent_size) if facts.sent_size else words("another size")
            found.append(advise(sentence, level=level, subject="tracking" if level == "error" else "equipment",
                                name=facts.status.name, size=size, expected="{} x {}".format(*facts.expected_size),
                                busy=_BUSY))
    malformed = sum(count for reason, count in dropped.items() if reason in _MALFORMED)
    if malformed >= _RECENT_MIN:
        hint = (words("they are not \"x,y;x,y;...\" with one pair per marker") if facts.status.text_datagrams
                else words("if an original RHOT node sends text, set text_datagrams for it in the rig"))
        found.append(advise("Node {name}: {rate:.0f} datagrams/s are not of this protocol and are ignored; {hint}.",
                            name=facts.status.name, rate=malformed / 2, hint=hint))
    return found


def _link_advice(facts: NodeFacts, running: bool) -> list[Advice]:
    found = []
    status, recent = facts.status, facts.recent
    name, here = status.name, is_loopback(facts.address)
    lost = max(0, recent.lost - recent.dropped.get(_OVERFLOW, 0))
    total = recent.accepted + sum(recent.dropped.values()) + lost
    if total >= 20 and lost > MANY_LOST * total:
        found.append(advise("Node {name}: {percent:.0f} % of the datagrams are lost. {remedy}", name=name,
                            percent=100 * lost / total,
                            remedy=_BUSY if here else words("Use a cable instead of wireless, or a lower frame rate.")))
    if recent.skipped:
        arrived_hz = 1e9 * recent.accepted / RECENT_NS
        found.append(advise("Node {name} floods this computer with {rate:.0f} datagrams/s; only the newest are "
                            "tracked. Lower its frame rate.", name=name, rate=arrived_hz) if arrived_hz > FLOOD_HZ
                     else advise("{count} frames of node {name} were not tracked within two seconds. {busy}",
                                 count=recent.skipped, name=name, busy=_BUSY))
    if running and not status.text_datagrams:
        if status.clock_bound_s is None:
            found.append(advise("Node {name}: waiting for its clock.", level="info", subject="information", name=name))
        elif status.clock_bound_s > WIDE_BOUND_S:
            found.append(advise("Node {name}: its clock is known to ±{bound:.1f} ms only, so fast movements blur. "
                                "{remedy}", name=name, bound=1e3 * status.clock_bound_s,
                                remedy=_BUSY if here else _CABLE))
    return found


def listening_advice(rig: Rig) -> list[Advice]:
    """What programs a rig lets in, or sends to: whoever opens a rig file of somebody else should know."""
    found = [f"opens the output {output.spec}" for output in rig.outputs if output.enabled]
    found += [f"takes poses of {one.model.name} from {one.poses.source}, which any program of this computer may send"
              for one in rig.objects if one.model is not None and one.poses is not None
              and one.poses.source.startswith("udp:")]
    return [Advice("info", f"This rig {' and '.join(found)}.", subject="information")] if found else []


def calibration_advice(rig: Rig) -> list[Advice]:
    """One sentence while lenses or poses are not calibrated or no length was checked, as ``rhot check`` words it."""
    found = calibration_finding(rig)
    if found is None:
        return []
    level: Level = "warning" if found.finding.figure == NOT_CALIBRATED else "info"
    return [Advice(level, found.finding.sentence, found.mender, lasting=True, subject="calibration")]


def times_advice(rig: Rig, rates_hz: Sequence[float]) -> list[Advice]:
    """That nobody has compared the times of the cameras of this computer, which are not synchronised, and by how much
    they may be apart; said once lenses and poses are known. `rates_hz`: of the nodes, 0 where nothing comes."""
    unknown, finding = times_unknown(rig), calibration_finding(rig)
    if (not unknown or not all(is_loopback(node.address) for node in rig.nodes)
            or (finding is not None and finding.finding.figure == NOT_CALIBRATED)):
        return []
    rates = [rate_hz for rate_hz in rates_hz if rate_hz > 0.0]
    most = f" ({500.0 / min(rates):.0f} ms)" if rates else ""
    return [advise("The times of {names} against {first} are not known: cameras that are not synchronised may be up to "
                   "half a frame apart{most}. Calibrate the times with a waving hand.", level="info", mender="time",
                   lasting=True, subject="calibration", names=", ".join(unknown), first=rig.nodes[0].name, most=most)]


def one_camera_advice(rig: Rig) -> list[Advice]:
    """What a hand that one camera tracks cannot tell, and which cameras wait to be put together with it."""
    used = [node for node, tracked in zip(rig.nodes, rig.tracked_with, strict=True) if tracked]
    apart = [node.name for node in rig.nodes if node not in used]
    if len(used) > 1 and not apart:
        return []
    names, by = ", ".join(apart), ", ".join(node.name for node in used)
    mender = "stereo" if apart else ""
    if len(used) == 1 and rig.painted and rig.tracker.observe == "markers" and rig.tracker.palm_plane is None:
        if apart:
            return [advise("{by} alone does not find a hand by painted markers. Put {names} together with it, or track "
                           "a bare hand.", level="info", mender=mender, lasting=True, subject="calibration", by=by,
                           names=names)]
        return [advise("{by} alone does not find a hand by painted markers. Add a second camera, or track a bare hand.",
                       level="info", mender=mender, lasting=True, subject="calibration", by=by)]
    guess = ""
    if len(used) == 1:
        guess = (words(" The distance is a guess, by the hand's size and an assumed lens ({degrees} degrees).")
                 if used[0].intrinsics.nominal else words(" The distance is a guess, by the hand's size."))
    degrees = round(Intrinsics.ASSUMED_DEG)
    if not apart:
        return [advise("{by} alone tracks the hand.{guess}", level="info", mender=mender, lasting=True,
                       subject="calibration", by=by, guess=guess, degrees=degrees)]
    if len(apart) == 1:
        return [advise("{by} alone tracks the hand until {names} is put together with it.{guess}", level="info",
                       mender=mender, lasting=True, subject="calibration", by=by, names=names, guess=guess,
                       degrees=degrees)]
    return [advise("{by} alone tracks the hand until {names} are put together with it.{guess}", level="info",
                   mender=mender, lasting=True, subject="calibration", by=by, names=names, guess=guess,
                   degrees=degrees)]


def _visibility_advice(facts: NodeFacts, marker_ids: Sequence[str]) -> list[Advice]:
    if facts.black:
        return [advise("{name} is black: is the lens covered?", subject="sight", name=facts.status.name)]
    unseen = [(seconds, marker) for seconds, marker in zip(facts.unseen_s, marker_ids, strict=True)
              if seconds > UNSEEN_S]
    if not unseen:
        return []
    name, seconds = facts.status.name, max(seconds for seconds, _ in unseen)
    if len(unseen) == len(marker_ids):
        return [advise("Camera {name} has seen no marker for {seconds:.0f} s: hold the hand into its picture, or "
                       "calibrate the colours.", subject="sight", name=name, seconds=min(s for s, _ in unseen))]
    names = ", ".join(marker for _, marker in unseen[:3])
    if len(unseen) > 3:
        return [advise("Camera {name} has not seen {names} and others for {seconds:.0f} s: hidden, outside its "
                       "picture, or the light has changed. Turn the hand, or calibrate the colours.", subject="sight",
                       name=name, names=names, seconds=seconds)]
    return [advise("Camera {name} has not seen {names} for {seconds:.0f} s: hidden, outside its picture, or the light "
                   "has changed. Turn the hand, or calibrate the colours.", subject="sight", name=name, names=names,
                   seconds=seconds)]
