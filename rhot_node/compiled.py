"""Where compiled code is kept: a folder of its own for every state of the compiled sources.

numba recompiles a function when its own file changes, but not when a function that it calls, in another file, does:
after an update, old and new code would run mixed and nobody would notice. A folder named by a hash of all sources that
numba compiles, and of those that these import, whose constants are compiled in, makes that impossible, and it is
writable where the package is not. The hash is of their place as well: numba does not find what it compiled of the same
sources in another one.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"
_KEPT = 3  # states of the sources: today's, and those of a checkout or two beside it
_IN_USE_S = 3600.0
_PACKAGES = ("rhot_node", "rhot_app")
_COMPILER = b"numba"
_IMPORTS = re.compile(r"^from ([\w.]+) import ([^()\n]+|\([^)]*)", re.MULTILINE)
_COMPLETE = "complete"


def sources_hash(folders: Sequence[Path]) -> str:
    """16 hex digits that change with any source file in `folders` that is compiled, or imported by one that is, and
    with where they lie."""
    digest = hashlib.sha256()
    for folder in folders:
        digest.update(bytes(folder.resolve()))
    texts = {".".join(path.relative_to(folder.parent).with_suffix("").parts): path.read_bytes()
             for folder in folders for path in folder.rglob("*.py")}
    for module in sorted(_compiled_and_imported(texts)):
        digest.update(module.encode())
        digest.update(texts[module])
    return digest.hexdigest()[:16]


def _compiled_and_imported(texts: dict[str, bytes]) -> set[str]:
    """Of modules, by their dotted names, those that are compiled and all that they import, directly or not."""
    found: set[str] = set()
    waiting = [module for module, text in texts.items() if _COMPILER in text]
    while waiting:
        module = waiting.pop()
        if module in found or module not in texts:
            continue
        found.add(module)
        for package, names in _IMPORTS.findall(texts[module].decode()):
            waiting += [package, *(f"{package}.{name}" for name in re.findall(r"\w+", names))]
    return found


def use_own_cache() -> None:
    """Point numba at the folder of the present sources, unless the environment names one. Call before compiling any."""
    if VARIABLE in os.environ:
        return
    try:
        from platformdirs import user_cache_path
        base = user_cache_path("rhot") / "numba"
        folder = base / _present_hash()
        if not folder.is_dir():
            folder.mkdir(parents=True)
            _forget_old(base)
        folder.touch()
    except OSError:  # no home, or a read-only one: numba then keeps to its own rules
        return
    os.environ[VARIABLE] = str(folder)
    if "numba" in sys.modules:  # it reads the environment only when it loads, and a caller may have used it before
        sys.modules["numba"].config.CACHE_DIR = str(folder)


def is_complete() -> bool:
    """Whether everything has been compiled for the present sources (`mark_complete`)."""
    return VARIABLE in os.environ and (Path(os.environ[VARIABLE]) / _COMPLETE).exists()


def announce_compilation(takes: str = "some minutes") -> None:
    """Have this process say on standard error when it begins to compile, once: whoever waits learns why. It says
    nothing where all that it calls is compiled. `takes`: how long it takes where nothing is. Loads numba, so check
    first what can be refused."""
    from numba.core import event

    class Notice(event.Listener):
        said = False

        def on_start(self, event: object) -> None:
            if not self.said:
                self.said = True
                print("rhot: the numerical code is being compiled, once for these sources; that takes "
                      f"{'some seconds' if is_complete() else takes}.", file=sys.stderr, flush=True)

        def on_end(self, event: object) -> None:
            """Nothing: the next function follows."""

    global _announced
    if not _announced:
        _announced = True
        event.register("numba:compile", Notice())


_announced = False  # the listener stays registered until the process ends


def compiles_since(t_unix_s: float) -> bool:
    """Whether programs that began at this time have to compile: nothing is compiled yet, or something has been since,
    while all of it was not."""
    if is_complete():
        return False
    files = list(Path(os.environ[VARIABLE]).rglob("*.nbi")) if VARIABLE in os.environ else []
    with contextlib.suppress(OSError):  # one that is being replaced
        return not files or any(file.stat().st_mtime >= t_unix_s for file in files)
    return True


def is_compiled_in(cache: Path) -> bool:
    """Whether the cache of a user or service (what XDG_CACHE_HOME names) has any code of the present sources."""
    return any((cache / "rhot" / "numba" / _present_hash()).rglob("*.nbi"))


def mark_complete() -> None:
    """Note that everything has been compiled for the present sources. Raises OSError."""
    if VARIABLE in os.environ:
        (Path(os.environ[VARIABLE]) / _COMPLETE).touch()


def _present_hash() -> str:
    root = Path(__file__).parent.parent
    return sources_hash([root / name for name in _PACKAGES if (root / name).is_dir()])


def _forget_old(base: Path) -> None:
    folders = sorted((path for path in base.iterdir() if path.is_dir()), key=lambda path: path.stat().st_mtime)
    for folder in folders[:-_KEPT]:
        if time.time() - folder.stat().st_mtime > _IN_USE_S:  # programs of other checkouts may run on it
            shutil.rmtree(folder, ignore_errors=True)
