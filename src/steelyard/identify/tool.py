"""Take a known tool away from a load, sharing one sensor bias between the two runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import gammaincc

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding, other_than
from steelyard.identify.estimate import Estimate
from steelyard.identify.problem import BiasPrior
from steelyard.identify.sight import identified, natural_sizes
from steelyard.inertia import InertialParameters
from steelyard.inertia.people import ENTRIES

# Two runs whose biases differ with a probability below this do not share one.
SAME_BIAS = 1e-4


def bias_prior(tool: Estimate) -> BiasPrior | None:
    """Return what a tool-only run shows of the wrench bias, or None where it did not estimate one."""
    if not tool.bias_covariance.any():
        return None
    return BiasPrior(tool.wrench_bias, np.asarray(np.linalg.pinv(tool.bias_covariance, hermitian=True), np.float64))


def shares_bias(tool: Estimate, load: Estimate) -> tuple[bool, float]:
    """Return whether the biases of two separate fits agree, and the p-value (chi-square, six degrees of freedom)."""
    gap = load.wrench_bias - tool.wrench_bias
    distance = float(gap @ np.linalg.pinv(load.bias_covariance + tool.bias_covariance, hermitian=True) @ gap)
    p = float(gammaincc(3.0, distance / 2))
    return p > SAME_BIAS, p


def without_tool(load: Estimate, tool: Estimate, shared: bool) -> Estimate:
    """Return the object alone: load minus tool, with the covariance of the difference.

    `load` was fitted with the tool's bias as prior where `shared`: the tool's parameters then move with what the load
    run adds to the knowledge of the bias, phi_t(b) = phi_t + G (b - b_t), G = C_tb C_bb^-1.
    Raises CannotAnswer where what is left has no mass.
    """
    G = _gain(tool) if shared else np.zeros((10, 6))
    body = load.parameters.vector - tool.parameters.vector - G @ (load.wrench_bias - tool.wrench_bias)
    own = tool.covariance - G @ tool.cross_covariance.T
    mixed = load.cross_covariance @ G.T
    covariance = load.covariance - mixed - mixed.T + G @ load.bias_covariance @ G.T + own
    std = float(np.sqrt(max(covariance[0, 0], 0.0)))
    if body[0] <= 2 * std:
        raise CannotAnswer(
            f"After taking the tool ({tool.mass:.4g} kg) away {body[0]:.4g} kg are left, with a standard deviation of "
            f"{std:.2g} kg: no object was held, or the tool is not the one that was recorded."
        )
    message = (
        f"a tool of {tool.mass:.4g} kg was taken away from a load of {load.mass:.4g} kg; the rest is the object alone"
    )
    rest = replace(
        load,
        parameters=InertialParameters(body),
        covariance=0.5 * (covariance + covariance.T),
        notes=(*load.notes, message),
    )
    return _own(rest, load.identified, tool.identified)


def _own(rest: Estimate, of_load: Mask, of_tool: Mask) -> Estimate:
    """Return what is left with only that called identified which is so for its own size, not for that of the load."""
    fixed = of_load & of_tool & identified(rest.std, natural_sizes(rest.parameters.vector.copy()))
    lost = {
        "left open by the tool's run": of_load & ~of_tool,
        "lost in the error bars of load and tool": of_load & of_tool & ~fixed,
    }
    told = [f"{', '.join(ENTRIES[mask[4:]])} are {why}" for why, mask in lost.items() if mask[4:].any()]
    rest = replace(rest, identified=fixed)
    if not told:
        return rest
    message = f"Of the object the inertia entries {'; '.join(told)}."
    return rest.with_findings(Finding.of("inertia-not-identified", message))


def different_bias(p: float) -> Finding:
    """Return the finding that two runs do not share their bias."""
    return Finding.of(
        "bias-drift", f"The sensor's bias changed between the tool's run and this one (p = {p:.1g}); it was not shared."
    )


def of_tools_run(tool: Estimate) -> tuple[Finding, ...]:
    """Return what must be known about the tool's answer, as findings of the answer without it.

    What it left open of the inertia is not said again (`without_tool` does), nor that the tool is included.
    """
    told = other_than(tool.findings, "inertia-not-identified", "tool-included")
    return tuple(replace(finding, message=f"In the tool's run: {finding.message}") for finding in told)


def _gain(tool: Estimate) -> Array:
    return np.asarray(tool.cross_covariance @ np.linalg.pinv(tool.bias_covariance, hermitian=True))
