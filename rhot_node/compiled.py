"""Where compiled code is kept: a folder of its own for every state of the compiled sources.

numba recompiles a function when its own file changes, but not when a function that it calls, in another file, does:
after an update, old and new code would run mixed and nobody would notice. A folder named by a hash of all sources that
numba compiles, and of those that these import, whose constants are compiled in, makes that impossible, and it is
writable where the package is not. The hash is of their place as well: numba does not find what it compiled of the same
sources in another one.
"""

from __future__ import annotations

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


def is_cold() -> bool:
    """Whether nothing has been compiled yet for the present sources, so that the first start takes long."""
    return VARIABLE not in os.environ or not (is_complete() or any(Path(os.environ[VARIABLE]).rglob("*.nbi")))


def announce_compilation(part: str = "tracking", takes: str = "some minutes") -> None:
    """Say on standard error why the first run of all takes long; later ones say nothing. A command that tracks nothing,
    such as ``rhot simulate``, compiles only what it needs and leaves the tracker for later. `part`: the package that a
    command needs last; `takes`: how long it takes."""
    if is_cold() or not (is_complete() or any(Path(os.environ[VARIABLE]).glob(f"{part}_*/*.nbi"))):
        print(f"rhot: the numerical code is being compiled, once for these sources; that takes {takes}.",
              file=sys.stderr, flush=True)


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
