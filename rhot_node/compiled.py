"""Where compiled code is kept: a folder of its own for every state of the compiled sources.

numba recompiles a function when its own file changes, but not when a function that it calls, in another file, does:
after an update, old and new code would run mixed and nobody would notice. A folder named by a hash of all sources that
numba compiles, and of those that these import, whose constants are compiled in, makes that impossible, and it is
writable where the package is not. The hash is of their place as well: numba does not find what it compiled of the same
sources in another one.

A new folder begins with what earlier ones have of modules that are unchanged, with all that they import.
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

VARIABLE = "NUMBA_CACHE_DIR"
_KEPT = 3  # states of the sources: today's, and those of a checkout or two beside it
_IN_USE_S = 3600.0
_PACKAGES = ("rhot_node", "rhot_app")
_COMPILER = b"numba"
_IMPORTS = re.compile(r"^from ([\w.]+) import ([^()\n]+|\([^)]*)", re.MULTILINE)
_MODULES = "modules.json"

ALL = "all"
WINDOW = "window"
"""Parts of the code that are noted as compiled (`mark_complete`); `rhot_app.warm` has more."""


def sources_hash(folders: Sequence[Path]) -> str:
    """16 hex digits that change with any source file in `folders` that is compiled, or imported by one that is, and
    with where they lie."""
    texts = _texts(folders)
    return _hash(texts, _with_imports(texts, _compiled(texts)), folders)


def module_hashes(folders: Sequence[Path]) -> dict[str, str]:
    """Of each module in `folders` that is compiled, a hash of its source and of all that it imports."""
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
    """What a source file may import, by dotted names; some are functions and no modules."""
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
    """Point numba at the folder of the present sources, unless the environment names one. Call before compiling any."""
    if VARIABLE in os.environ:
        return
    name = sources_hash(_packages())
    for base in _bases():
        with contextlib.suppress(OSError):  # no home, or one that cannot be written
            folder = base / "numba" / name
            if not folder.is_dir():
                _begin(folder)
                _forget_old(folder.parent)
            folder.touch()
            os.environ[VARIABLE] = str(folder)
            if "numba" in sys.modules:  # it reads the environment when it loads, and a caller may have used it before
                sys.modules["numba"].config.CACHE_DIR = str(folder)
            return


def _bases() -> Iterator[Path]:
    """Where compiled code may be kept: the user's cache, else the virtual environment, else this user's own folder
    among the temporary ones."""
    from platformdirs import user_cache_path

    yield user_cache_path("rhot")
    if sys.prefix != sys.base_prefix:
        yield Path(sys.prefix) / "rhot-cache"
    own = Path(tempfile.gettempdir()) / f"rhot-cache-{os.getuid()}"
    with contextlib.suppress(OSError):
        own.mkdir(mode=0o700, exist_ok=True)
        status = own.lstat()
        if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o022:
            yield own  # code that others could replace would run as this user


def is_complete(part: str = ALL) -> bool:
    """Whether a part has been compiled for the present sources (`mark_complete`)."""
    return VARIABLE in os.environ and (Path(os.environ[VARIABLE]) / f"complete-{part}").exists()


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


def is_compiled_in(cache: Path) -> bool:
    """Whether the cache of a user or service (what XDG_CACHE_HOME names) has any code of the present sources."""
    return any((cache / "rhot" / "numba" / sources_hash(_packages())).rglob("*.nbi"))


def mark_complete(part: str = ALL) -> None:
    """Note that a part has been compiled for the present sources. Raises OSError."""
    if VARIABLE in os.environ:
        (Path(os.environ[VARIABLE]) / f"complete-{part}").touch()


def _packages() -> list[Path]:
    root = Path(__file__).parent.parent
    return [root / name for name in _PACKAGES if (root / name).is_dir()]


def _begin(folder: Path) -> None:
    """Make the folder of the present sources, with what the others beside it have of unchanged modules."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    hashes = module_hashes(_packages())
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".new-", ignore_cleanup_errors=True) as place:
        new = Path(place) / folder.name
        new.mkdir()
        (new / _MODULES).write_text(json.dumps(hashes))
        for old in _newest_first(folder.parent):
            with contextlib.suppress(OSError, ValueError):  # of an older version, or being removed
                _link_unchanged(old, json.loads((old / _MODULES).read_text()), new, hashes)
        with contextlib.suppress(OSError):  # another process was quicker
            new.rename(folder)


def _link_unchanged(old: Path, old_hashes: dict[str, str], new: Path, hashes: dict[str, str]) -> None:
    """Link what `old` has of modules whose hash is the same. numba keeps ``f`` of ``package/module.py`` in files named
    ``module.f-LINE...``, in a folder named by the name and the hash of ``package``'s path."""
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


def _forget_old(base: Path) -> None:
    for folder in _newest_first(base)[_KEPT:]:
        if time.time() - folder.stat().st_mtime > _IN_USE_S:  # programs of other checkouts may run on it
            shutil.rmtree(folder, ignore_errors=True)
