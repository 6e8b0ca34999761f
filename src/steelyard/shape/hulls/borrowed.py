"""Arrays that a compiled function only borrows, and whole numbers of one type.

Counting who holds an array takes a third of the time of a hull of a dozen points.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba.extending import intrinsic


def _borrowed(typing_context: Any, array: Any) -> Any:
    """Return the same array without an owner, inside a compiled function whose caller holds it to the end.

    Compiled functions count references with locked instructions, at every call and for every array.
    """

    def same_data(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        view = context.make_array(signature.args[0])(context, builder, args[0])
        view.meminfo = ir.Constant(view.meminfo.type, None)
        return view._getvalue()

    return array(array), same_data


borrowed: Any = intrinsic(_borrowed)
# Makes whole numbers of one type of small ones and plain constants: for each type a function is compiled again.
integer: Any = np.int64
