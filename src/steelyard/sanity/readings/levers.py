"""Units that force and torque are read in, as the lever between them shows.

Of one body, a force shows by what turns where the centre of mass is, whatever unit it is in: an acceleration has its
metres from the motion. A torque over a force shows it in the length that the units are made of: millimetres, inches,
feet. What scales both alike no log shows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import REMEDIES, Finding
from steelyard.logs.recording import INCH, POUND_FORCE, STANDARD_GRAVITY, Recording
from steelyard.sanity.readings.glance import Glance
from steelyard.sanity.readings.rivals import Reading
from steelyard.sanity.readings.static_fit import StaticFit, columns, solve
from steelyard.sanity.readings.units import scaled

FOOT = 12 * INCH
# The ratio of two levers is a unit's if it is within this share of one, beside three standard deviations.
NEAR = 0.02
# No hand holds a mass this far from its sensor [m]; few hold one farther than the second. Less [kg] is no load of kN.
FURTHEST_ARM, HELD, LIGHT = 2.0, 0.3, 0.02
# A lever that is told by motion this many standard deviations and this share off is another.
SURE, SHARE = 5.0, 0.05


@dataclass(frozen=True)
class Unit:
    """A unit that is not the one said: forces so read are `ratio` times too large beside the torques.

    words          as when what is read as what
    force, torque  what to multiply both by; one each where that is not known
    remedy         what to declare
    alike          what looks the same
    """

    ratio: float
    words: str
    force: float = 1.0
    torque: float = 1.0
    remedy: str = REMEDIES["force-unit"]
    alike: str = ""

    @property
    def known(self) -> bool:
        """Whether it is known what to multiply by."""
        return self.force * self.torque != 1

    def put_right(self, recording: Recording) -> Recording:
        """Return the recording with force and torque multiplied."""
        for quantity, factor in (("force", self.force), ("torque", self.torque)):
            stream = recording.stream_of(quantity)
            if stream is not None and factor != 1:
                recording = scaled(recording, stream, quantity, factor)
        return recording

    def finding(self, why: str) -> Finding:
        """Return what is said where `why` this unit was put right."""
        if self.ratio in (1e-3, 1e3):
            return Finding.of("length-in-mm", why)
        what = {"forces": self.force, "torques": self.torque}
        done = " and ".join(f"{name} were multiplied by {by:.5g}" for name, by in what.items() if by != 1)
        return Finding("force-unit", f"{why}; {done}.{self.alike}", self.remedy)


MILLIMETRES = Unit(1e-3, "torques in N*mm are read as N*m", torque=1e-3)
KILONEWTONS = Unit(1e-3, "forces in kN are read as N", force=1e3)
CENTIMETRES = Unit(
    0.01,
    "torques in N*cm are read as N*m",
    torque=0.01,
    remedy='Multiply torques in N*cm by 0.01 and declare "N*m"; if they are in kgf*cm, by 0.01 as well, and declare '
    '"kgf*m" and, for the force, "kgf".',
    alike=" In kgf and kgf*cm they would look the same, and mass and inertia be 9.81 times larger.",
)
INCHES = Unit(
    INCH,
    "forces in lbf and torques in lbf*in are read as N and N*m",
    POUND_FORCE,
    POUND_FORCE * INCH,
    'Set unit = "lbf" in the force and unit = "lbf*in" in the torque. The inch is seen, not the pound: give units to '
    "be sure of the mass.",
)
# Torques in a small unit of length put the centre of mass far away. Feet look like positions of a tip at 70 % of the
# way to the centre of mass, and are only named.
SMALL = (MILLIMETRES, CENTIMETRES, INCHES)
UNITS = (
    Unit(POUND_FORCE, "forces in N are read as lbf"),
    Unit(1 / POUND_FORCE, "forces in lbf are read as N"),
    Unit(STANDARD_GRAVITY, "forces in N are read as kgf, or torques in kgf*m as N*m"),
    Unit(1 / STANDARD_GRAVITY, "forces in kgf are read as N, or torques in N*m as kgf*m"),
    Unit(1 / (POUND_FORCE * INCH), "torques in N*m are read as lbf*in"),
    Unit(POUND_FORCE * INCH, "torques in lbf*in are read as N*m"),
    Unit(100.0, "torques in N*m are read as N*cm"),
    Unit(
        FOOT,
        "forces in lbf and torques in lbf*ft are read as N and N*m",
        remedy='Set unit = "lbf" in the force; multiply the torques by 12 and set unit = "lbf*in". Units that are '
        "right leave positions of the tip of a tool, not of S.",
    ),
    Unit(1e3, "torques in N*m are read as N*mm", torque=1e3),
    *SMALL,
)


def units_of(ratio: float, std: float) -> list[Unit]:
    """Return the units that may make a lever by force so many times one by torque."""
    if not ratio > 0 or abs(ratio - 1) <= 5 * std:
        return []
    return [unit for unit in UNITS if abs(ratio / unit.ratio - 1) < NEAR + 3 * std / ratio]


def compared(ratio: float, std: float) -> tuple[Finding, ...]:
    """Return what the ratio of first moments by force and by torque says of each other's unit, if anything."""
    likely = units_of(ratio, std)
    if not likely:
        return ()
    words, unit = ", or when ".join(u.words for u in likely), likely[0]
    much, way = ((ratio, std), "large") if ratio > 1 else ((1 / ratio, std / ratio**2), "small")
    text = (
        f"Forces are {much[0]:.3g} ± {much[1]:.2g} times too {way} beside the torques, as when {words}. The "
        f"answer does not assume this: mass or centre of mass is wrong by as much.{unit.alike}"
    )
    return (Finding("force-unit", text, unit.remedy, left_in=True),)


