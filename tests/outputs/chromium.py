"""A headless Chromium with a fresh profile, driven over its DevTools socket, without a driver program."""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from patience import PATIENCE_S, eventually
from websockets.sync.client import ClientConnection, connect

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = ("--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
             "--disable-sync", "--no-proxy-server", "--disable-dev-shm-usage", "--window-size=1000,700",
             "--remote-debugging-port=0", "--remote-allow-origins=*")


class Page:
    """One page. `evaluate` runs JavaScript in it."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._numbers = itertools.count(1)

    def call(self, method: str, **arguments: Any) -> dict[str, Any]:
        """One DevTools command and its answer."""
        number = next(self._numbers)
        self._connection.send(json.dumps({"id": number, "method": method, "params": arguments}))
        while True:
            answer = json.loads(self._connection.recv(PATIENCE_S))
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]

    def open(self, url: str) -> None:
        """Go to an address."""
        self.call("Page.navigate", url=url)

    def draw_seldom(self) -> None:
        """Draw later pages five times a second; drawing takes a processor most of its time."""
        self.before_each_page("requestAnimationFrame = draw => setTimeout(() => draw(performance.now()), 200)")

    def before_each_page(self, script: str) -> None:
        """Run this before whatever a page brings."""
        self.call("Page.addScriptToEvaluateOnNewDocument", source=script)

    def evaluate(self, expression: str) -> Any:
        """The value of an expression; a promise is waited for. A click counts as the user's."""
        result = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True,
                           userGesture=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def until(self, expression: str) -> Any:
        """Wait until the expression is true; returns its value."""
        eventually(lambda: self.evaluate(expression),
                   told=lambda: (expression, self.evaluate("document.body && document.body.innerText")))
        return self.evaluate(expression)

    def screenshot(self) -> bytes:
        """The page as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot")["data"])


class Browser:
    """A browser that runs. Its pages are given by `page`, one after the other."""

    def __init__(self, address: str) -> None:
        self._address = address

    @contextlib.contextmanager
    def page(self) -> Iterator[Page]:
        """A new page in front."""
        with connect(self._address, max_size=2**26) as connection:
            browser = Page(connection)
            target = browser.call("Target.createTarget", url="about:blank", newWindow=True)["targetId"]
            place = f"{self._address.partition('/devtools/')[0]}/devtools/page/{target}"
            with connect(place, max_size=2**26) as own:
                page = Page(own)
                page.call("Page.enable")
                page.call("Page.bringToFront")
                page.call("Security.setIgnoreCertificateErrors", ignore=True)
                yield page
            browser.call("Target.closeTarget", targetId=target)


@contextlib.contextmanager
def chromium() -> Iterator[Browser]:
    """A browser. Skips the test where there is no Chromium; fails it where CI is set."""
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        sentence = "Chromium is missing: `./run test` installs it as root, or `sudo apt-get install chromium`."
        if os.environ.get("CI"):
            pytest.fail(sentence)
        pytest.skip(sentence)
    with tempfile.TemporaryDirectory(prefix="rhot-chromium-", ignore_cleanup_errors=True) as folder:
        process = subprocess.Popen([program, *ARGUMENTS, f"--user-data-dir={folder}", "about:blank"],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                   text=True)
        try:
            yield Browser(_address(process))
        finally:
            process.terminate()
            process.wait(PATIENCE_S)


def _address(process: subprocess.Popen[str]) -> str:
    """The DevTools socket of a browser."""
    assert process.stderr is not None
    said = []
    for line in process.stderr:
        said.append(line)
        _, found, browser = line.partition("DevTools listening on ")
        if found:
            return browser.strip()
    raise AssertionError(f"Chromium did not start: {''.join(said)}")


def saved(picture: bytes, name: str) -> None:
    """Keep a screenshot where RHOT_SCREENSHOTS says, for people."""
    folder = os.environ.get("RHOT_SCREENSHOTS")
    if folder:
        Path(folder, name).write_bytes(picture)
