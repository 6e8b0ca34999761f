"""What the data had to say beside the answer: Evidence of the fit, and the masses of parts."""

from __future__ import annotations

from dataclasses import dataclass

from steelyard.check import Array


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the data had to say.

    rank, condition     of the column-scaled regressor with the bias columns projected out
    samples, still_samples   rows used, and those at rest
    residual_force_N, residual_torque_Nm   rms per axis
    chi2_per_dof        1 when the noise model fits; None without one
    holdout_force_N, holdout_torque_Nm     rms error of predicting poses left out of the fit
    spread              (10,) how far each parameter could move at equal fit: two standard deviations of the data alone
    jackknife           (10,) leave-one-pose-out (or block) standard deviation of the parameters; None where too few
    jackknife_people    (10,) the same for mass, com, inertia about the CoM
    blocks              how many poses or blocks were left out in turn
    """

    rank: int
    condition: float
    samples: int
    still_samples: int
    residual_force_N: float
    residual_torque_Nm: float
    chi2_per_dof: float | None = None
    holdout_force_N: float | None = None
    holdout_torque_Nm: float | None = None
    spread: Array | None = None
    jackknife: Array | None = None
    jackknife_people: Array | None = None
    blocks: int = 0


@dataclass(frozen=True, eq=False)
class PartMass:
    """Mass [kg] with standard deviation of one homogeneous part; volume [m^3] and centroid (3,) [m] are given."""

    label: int
    mass: float
    std: float
    volume: float
    centroid: Array
    material: str | None = None

    @property
    def density(self) -> float:
        """Density [kg/m^3]."""
        return self.mass / self.volume
