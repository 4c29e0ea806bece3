"""The outputs to other programs, in a process of their own, which gets the states as every client does.

In the engine's process they would take turns with the tracker for the interpreter, and on a busy computer a state would
wait for them. So a plug-in that crashes ends nothing else, either; the process is then started again.

The engine writes rigs as lines of JSON to its standard input, and reads the outputs' status as lines of JSON from its
standard output. It ends when its input does.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import os
import secrets
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from typing import IO, Final

import msgspec
import zmq

from rhot_app.engine.status import TOPIC_STATE, decode
from rhot_app.errors import OutputError
from rhot_app.outputs.outputs import Outputs, check_output
from rhot_app.outputs.spec import SECRET_VARIABLE, OutputStatus, as_run
from rhot_app.project import OutputSettings, Rig, parse_rig
from rhot_app.state import HandState
from rhot_node.network.context import Context
from rhot_node.terminal import log_to_stderr
from rhot_node.threads import OneShotThread, Watch, Worker, complaints

RESTART_S: Final = 1.0
SETTLE_S: Final = 15.0  # a process that starts, on a busy computer
SILENT_S: Final = 15.0  # nothing heard for so long: it hangs, and is ended
STATUS_S: Final = 0.2
NICE: Final = 5  # gives way to the engine, whose own threads hold the interpreter for those that track
_END_S: Final = 5.0
_POLL_MS: Final = 50
_RECEIVE_QUEUE: Final = 100  # states

log = logging.getLogger(__name__)


class OutputProcess:
    """The engine's side; any thread may call it."""

    def __init__(self, states: str, fixed: Iterable[OutputSettings] = (), *, follow_rig: bool = True) -> None:
        """`states`: ZeroMQ endpoint of the hand states. `fixed`: outputs of the command line, which stay whatever the
        rig says. `follow_rig`: whether the rig's own are opened too; a replay leaves them out, because nothing that is
        old is sent anywhere unasked."""
        self._endpoint = states
        self._fixed = tuple(fixed)
        self._follow_rig = follow_rig
        self._wanted: tuple[OutputSettings, ...] = ()
        self._document = b""
        self._process: subprocess.Popen[bytes] | None = None
        self._status: tuple[OutputStatus, ...] = ()
        self._failure = ""
        self._faults: tuple[str, ...] = ()  # of the process's own threads
        self._ended_s = 0.0
        self._heard_s = 0.0
        self._lock = threading.Lock()
        self._environment = os.environ | {SECRET_VARIABLE: secrets.token_urlsafe(24)}  # one for the engine's life

    def check(self, rig: Rig) -> None:
        """Raises OutputError for an output that cannot be."""
        for settings in self._outputs_of(rig):
            check_output(settings)

    def configure(self, rig: Rig) -> None:
        """Open what the rig asks for and close what it does not; what stays goes on with the rig's hands."""
        with self._lock:
            self._wanted = tuple(dict.fromkeys(map(as_run, self._outputs_of(rig))))
            self._document = msgspec.json.encode(msgspec.structs.replace(rig, outputs=self._wanted)) + b"\n"
            if self._process is not None:
                self._status = self._of_wanted(self._status)
                self._tell()
            elif self._wanted:
                self._start()

    def settle(self) -> None:
        """Wait until each output has opened or failed to, but not for long."""
        end_s = time.monotonic() + SETTLE_S
        while time.monotonic() < end_s and any(one.state == "starting" for one in self.status()):
            time.sleep(0.02)

    def status(self) -> tuple[OutputStatus, ...]:
        """How each goes; the process is started again when it has ended."""
        with self._lock:
            process = self._process
            if process is None:
                return self._status
            now_s = time.monotonic()
            if process.poll() is None:
                if now_s - self._heard_s > SILENT_S:
                    process.kill()
            elif not self._ended_s:
                self._ended_s = now_s
                self._failure = (f"The program of the outputs ended (code {process.returncode}) and is started again. "
                                 "If that goes on, leave out one output after the other.")
                self._status = self._of_wanted(())
                log.warning("rhot: %s Tracking goes on.", self._failure)
            elif now_s - self._ended_s > RESTART_S:
                self._start()
            return self._status

    def complaints(self) -> list[str]:
        """A sentence for each output that does not do what it should."""
        found = [f"Output {status.spec}: {status.message} Tracking goes on." for status in self.status()
                 if status.message]
        return [*([self._failure] if self._failure else []), *found, *self._faults]

    def close(self) -> None:
        """End the process. May be called twice."""
        with self._lock:
            process, self._process = self._process, None
        if process is None:
            return
        assert process.stdin is not None
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def _outputs_of(self, rig: Rig) -> tuple[OutputSettings, ...]:
        of_rig = (settings for settings in rig.outputs if settings.enabled) if self._follow_rig else ()
        return (*self._fixed, *of_rig)

    def _of_wanted(self, told: tuple[OutputStatus, ...]) -> tuple[OutputStatus, ...]:
        """What was told of the outputs that are wanted now; those not told of yet are starting."""
        known, fixed = {status.spec: status for status in told}, set(map(as_run, self._fixed))
        return tuple(replace(known.get(settings.spec) or OutputStatus(settings.spec, settings.kind, "starting"),
                             fixed=settings in fixed) for settings in self._wanted)

    def _start(self) -> None:
        self._status = self._of_wanted(())
        self._ended_s, self._heard_s = 0.0, time.monotonic()
        self._process = subprocess.Popen([sys.executable, "-m", "rhot_app.engine.output_process", self._endpoint],
                                         stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=self._environment)
        self._faults = ()
        self._reader = OneShotThread("reads the outputs' status", functools.partial(self._read, self._process))
        self._tell()

    def _tell(self) -> None:
        assert self._process is not None and self._process.stdin is not None
        with contextlib.suppress(OSError):  # it has ended; it is told when it is started again
            self._process.stdin.write(self._document)
            self._process.stdin.flush()

    def _read(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        decoder = msgspec.json.Decoder(_Told)
        for line in process.stdout:
            with contextlib.suppress(msgspec.MsgspecError):  # a plug-in may print, too
                told = decoder.decode(line)
                with self._lock:
                    if process is self._process and process.poll() is None:
                        self._failure, self._heard_s = "", time.monotonic()
                        self._status, self._faults = self._of_wanted(told.outputs), told.faults


class _Told(msgspec.Struct):
    """What the process says of itself: its outputs, and what is wrong with its threads."""

    outputs: tuple[OutputStatus, ...]
    faults: tuple[str, ...]


class OutputProgram:
    """The process's own side: states in, outputs fed, status out. `step` belongs to one thread, `tell` to another."""

    def __init__(self, states: zmq.Socket[bytes], rigs: deque[bytes], status: IO[bytes]) -> None:
        """`states`: subscribed to the hand states. `rigs`: documents that came, oldest first."""
        self._states, self._rigs, self._out = states, rigs, status
        self._outputs = Outputs()
        self._has_rig = False  # nothing to tell before
        self._watch = Watch("passes states on to the outputs")

    def step(self) -> None:
        """Take a rig up, and pass on what states there are."""
        with self._watch.timed():
            self._step()

    def tell(self) -> None:
        """Tell the status."""
        if self._has_rig:
            self._out.write(msgspec.json.encode(_Told(self._outputs.status(), tuple(complaints()))) + b"\n")
            self._out.flush()

    def _step(self) -> None:
        if self._rigs:
            document = self._rigs.pop()
            self._rigs.clear()
            try:
                self._outputs.configure(parse_rig(document, "the engine's rig"))
            except OutputError as exc:
                log.warning("rhot: %s", exc)
            self._has_rig = True
        if self._states.poll(_POLL_MS):
            with contextlib.suppress(zmq.Again):
                while True:
                    topic, payload = self._states.recv_multipart(zmq.DONTWAIT)
                    state = decode(topic, payload)
                    assert isinstance(state, HandState)
                    self._outputs.send(state)

    def close(self) -> None:
        """Close all outputs."""
        self._outputs.close()


def main() -> int:
    """Run until standard input ends: with the engine, however that ends."""
    log_to_stderr()
    os.nice(NICE)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C is the engine's, which then closes the input
    status, sys.stdout = sys.stdout.buffer, sys.stderr
    rigs: deque[bytes] = deque()
    ended = threading.Event()

    def read() -> None:
        for line in sys.stdin.buffer:
            rigs.append(line)
        ended.set()
    rig_reader = OneShotThread("reads the engine's rigs", read)
    context = Context()
    states = context.socket(zmq.SUB)
    states.setsockopt(zmq.RCVHWM, _RECEIVE_QUEUE)
    states.setsockopt(zmq.SUBSCRIBE, TOPIC_STATE)
    states.connect(sys.argv[1])
    program = OutputProgram(states, rigs, status)

    def tell() -> None:
        try:
            program.tell()
        except BrokenPipeError:  # the engine has ended
            ended.set()
        reporter.ending.wait(STATUS_S)
    reporter = Worker("tells the engine how the outputs go", tell)
    reporter.start()
    try:
        while not ended.is_set() and rig_reader.running:
            program.step()
    finally:
        reporter.close()
        program.close()
        context.destroy(0)
    return 0


if __name__ == "__main__":
    sys.exit(main())
