"""Estimators of the ten parameters and the one result type.

`steelyard.identify` names this room and the verb of `import steelyard as sy; sy.identify(log)` alike, so that the room
can be called: it hands the call to `steelyard.api.identify`, and `help` and `inspect.signature` show that function.
"""

from __future__ import annotations

import inspect
import sys
from types import ModuleType
from typing import Any


class _Verb(ModuleType):
    """A package that is also a function."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        from steelyard.api import identify

        return identify(*args, **options)

    @property
    def __signature__(self) -> inspect.Signature:
        from steelyard.api import identify

        return inspect.signature(identify)

    @property
    def __doc__(self) -> str:  # type: ignore[override]
        from steelyard.api import identify

        first, _, rest = inspect.getdoc(identify).partition("\n")  # type: ignore[union-attr]
        return f"{first}\n\nidentify({', '.join(self.__signature__.parameters)})\n{rest}"


sys.modules[__name__].__class__ = _Verb
