"""Hypothesis strategies: rotations of every regime, poses, six-vectors and bodies."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from steelyard.inertia import InertialParameters
from steelyard.spatial import Acceleration, Pose, Rotation, Twist, Wrench

BATCHES = [(), (1,), (3, 1, 2, 1)]


def numbers(shape: tuple[int, ...], size: float = 1.0) -> st.SearchStrategy[np.ndarray]:
    """Arrays of finite numbers within +-size."""
    return arrays(np.float64, shape, elements=st.floats(-size, size, allow_subnormal=False))


def angles() -> st.SearchStrategy[float]:
    """Angles from the whole range, from within 1e-7 of zero, and from just below pi."""
    return st.one_of(
        st.floats(0.0, np.pi),
        st.floats(0.0, 1e-7),
        st.floats(np.pi - 1e-3, np.pi),
        st.floats(np.pi - 1e-7, np.pi),
    )


@st.composite
def rotation_vectors(draw: st.DrawFn, batch: tuple[int, ...] = ()) -> np.ndarray:
    """Rotation vectors (*batch, 3) of length 0 to pi, each from its own regime."""
    direction = draw(numbers((*batch, 3)))
    norm = np.linalg.norm(direction, axis=-1, keepdims=True)
    unit = np.where(norm < 1e-3, [1.0, 0.0, 0.0], direction / np.where(norm < 1e-3, 1.0, norm))
    return draw(arrays(np.float64, batch, elements=angles()))[..., None] * unit


def rotations(batch: tuple[int, ...] = ()) -> st.SearchStrategy[Rotation]:
    return rotation_vectors(batch).map(Rotation.exp)


def poses(batch: tuple[int, ...] = ()) -> st.SearchStrategy[Pose]:
    return st.builds(Pose, rotations(batch), numbers((*batch, 3)))


def twists(batch: tuple[int, ...] = ()) -> st.SearchStrategy[Twist]:
    return numbers((*batch, 6), 3.0).map(Twist.from_array)


def wrenches(batch: tuple[int, ...] = ()) -> st.SearchStrategy[Wrench]:
    return numbers((*batch, 6), 20.0).map(Wrench.from_array)


def accelerations(batch: tuple[int, ...] = ()) -> st.SearchStrategy[Acceleration]:
    return numbers((*batch, 6), 10.0).map(Acceleration.from_array)


def log_choleskys(batch: tuple[int, ...] = ()) -> st.SearchStrategy[np.ndarray]:
    """Log-Cholesky coordinates of bodies of about 0.02 to 7 kg and 1 to 30 cm."""
    middle = np.array([0, -2.5, -2.5, -2.5, 0, 0, 0, 0, 0, 0])
    spread = np.array([2, 1, 1, 1, 0.05, 0.05, 0.05, 0.3, 0.3, 0.3])
    return numbers((*batch, 10)).map(lambda unit: middle + spread * unit)


def bodies(batch: tuple[int, ...] = ()) -> st.SearchStrategy[InertialParameters]:
    """Physically consistent bodies away from the boundary."""
    return log_choleskys(batch).map(InertialParameters.from_log_cholesky)
