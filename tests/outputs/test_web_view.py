"""The web view in a real browser: the hand is there and moves on, only with the secret, also in VR."""

from __future__ import annotations

import http.client
import os
import shutil
import socket
import ssl
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import cv2
import msgspec
import numpy as np
import pytest
from chromium import Browser, Page, chromium, saved
from patience import PATIENCE_S, eventually
from streams import Stream, free_port, unknown
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from rhot_app.outputs.spec import SECRET_VARIABLE, web_settings
from rhot_app.outputs.web_view import server_context
from rhot_app.project import Rig

needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None and not os.environ.get("CI"),
                                   reason="openssl is missing: sudo apt-get install openssl")
FAKE_HEADSET = Path(__file__).with_name("fake_headset.js").read_text()


def view_of(stream: Callable[..., Stream], host: str = "127.0.0.1") -> tuple[Stream, str]:
    """A web view that listens, and its address."""
    running = stream(web_settings(f"{host}:{free_port()}"))
    eventually(lambda: running.outputs.status()[0].state == "running", told=running.outputs.status)
    return running, running.outputs.status()[0].url


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with browser.page() as page:
        yield page


def get(url: str, method: str = "GET", path: str | None = None) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of an answer."""
    parts = urlsplit(url)
    if parts.scheme == "https":
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        connection = http.client.HTTPSConnection(parts.netloc, timeout=PATIENCE_S, context=context)
    else:
        connection = http.client.HTTPConnection(parts.netloc, timeout=PATIENCE_S)
    connection.request(method, parts.path if path is None else path)
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders()), answer.read()


def test_the_hand_is_drawn_live(stream: Callable[..., Stream], page: Page) -> None:
    _, url = view_of(stream)
    page.open(url)
    page.until("window.rhot && rhot.frames > 5 && rhot.received > 5")
    page.until("rhot.rate > 0")
    assert page.evaluate("document.getElementById('condition').textContent") == "Tracking"
    picture = page.screenshot()
    saved(picture, "web-view.png")
    image = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR).astype(int)
    skin = (image[..., 2] > 120) & (image[..., 2] - image[..., 0] > 40)  # red well above blue, in BGR
    assert 0.01 < skin.mean() < 0.5
    rows, columns = np.nonzero(skin[100:600])
    assert np.ptp(rows) > 150 and np.ptp(columns) > 60


def test_a_headset_is_entered_and_drawn_to(stream: Callable[..., Stream], page: Page) -> None:
    _, url = view_of(stream)
    page.before_each_page(FAKE_HEADSET)
    page.open(url)
    page.until("window.rhot && rhot.received > 5 && !document.getElementById('vr').hidden")
    assert page.evaluate("document.getElementById('ar').hidden")
    page.evaluate("document.getElementById('vr').click()")
    page.until("rhot.session && rhot.xrFrames > 10")
    assert page.evaluate("fakeHeadset.mode") == "immersive-vr"
    page.until("fakeHeadset.drawn > 1000")  # pixels of the hand
    saved(page.screenshot(), "web-view-vr.png")
    received = page.evaluate("rhot.received")
    page.until(f"rhot.received > {received} + 10")
    page.evaluate("document.getElementById('vr').click()")
    page.until("!rhot.session && document.getElementById('vr').textContent === 'Enter VR'")


def test_the_page_says_what_is_lost_and_finds_it_again(rig: Rig, stream: Callable[..., Stream], page: Page,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(SECRET_VARIABLE, "secret-of-the-engine")
    running, url = view_of(stream)
    assert "/secret-of-the-engine/" in url
    page.draw_seldom()
    page.open(url)
    page.until("window.rhot && rhot.received > 5 && rhot.hands.right?.visible")
    tracked, running.state = running.state, unknown(running.state)
    page.until("document.getElementById('condition').textContent === 'Lost' && !rhot.hands.right.visible")
    running.state = tracked
    running.outputs.close()
    page.until("document.getElementById('condition').textContent === 'No states come in'")
    page.until("!document.getElementById('notice').hidden && "
               "document.getElementById('notice').textContent.startsWith('The engine does not answer')")
    running.outputs.configure(msgspec.structs.replace(rig, outputs=(web_settings(urlsplit(url).netloc),)))
    page.until("document.getElementById('condition').textContent === 'Tracking' && "
               "document.getElementById('notice').hidden")


def test_without_the_secret_there_is_nothing(stream: Callable[..., Stream]) -> None:
    _, url = view_of(stream)
    secret = urlsplit(url).path
    for path in ("/", "/view.js", "/states", f"{secret[:-2]}/", f"/x{secret}", "//", secret.upper()):
        assert get(url, path=path)[0] == 403, path
    for path in (f"{secret}nothing", f"{secret}../view.js", f"{secret}..%2f..%2fpyproject.toml", f"{secret}/etc/passwd",
                 secret[:-1]):
        assert get(url, path=path)[0] == 404, path
    with pytest.raises(InvalidStatus, match="403"), connect(f"{_ws(url).replace(secret, '/guess/')}states"):
        pass


def test_the_page_keeps_strangers_out_of_itself(stream: Callable[..., Stream]) -> None:
    _, url = view_of(stream)
    status, headers, body = get(url)
    assert status == 200 and b"view.js" in body
    assert "default-src 'none'" in headers["Content-Security-Policy"] and headers["Referrer-Policy"] == "no-referrer"
    assert headers["X-Content-Type-Options"] == "nosniff" and headers["X-Frame-Options"] == "DENY"
    assert "unsafe" not in headers["Content-Security-Policy"]
    for name in ("view.js", "hand.js", "three.module.min.js", "three.core.min.js", "style.css", "icon.svg"):
        assert get(url + name)[0] == 200, name


@pytest.mark.parametrize("said", ["{}", b"\0", "x" * 100_000])
def test_whoever_says_anything_is_turned_away(stream: Callable[..., Stream], said: str | bytes) -> None:
    _, url = view_of(stream)
    with connect(f"{_ws(url)}states") as client, pytest.raises(ConnectionClosed) as closed:
        client.send(said)
        while True:
            client.recv(PATIENCE_S)
    assert closed.value.rcvd is not None and closed.value.rcvd.code in (1008, 1009)  # read only, too big
    with connect(f"{_ws(url)}states") as client:
        assert client.recv(PATIENCE_S)


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE"])
def test_nothing_can_be_written(stream: Callable[..., Stream], method: str) -> None:
    _, url = view_of(stream)
    assert get(url, method)[0] == 405


@needs_openssl
def test_other_computers_are_served_encrypted(stream: Callable[..., Stream], page: Page) -> None:
    _, url = view_of(stream, "0.0.0.0")
    assert url.startswith("https://")
    here = url.replace(urlsplit(url).hostname or "", "127.0.0.1")
    assert get(here)[0] == 200
    page.draw_seldom()
    page.open(here)
    page.until("window.rhot && rhot.received > 5 && isSecureContext")


@pytest.mark.parametrize("headers", [
    {"Origin": "http://evil.example"}, {"Origin": "null"}, {"Host": "evil.example"}, {"Host": "evil.example:80"},
    {"Host": "[::1"}])
def test_another_servers_page_and_a_name_that_others_point_here_are_refused(
        stream: Callable[..., Stream], headers: dict[str, str]) -> None:
    _, url = view_of(stream)
    where = urlsplit(url)
    lines = {"Host": where.netloc, "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
             "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", **headers}
    own = {**lines, "Host": where.netloc, "Origin": f"http://{where.netloc}"}
    for wanted, sent in ((b" 403 ", lines), (b" 101 ", own)):
        assert where.hostname is not None
        with socket.create_connection((where.hostname, where.port or 80), PATIENCE_S) as raw:
            said = "".join(f"{name}: {value}\r\n" for name, value in sent.items())
            raw.sendall(f"GET {where.path}states HTTP/1.1\r\n{said}\r\n".encode())
            assert wanted in raw.recv(200)


@needs_openssl
def test_the_certificate_vouches_for_this_server_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RHOT_KEYS", str(tmp_path / "keys.json"))
    server_context(("192.0.2.7", "desk"))
    (path,) = tmp_path.glob("web-server-*.pem")
    text = subprocess.run(["openssl", "x509", "-in", str(path), "-noout", "-text"], check=True, capture_output=True,
                          text=True).stdout
    assert "CA:FALSE" in text and "CA:TRUE" not in text and "TLS Web Server Authentication" in text
    assert "192.0.2.7" in text and "DNS:desk" in text


@needs_openssl
def test_a_certificate_is_used_again(stream: Callable[..., Stream]) -> None:
    seen = set()
    for _ in range(2):
        running, url = view_of(stream, "0.0.0.0")
        seen.add(ssl.get_server_certificate(("127.0.0.1", urlsplit(url).port or 0)))
        running.close()
    assert len(seen) == 1


def _ws(url: str) -> str:
    return url.replace("http", "ws", 1)
