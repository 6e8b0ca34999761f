"""The twenty families by name, and what the published tools weigh and are made of.

Source: "The Sum of Its Parts", Table II.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from steelyard.errors import BadValue
from steelyard.workshop import calipers, clamps, drivers, hammers, locking, plain, pliers, saws, wrenches
from steelyard.workshop.draw import Draw
from steelyard.workshop.graded import GRADED
from steelyard.workshop.grading import graded
from steelyard.workshop.tools import Tool

FAMILIES: Mapping[str, Callable[[Draw], Tool]] = MappingProxyType({
    "allen-key": plain.allen_key,
    "box-wrench": plain.box_wrench,
    "measuring-tape": plain.measuring_tape,
    "ruler": plain.ruler,
    "screwdriver": drivers.screwdriver,
    "nut-screwdriver": drivers.nut_screwdriver,
    "rubber-mallet": hammers.rubber_mallet,
    "bent-jaw-pliers": pliers.bent_jaw_pliers,
    "machinist-hammer": hammers.machinist_hammer,
    "pliers": pliers.pliers,
    "c-clamp": clamps.c_clamp,
    "adjustable-wrench": wrenches.adjustable_wrench,
    "hammer": hammers.hammer,
    "file": drivers.file,
    "socket-wrench": wrenches.socket_wrench,
    "hacksaw": saws.hacksaw,
    "clamp": clamps.clamp,
    "vise-grip": locking.vise_grip,
    "electronic-caliper": calipers.electronic_caliper,
    "vise-clamp": clamps.vise_clamp,
})  # fmt: skip


def require(name: str, *, graded: bool = False) -> None:
    """Raise BadValue where there is no family of this name, or no graded form of it."""
    known = GRADED if graded else FAMILIES
    if name not in known:
        raise BadValue(f"There is no {'graded ' * graded}tool '{name}'; there are: {', '.join(known)}.")


def build(name: str, seed: int | Sequence[int] | None = None) -> Tool:
    """Return a tool of the family `name`: the nominal one, or the variant of that seed.

    Raises BadValue where there is no such family.
    """
    require(name)
    return FAMILIES[name](_draw(name, seed))


def build_graded(name: str, seed: int | Sequence[int] | None = None) -> Tool:
    """Return the tool of `build` with parts that are not homogeneous, under the name graded-NAME.

    Surfaces, labels and colours are those of the even tool. Raises BadValue where the family has no graded form.
    """
    require(name, graded=True)
    own = f"graded-{name}"
    return replace(graded(build(name, seed), GRADED[name](_draw(own, seed))), name=own)


def _draw(name: str, seed: int | Sequence[int] | None) -> Draw:
    """Return where sizes and materials come from: each name has its own for a seed."""
    return Draw(None if seed is None else np.random.default_rng([*np.atleast_1d(seed), zlib.crc32(name.encode())]))
