"""Packages of the extras, imported when a format needs them; a missing one is a sentence."""

from __future__ import annotations

import importlib
from typing import Any

from rhot_app.errors import ExportError


def require(package: str, what: str, extra: str = "export") -> Any:
    """The module of an optional package. Raises ExportError that names `what` needs it, and the extra that has it."""
    try:
        return importlib.import_module(package)
    except ImportError as exc:
        raise ExportError(f"{what} needs the package {package.split('.')[0]!r}, which cannot be imported ({exc}). "
                          f"Install it with: pip install 'rhot[{extra}]'") from exc
