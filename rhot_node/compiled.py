"""Where numba keeps compiled code: one folder for each version of the compiled sources.

numba recompiles a function when its own file changes, but not when a function that it calls, in another file, does.
After an update, old and new code would run together. So the folder's name is a hash of all sources that numba compiles
and of all that they import, whose constants are compiled in. The hash covers the path of the sources as well: numba
finds no code that it compiled of the same sources elsewhere.

A new folder starts with the code of all modules that are unchanged, with what they import, since an earlier folder.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import TextIO, cast

from rhot_node.threads import Worker

VARIABLE = "NUMBA_CACHE_DIR"
_KEPT = 3  # folders: of this version of the sources, and of two other checkouts
_IN_USE_S = 3600.0
_PACKAGES = ("rhot_node", "rhot_app")
_COMPILER = b"numba"
_IMPORTS = re.compile(r"^from ([\w.]+) import ([^()\n]+|\([^)]*)", re.MULTILINE)
_MODULES = "modules.json"

ALL = "all"
WINDOW = "window"
"""Parts of the code that `mark_complete` marks as compiled; `rhot_app.warm` has more."""


def sources_hash(folders: Sequence[Path]) -> str:
    """16 hex digits of the paths of `folders` and of all source files in them that are compiled or imported by one that
    is."""
    texts = _texts(folders)
    return _hash(texts, _with_imports(texts, _compiled(texts)), folders)


def module_hashes(folders: Sequence[Path]) -> dict[str, str]:
    """By compiled module in `folders`, a hash of its source and of all that it imports."""
    texts = _texts(folders)
    return {module: _hash(texts, _with_imports(texts, [module]), folders) for module in _compiled(texts)}


def _texts(folders: Sequence[Path]) -> dict[str, bytes]:
    """Source files by the dotted names of their modules."""
    return {".".join(path.relative_to(folder.parent).with_suffix("").parts): path.read_bytes()
            for folder in folders for path in folder.rglob("*.py")}


def _compiled(texts: dict[str, bytes]) -> list[str]:
    return [module for module, text in texts.items() if _COMPILER in text]


def _with_imports(texts: dict[str, bytes], modules: Sequence[str]) -> set[str]:
    """These modules and all that they import, directly or not."""
    found: set[str] = set()
    waiting = list(modules)
    while waiting:
        module = waiting.pop()
        if module in found or module not in texts:
            continue
        found.add(module)
        waiting += _imports(texts[module])
    return found


@cache
def _imports(text: bytes) -> list[str]:
    """Dotted names of what a source file imports: modules, and functions and classes of them."""
    return [name for package, names in _IMPORTS.findall(text.decode())
            for name in (package, *(f"{package}.{name}" for name in re.findall(r"\w+", names)))]


def _hash(texts: dict[str, bytes], modules: set[str], folders: Sequence[Path]) -> str:
    digest = hashlib.sha256()
    for folder in folders:
        digest.update(bytes(folder.resolve()))
    for module in sorted(modules):
        digest.update(module.encode())
        digest.update(texts[module])
    return digest.hexdigest()[:16]


def use_own_cache() -> None:
    """Have numba use the folder of the present sources, unless the environment names one. Call before it compiles."""
    if VARIABLE in os.environ:
        return
    name = sources_hash(_packages())
    for base in _bases():
        with contextlib.suppress(OSError):  # no home, or one that cannot be written
            folder = base / "numba" / name
            if not folder.is_dir():
                _make_folder(folder)
                _remove_old(folder.parent)
            folder.touch()
            os.environ[VARIABLE] = str(folder)
            if "numba" in sys.modules:  # it reads the environment only when it is imported
                sys.modules["numba"].config.CACHE_DIR = str(folder)
            return


def _bases() -> Iterator[Path]:
    """Where folders of compiled code may lie: the user's cache, the virtual environment, a temporary folder."""
    from platformdirs import user_cache_path

    yield user_cache_path("rhot")
    if sys.prefix != sys.base_prefix:
        yield Path(sys.prefix) / "rhot-cache"
    own = Path(tempfile.gettempdir()) / f"rhot-cache-{os.getuid()}"
    with contextlib.suppress(OSError):
        own.mkdir(mode=stat.S_IRWXU, exist_ok=True)
        status = own.lstat()
        if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not (
                status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
            yield own  # else others could replace code that runs as this user


def is_complete(part: str = ALL) -> bool:
    """Whether a part has been compiled for the present sources (`mark_complete`)."""
    return VARIABLE in os.environ and (Path(os.environ[VARIABLE]) / f"complete-{part}").exists()


def announce_compilation(takes: str = "one to three minutes") -> None:
    """Have this process print one line to standard error when it starts to compile, and how long it has compiled while
    it goes on: on a terminal every second, else every `STILL_S`.

    `takes`: how long it takes where nothing is compiled. Imports numba, which is slow: validate arguments first.
    """
    from numba.core import event

    class Notice(event.Listener):
        began_s: float | None = None
        under_way = 0

        def on_start(self, event: object) -> None:
            self.under_way += 1
            if self.began_s is None:
                self.began_s = time.monotonic()
                _tell(f"the numerical code is being compiled, once for these sources; that takes "
                      f"{'some seconds' if is_complete() else takes}.", for_good=True)
                Worker("says how long it compiles", self._tell_time, wait=_pause).start()

        def on_end(self, event: object) -> None:
            self.under_way -= 1

        def _tell_time(self) -> None:
            if self.under_way and self.began_s is not None:
                _tell(f"compiling, {time.monotonic() - self.began_s:.0f} s so far", for_good=False)

    global _announced
    if not _announced:
        _announced = True
        event.register("numba:compile", Notice())


STILL_S = 20.0
"""s: between two lines that say that it still compiles, where a line cannot be rewritten."""


def _pause() -> None:
    time.sleep(1.0 if _terminal().isatty() else STILL_S)


def _terminal() -> TextIO:
    return cast(TextIO, getattr(sys.stderr, "terminal", sys.stderr))  # a line is rewritten by escapes


def _tell(text: str, *, for_good: bool) -> None:
    """A line on standard error; on a terminal in the place of what is rewritten there."""
    terminal = _terminal()
    start, end = ("\r", "\x1b[K") if terminal.isatty() else ("", "")
    print(f"{start}rhot: {text}{end}", file=terminal, end="\n" if for_good or not start else "", flush=True)


_announced = False


def is_compiled_in(cache: Path) -> bool:
    """Whether the cache of a user or service (what XDG_CACHE_HOME names) has any code of the present sources."""
    return any((cache / "rhot" / "numba" / sources_hash(_packages())).rglob("*.nbi"))


def mark_complete(part: str = ALL) -> None:
    """Mark a part as compiled for the present sources. Raises OSError."""
    if VARIABLE in os.environ:
        (Path(os.environ[VARIABLE]) / f"complete-{part}").touch()


def _packages() -> list[Path]:
    root = Path(__file__).parent.parent
    return [root / name for name in _PACKAGES if (root / name).is_dir()]


def _make_folder(folder: Path) -> None:
    """Make the folder of the present sources, with the code of unchanged modules from the folders beside it."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    hashes = module_hashes(_packages())
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".new-", ignore_cleanup_errors=True) as place:
        new = Path(place) / folder.name
        new.mkdir()
        (new / _MODULES).write_text(json.dumps(hashes))
        for old in _newest_first(folder.parent):
            with contextlib.suppress(OSError, ValueError):  # of an older version, or being removed
                _link_unchanged(old, json.loads((old / _MODULES).read_text()), new, hashes)
        with contextlib.suppress(OSError):  # another process has made it meanwhile
            new.rename(folder)


def _link_unchanged(old: Path, old_hashes: dict[str, str], new: Path, hashes: dict[str, str]) -> None:
    """Link the code in `old` of modules whose hash is the same.

    numba keeps ``f`` of ``PACKAGE/MODULE.py`` in files named ``MODULE.f-LINE...``. Their folder's name is ``PACKAGE``
    and the hash of its path.
    """
    root = Path(__file__).parent.parent
    for module in {module for module, digest in hashes.items() if old_hashes.get(module) == digest}:
        package = root.joinpath(*module.split(".")[:-1])
        place = f"{package.name}_{hashlib.sha1(os.fsencode(package)).hexdigest()}"
        for file in (old / place).glob(f"{module.rpartition('.')[2]}.*"):
            target = new / place / file.name
            if not target.exists():
                target.parent.mkdir(exist_ok=True)
                os.link(file, target)


def _newest_first(base: Path) -> list[Path]:
    folders = [path for path in base.iterdir() if path.is_dir() and not path.name.startswith(".")]
    return sorted(folders, key=lambda path: path.stat().st_mtime, reverse=True)


def _remove_old(base: Path) -> None:
    for folder in _newest_first(base)[_KEPT:]:
        if time.time() - folder.stat().st_mtime > _IN_USE_S:  # programs of other checkouts may run on it
            shutil.rmtree(folder, ignore_errors=True)
