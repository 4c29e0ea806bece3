"""Files for other programs. A module of this folder that has `FORMATS` adds formats to the product: the command, the
window, batches and the Python API read them from `all_formats`.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil

from rhot_app.export.plan import Format


@functools.cache
def all_formats() -> dict[str, Format]:
    """All formats by their names, in alphabetical order."""
    modules = (importlib.import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__))
    found = (one for module in modules for one in getattr(module, "FORMATS", ()))
    return {one.name: one for one in sorted(found, key=lambda one: one.name)}
