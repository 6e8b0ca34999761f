"""Estimators of the ten parameters and the one result type.

`steelyard.identify` names this room and the verb of `import steelyard as sy; sy.identify(log)` alike, so that the room
can be called: it hands the call to `steelyard.api.identify`.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class _Verb(ModuleType):
    """A package that is also a function."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        from steelyard.api import identify

        return identify(*args, **options)


sys.modules[__name__].__class__ = _Verb
