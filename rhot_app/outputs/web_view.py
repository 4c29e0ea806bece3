"""The web view: one page that shows the hand live, in browsers and in headsets (WebXR).

Only who knows the random secret in its address gets anything. Nothing that a client sends is read. Away from this
computer connections are encrypted, because the secret would be read on the way and WebXR is refused otherwise.
"""

from __future__ import annotations

import functools
import hashlib
import hmac
import ipaddress
import os
import secrets
import socket
import ssl
import subprocess
import tempfile
from pathlib import Path
from typing import Final

from websockets.http11 import Request, Response

from rhot_app.errors import OutputError
from rhot_app.keys import keys_path
from rhot_app.outputs.joints import Sample, json_message
from rhot_app.outputs.spec import SECRET_VARIABLE, WEB_PORT, host_and_port
from rhot_app.outputs.web_server import WebServer, http_answer, text_answer
from rhot_app.project import OutputSettings
from rhot_node.files import resource_path, write_atomically
from rhot_node.network.presence import is_loopback, own_interfaces

STATES: Final = "states"
"""Below the secret: the WebSocket that every state is sent to, as JSON (docs/outputs.md)."""

_FILES: Final = {
    "": ("index.html", "text/html; charset=utf-8"), "style.css": ("style.css", "text/css; charset=utf-8"),
    "icon.svg": ("icon.svg", "image/svg+xml"),
    **{name: (name, "text/javascript; charset=utf-8")
       for name in ("view.js", "hand.js", "three.module.min.js", "three.core.min.js")}}
"""What there is, by its name below the secret. Nothing else is ever read."""

_SECURITY: Final = (
    ("Content-Security-Policy", "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
                                "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"),
    ("Referrer-Policy", "no-referrer"), ("X-Frame-Options", "DENY"), ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cross-Origin-Resource-Policy", "same-origin"), ("Permissions-Policy", "xr-spatial-tracking=(self)"))


class WebViewSink:
    """The page and its stream, on one port."""

    def __init__(self, settings: OutputSettings) -> None:
        """Takes the secret of SECRET_VARIABLE, or draws one; opens nothing yet. Raises OutputError when the target is
        not [HOST:]PORT."""
        if settings.target:
            host, port = host_and_port(settings, "127.0.0.1")
        else:
            host, port = "127.0.0.1", WEB_PORT
        here = host == "localhost" or is_loopback(host)
        names = _names(host)
        tls = None if here else functools.partial(server_context, names)
        self._secret = os.environ.get(SECRET_VARIABLE) or secrets.token_urlsafe(24)
        shown = f"[{names[0]}]" if ":" in names[0] else names[0]
        self.url = f"{'http' if here else 'https'}://{shown}:{port}/{self._secret}/"
        self._files: dict[str, tuple[bytes, str]] = {}
        self._server = WebServer(host, port, self._answer, tls)

    @property
    def clients(self) -> int:
        """How many pages are open."""
        return self._server.clients

    def open(self) -> None:
        """Listen; raises OutputError when the port cannot be had or no certificate can be made."""
        self._files = {name: (resource_path("web", file).read_bytes(), kind) for name, (file, kind) in _FILES.items()}
        self._server.open()

    def write(self, sample: Sample) -> None:
        """Send one state to the open pages."""
        self._server.require_running()
        if self._server.clients:
            self._server.broadcast(json_message(sample))

    def close(self) -> None:
        """Close all connections and the port."""
        self._server.close()

    def _answer(self, request: Request) -> Response | None:
        secret, slash, name = request.path.partition("?")[0].removeprefix("/").partition("/")
        if not hmac.compare_digest(secret.encode(), self._secret.encode()):
            return text_answer(403, "This address is not the one that the engine has printed: its secret is missing or "
                                    "wrong. A new one is drawn whenever the engine starts.")
        if name == STATES:
            if request.headers.get("Upgrade", "").lower() == "websocket":
                return None
            return text_answer(426, "This is a WebSocket.")
        found = self._files.get(name) if slash else None
        if found is None:
            return text_answer(404, "There is nothing here; the page's address ends with its secret and a slash.")
        return http_answer(200, *found, _SECURITY)


def _names(host: str) -> tuple[str, ...]:
    """Names and addresses by which a browser reaches this host, the best one first."""
    if host not in ("0.0.0.0", "::"):
        return (host,)
    addresses = [str(interface.ip) for interface in own_interfaces()]
    return tuple(dict.fromkeys((*addresses, socket.gethostname(), "localhost")))


DAYS: Final = 397  # browsers believe none that is longer (CA/Browser Forum, baseline requirements 6.3.2)
_DAY_S: Final = 86400
_TIMEOUT_S: Final = 20.0
_WISHES: Final = """[req]
prompt = no
distinguished_name = name
x509_extensions = server
[name]
CN = RHOT
[server]
basicConstraints = critical, CA:FALSE
keyUsage = critical, digitalSignature
extendedKeyUsage = serverAuth
subjectAltName = {alternatives}
"""
"""Of openssl: a certificate of this server alone, with which nobody can vouch for another."""


def server_context(names: tuple[str, ...]) -> ssl.SSLContext:
    """What encrypts connections to a server of these names and addresses. Raises OutputError."""
    path = _path(names)
    if not path.exists() or _openssl("x509", "-checkend", str(_DAY_S), "-noout", "-in", str(path)) is None:
        _make(path, names)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(path)
    except (OSError, ssl.SSLError) as exc:
        raise OutputError(f"{path}: this certificate cannot be used ({exc}); remove the file, and a new one is "
                          "made.") from exc
    return context


def _path(names: tuple[str, ...]) -> Path:
    digest = hashlib.sha256("\n".join(sorted(names)).encode()).hexdigest()[:16]
    return keys_path().parent / f"web-server-{digest}.pem"


def _make(path: Path, names: tuple[str, ...]) -> None:
    """Write private key and certificate into one file of mode 0600."""
    alternatives = ",".join(f"{'IP' if _is_address(name) else 'DNS'}:{name}" for name in names)
    with tempfile.TemporaryDirectory(prefix="rhot-certificate-") as folder:  # of mode 0700
        key, certificate = Path(folder, "key.pem"), Path(folder, "certificate.pem")
        wishes = Path(folder, "openssl.cnf")
        wishes.write_text(_WISHES.format(alternatives=alternatives))
        made = _openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                        "-keyout", str(key), "-out", str(certificate), "-days", str(DAYS), "-config", str(wishes))
        if made is None:
            raise OutputError(f"openssl could not make a certificate for {names[0]}; is that a name or an address?")
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_atomically(path, key.read_bytes() + certificate.read_bytes(), private=True)
        except OSError as exc:
            raise OutputError(f"{path}: the certificate cannot be written ({exc.strerror}).") from exc


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _openssl(*arguments: str) -> bytes | None:
    """What openssl printed; None when it refused. Raises OutputError when there is no openssl."""
    try:
        done = subprocess.run(["openssl", *arguments], capture_output=True, stdin=subprocess.DEVNULL, check=False,
                              timeout=_TIMEOUT_S)
    except FileNotFoundError as exc:
        raise OutputError("away from this computer the web view is encrypted, and its certificate is made by openssl, "
                          "which is missing: `sudo apt-get install openssl`.") from exc
    except subprocess.TimeoutExpired as exc:
        raise OutputError("openssl did not end.") from exc
    return done.stdout if done.returncode == 0 else None
