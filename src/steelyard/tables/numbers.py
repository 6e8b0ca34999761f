"""Numbers as people read them: two figures of the standard deviation, a true minus sign, units that suit the size."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.evidence import PartMass
from steelyard.inertia import forms
from steelyard.spatial import Rotation
from steelyard.tables.shown import Weighed

_LARGE_INERTIA = 0.1  # [kg m^2] from here on it is given in kg m²
_MILLIONTH = 1e-6


def decimals(std: float) -> int:
    """Return how many decimals show two figures of a standard deviation."""
    if not std > 0:
        return 3
    rounded = float(f"{std:.1e}")  # 0.0999 is shown as 0.10, not as 0.100
    return int(np.clip(1 - np.floor(np.log10(rounded)), 0, 9))


def round_step(top: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above `top`."""
    power = 10.0 ** np.floor(np.log10(top))
    return float(power * max(step for step in (1, 2, 5) if step * power <= top))


def fixed(value: float, places: int) -> str:
    """Return a number with a true minus sign."""
    if not np.isfinite(value):
        return "?"
    # Adding zero turns a minus zero, which rounding leaves, into a plain one.
    return f"{round(float(value), places) + 0.0:.{places}f}".replace("-", "−")


def general(value: float | None, figures: int = 3) -> str:
    """Return a number with so many figures, never in powers of ten below a million; "–" for None."""
    if value is None or not np.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    places = int(np.clip(figures - 1 - np.floor(np.log10(abs(value))), 0, 12))
    return f"{value:.{figures}g}".replace("-", "−") if abs(value) >= 1e6 or abs(value) < 1e-5 else fixed(value, places)


def places_of(value: float, std: float) -> int:
    """Return how many decimals of a value are shown, and so of the truth beside it; std 0 is a value given as exact."""
    return decimals(std) if std > 0 else min(decimals(abs(value) / 1e3), 4) if value else 3


def spread(std: float) -> str:
    """Return two figures of a standard deviation, in powers of ten below a millionth."""
    if 0 < std < _MILLIONTH:
        return f"{std:.1e}".replace("-", "−")
    return fixed(std, decimals(std))


def density(part: PartMass) -> str:
    """Return the density of a part [kg/m³] as a whole number, rounded to two figures of its standard deviation."""
    std = part.std / part.volume
    places = min(1 - int(np.floor(np.log10(std))), 0) if 0 < std < np.inf else 0
    return f"{round(part.density, places):.0f}"


def bias(estimate: Weighed) -> tuple[str, str]:
    """Return the sensor's bias, torque [N m] and force [N], each entry with two figures of its standard deviation."""
    stds = np.sqrt(np.diagonal(estimate.bias_covariance))
    pairs = zip(estimate.wrench_bias.tolist(), stds.tolist(), strict=True)
    shown = [fixed(value, places_of(value, std)) for value, std in pairs]
    return f"({', '.join(shown[:3])})", f"({', '.join(shown[3:])})"


def mass_unit(mass: float) -> tuple[float, str]:
    """Return factor and unit for a mass [kg]: grams below one kilogram."""
    return (1e3, "g") if abs(mass) < 1 else (1.0, "kg")


def inertia_unit(moment: float) -> tuple[float, str]:
    """Return factor and unit for a moment of inertia [kg m^2]."""
    return (1e6, "kg mm²") if abs(moment) < _LARGE_INERTIA else (1.0, "kg m²")


def largest_inertia(estimate: Weighed) -> float:
    """Return the largest entry [kg m^2] of the inertia about the centre of mass that the data fix; 0 without any."""
    told = estimate.parameters.people[4:][np.asarray(estimate.identified[4:])]
    return float(np.abs(told).max(initial=0.0))


def rpy_deg(rotation: Rotation) -> Array:
    """Return roll, pitch, yaw (3,) [deg] of one rotation: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    return np.rad2deg(rotation.rpy())


def plus_minus(value: float, std: float, unit: str) -> str:
    """Return 'value ± std unit' with two figures of the standard deviation; of an exact value there is no ±."""
    if not np.isfinite(std):
        return f"{value:.4g} ± ? {unit}"
    bar = f" ± {spread(std)}" if std > 0 else ""
    return plain(f"{fixed(value, places_of(value, std))}{bar} {unit}")


def plain(text: str) -> str:
    """Return a text with the minus of keyboards: what a terminal shows is searched and pasted."""
    return text.replace("−", "-")


def principal(estimate: Weighed) -> tuple[Array, Array, Array]:
    """Return principal moments (3,) rising [kg m^2], their standard deviations (3,), and the axes (3, 3) as columns."""
    moments, pose = estimate.parameters.principal()
    axes = pose.rotation.matrix
    slope = forms.principal_slopes(axes)
    variance = np.einsum("ai,ij,aj->a", slope, estimate.people_covariance[4:, 4:], slope)
    return moments, np.sqrt(np.maximum(variance, 0)), axes
