"""One reference to many arrays, lent to compiled functions.

numba unpacks every array of every call, a quarter of a microsecond each, and a filter has eighty of them; a `Share` it
takes as one. Its arrays are lent: they have no references that numba counts (`lean.py` says what that costs), and the
`Share` itself keeps them alive. So compiled code must not return any of them. A `Share` that compiled code makes owns
what is in it.
"""

from __future__ import annotations

from typing import Any

from numba import njit
from numba.core import cgutils, types
from numba.experimental import structref
from numba.extending import intrinsic


@structref.register
class _ShareType(types.StructRef):
    """numba's type of a `Share`."""


class Share(structref.StructRefProxy):
    """Carries a tuple of arrays, `of`, into compiled functions, where they unpack it; arrays are changed in place."""

    lent: Any
    of: Any

    def __new__(cls, of: tuple[Any, ...]) -> Share:
        """Share the arrays of a (named) tuple, which may hold further ones."""
        share: Share = _share(of)
        share.lent = of
        return share


structref.define_proxy(Share, _ShareType, ["of"])


def _lent(context: Any, of: Any) -> Any:
    """The same tuple, its arrays without owners: numba's counting passes them over."""
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return _uncounted(context, builder, signature.args[0], values[0])
    return of(of), generate


def _uncounted(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.BaseTuple):
        kinds: Any = kind
        parts = [_uncounted(context, builder, part, one)
                 for part, one in zip(kinds, cgutils.unpack_tuple(builder, value), strict=True)]
        return context.make_tuple(builder, kind, parts)
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value=value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    return value


_lend: Any = intrinsic(_lent)


@njit(cache=True)
def _share(of: tuple[Any, ...]) -> Share:
    return Share(_lend(of))
