"""The web view's own certificate, which no authority has signed: a browser asks once whether to go on.

Made by the program ``openssl``, kept beside the master's keys, and used again until it ends, so that a headset that has
accepted it once does so the next day.
"""

from __future__ import annotations

import hashlib
import ipaddress
import ssl
import subprocess
import tempfile
from pathlib import Path
from typing import Final

from rhot_app.errors import OutputError
from rhot_app.keys import keys_path
from rhot_node.files import write_atomically

DAYS: Final = 397  # browsers believe none that is longer (CA/Browser Forum, baseline requirements 6.3.2)
_DAY_S: Final = 86400
_TIMEOUT_S: Final = 20.0


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
    return keys_path().parent / f"web-{digest}.pem"


def _make(path: Path, names: tuple[str, ...]) -> None:
    """Write private key and certificate into one file of mode 0600."""
    alternatives = ",".join(f"{'IP' if _is_address(name) else 'DNS'}:{name}" for name in names)
    with tempfile.TemporaryDirectory(prefix="rhot-certificate-") as folder:  # of mode 0700
        key, certificate = Path(folder, "key.pem"), Path(folder, "certificate.pem")
        made = _openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                        "-keyout", str(key), "-out", str(certificate), "-days", str(DAYS), "-subj", "/CN=RHOT",
                        "-addext", f"subjectAltName={alternatives}")
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
