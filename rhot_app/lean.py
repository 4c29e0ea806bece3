"""Compiled functions that allocate nothing and count no references.

numba counts who refers to an array: wherever one is passed on, or a row is cut out of it, a counter goes up and down
again, and every small array is asked of the allocator. Of a frame of the model tracker that was 14,000 counts and 500
allocations, a quarter of its time. What is compiled as `lean` does neither (where it would have to, it does not
compile) and takes room for intermediate results from the stack.

`_nrt` is numba's own, and promised by nobody: numba uses it for its own functions (tried with 0.61 to 0.68; the tests
of this file tell when it is gone).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numpy as np
from numba import njit
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array
from numpy.typing import NDArray

Function = TypeVar("Function", bound=Callable[..., Any])


class _Decorator(Protocol):
    def __call__(self, function: Function) -> Function: ...


_njit: Any = njit  # of whose options its types do not know all

lean: _Decorator = _njit(cache=True, _nrt=False)
"""Compiles a function that needs no memory. It returns numbers, fills arrays, and may call others of its kind."""

lean_fused: _Decorator = _njit(cache=True, _nrt=False, fastmath={"contract"})
"""The same, products and sums in one."""

lean_summed: _Decorator = _njit(cache=True, _nrt=False, fastmath={"contract", "reassoc"})
"""The same, sums in any order."""


def _on_stack(number: Any) -> Any:
    def typed(context: Any, shape: Any) -> Any:
        if not all(isinstance(side, types.IntegerLiteral) for side in shape):
            return None
        sides = [side.literal_value for side in shape]
        strides = [8 * math.prod(sides[place + 1:]) for place in range(len(sides))]
        kind = types.Array(number, len(sides), "C")

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            array = context.make_array(kind)(context, builder)
            data = cgutils.alloca_once(builder, context.get_value_type(number), size=math.prod(sides))
            populate_array(array, data=data, shape=[context.get_constant(types.intp, side) for side in sides],
                           strides=[context.get_constant(types.intp, stride) for stride in strides],
                           itemsize=context.get_constant(types.intp, 8), meminfo=None)
            return array._getvalue()

        return kind(shape), generate
    return intrinsic(prefer_literal=True)(typed)


room: Callable[[tuple[int, ...]], NDArray[np.float64]] = _on_stack(types.float64)
"""In compiled code: an array of this shape on the stack, full of anything, gone when the function returns. The numbers
must be written out, or be constants of the module. In a loop it is the same array every time."""

slots: Callable[[tuple[int, ...]], NDArray[np.int64]] = _on_stack(types.int64)
"""The same for whole numbers."""
