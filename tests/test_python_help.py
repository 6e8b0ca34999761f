"""`help(sy.identify)` shows the verb, though a package has the same name."""

from __future__ import annotations

import inspect
import pydoc

import steelyard as sy
from steelyard import api


def test_help_shows_the_function_before_and_after_its_room_is_loaded() -> None:
    for _ in range(2):
        shown = pydoc.plain(pydoc.render_doc(sy.identify))
        assert "Return mass, centre of mass and inertia of what the robot holds" in shown
        assert "scan     what was seen of the object instead" in shown
        assert inspect.signature(sy.identify) == inspect.signature(api.identify)
    assert "room" not in shown.split("PACKAGE CONTENTS")[0]


def test_every_name_is_there() -> None:
    for name in sy.__all__:
        assert getattr(sy, name) is not None
