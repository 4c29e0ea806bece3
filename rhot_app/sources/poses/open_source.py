"""Opens a source of poses by its name, as commands, wizards and settings write it."""

from __future__ import annotations

from pathlib import Path

from rhot_app.errors import SourceError
from rhot_app.sources.poses.line_inputs import LIBSURVIVE, ProgramLines, TcpLines, UdpLines, command_of, endpoint_of
from rhot_app.sources.poses.lines import LinePoses
from rhot_app.sources.poses.source import FilePoses, PoseSource

LOOPBACK = "127.0.0.1"


def open_source(name: str, tracker: str = "") -> PoseSource:
    """The source `name`: ``openvr``, ``libsurvive``, ``run:PROGRAM ...``, ``tcp:HOST:PORT``, ``udp:PORT`` (of this
    machine only; ``udp:ADDRESS:PORT`` listens at that address), or a CSV file. `tracker`: serial number, name or role.

    Raises SourceError, or ObjectError for a file.
    """
    kind, colon, rest = name.partition(":")
    if name == "openvr":
        from rhot_app.sources.poses.steamvr import SteamVrPoses

        return SteamVrPoses(tracker)
    if name == "libsurvive":
        return LinePoses(ProgramLines(LIBSURVIVE), tracker)
    if colon and kind == "run":
        return LinePoses(ProgramLines(command_of(rest)), tracker)
    if colon and kind == "tcp":
        return LinePoses(TcpLines(*endpoint_of(rest, LOOPBACK)), tracker)
    if colon and kind == "udp":
        return LinePoses(UdpLines(*endpoint_of(rest, LOOPBACK)), tracker)
    if tracker:
        raise SourceError(f"{name}: a CSV file holds one tracker, without its name. Leave --tracker out.")
    return FilePoses(Path(name))