def by_motion(
    recording: Recording, view: Glance, found: StaticFit, ratio: float, std: float
) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording in the units that the motion shows, and what is said of them.

    ratio, std  how many times a first moment by force is that by torque, with its standard deviation

    Where nothing measures how S is accelerated, what turns shows the centre of mass only about. Positions of a tip that
    lies at the centre of mass look like a small unit, but leave it near.
    """
    unit = next(iter(units_of(ratio, std)), None)
    if unit is None or (unit in SMALL and found.arm < HELD) or (view.acceleration is None and found.arm > FURTHEST_ARM):
        return recording, ()
    if unit is MILLIMETRES and abs(found.mass) < LIGHT:
        unit = KILONEWTONS
    if not unit.known or (view.acceleration is None and unit.ratio < 1):
        return recording, compared(ratio, std)
    times = f"{ratio:.3g} ± {std:.1g}"
    why = f"What turns shows the centre of mass {times} times as far from S as the torques do"
    if unit.ratio == 1e3:
        why += ": they are in N m, not in N mm, and were multiplied by 1000."
    elif unit is MILLIMETRES:
        why += ": the torque is in N mm; it was divided by 1000."
    else:
        why += f", as when {unit.words}"
    return unit.put_right(recording), (unit.finding(why),)


def far_away(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording in other units where the centre of mass lies metres away, and what is said of them.

    Raises CannotAnswer where several units bring it near, and the motion does not tell which.
    """
    found = reading.fit
    size, spread = float(np.linalg.norm(found.moment)), float(np.linalg.norm(found.moment_std))
    lost = not found.sign or found.arm < FURTHEST_ARM or size < 5 * spread or found.torque_share > 0.7
    if lost or recording.stream_of("force", "torque") is None:
        return recording, ()
    where = f"The centre of mass comes out {found.arm:.3g} m from the sensor, with a mass of {abs(found.mass):.3g} kg"
    if found.arm * KILONEWTONS.ratio < FURTHEST_ARM and abs(found.mass) < LIGHT:
        text = f"{where}: the force is a thousand times too small, as when kN are read as N; it was multiplied by 1000."
        return KILONEWTONS.put_right(recording), (Finding.of("force-unit", text),)
    near = [unit for unit in SMALL if found.arm * unit.ratio < HELD]
    moved = _moved(view, reading)
    likely = [unit for unit in near if moved is None or _agrees(unit, found.moment, *moved)] or near
    if not likely and found.arm * MILLIMETRES.ratio < FURTHEST_ARM:
        likely = [MILLIMETRES]
    if not likely:
        text = f"{where}: the units of force and torque do not belong together."
        return recording, (replace(Finding.of("force-unit", text), left_in=True),)
    if len(likely) > 1:
        raise CannotAnswer(_which(where, found, likely))
    (unit,) = likely
    why = "the torque is in N mm; it was divided by 1000." if unit is MILLIMETRES else f"as when {unit.words}"
    return unit.put_right(recording), (unit.finding(f"{where}: {why}"),)


def _moved(view: Glance, reading: Reading) -> tuple[Array, Array] | None:
    """Return the first moment (3,) by force in motion, with standard deviations; None where no channel tells it."""
    seen = view.seen(reading.gravity, reading.rotation)
    if view.acceleration is None or seen.lever is None:
        return None
    force, std, _ = solve(columns(seen)[1] * seen.heard(1), seen.wrench[:, 3:], view.block)
    return force[1:4], std[1:4]


def _agrees(unit: Unit, moment: Array, felt: Array, std: Array) -> bool:
    """Tell whether a first moment by torque (3,), in this unit, is that by force in motion (3,)."""
    meant = unit.ratio * moment
    return bool((np.abs(felt - meant) < SURE * std + SHARE * np.linalg.norm(meant)).all())


def _which(where: str, found: StaticFit, likely: list[Unit]) -> str:
    ways = "; ".join(
        f"if {unit.words}, it is {1e3 * unit.ratio * found.arm:.3g} mm, with {unit.force * abs(found.mass):.3g} kg"
        for unit in likely
    )
    return (
        f"{where}: force and torque are in other units than was said, and the log does not tell which: {ways}. Give "
        'the units in a description: "N*mm", or "lbf" with "lbf*in"; multiply N*cm by 0.01 to N*m, lbf*ft by 12 to '
        "lbf*in. Or record positions in brisk turns as well: they tell the unit of length."
    )
