"""One reference to many arrays. numba unpacks every array of every call, a quarter of a microsecond each, and a filter
has eighty of them; a `Share` it takes as one."""

from __future__ import annotations

from typing import Any

from numba import njit
from numba.core import types
from numba.experimental import structref


@structref.register
class _ShareType(types.StructRef):
    """numba's type of a `Share`."""


class Share(structref.StructRefProxy):
    """Carries a tuple of arrays, `of`, into compiled functions, where they unpack it; arrays are changed in place."""

    of: Any

    def __new__(cls, of: tuple[Any, ...]) -> Share:
        """Share the arrays of a (named) tuple, which may hold further ones."""
        return _share(of)


structref.define_proxy(Share, _ShareType, ["of"])


@njit(cache=True)
def _share(of: tuple[Any, ...]) -> Share:
    return Share(of)
