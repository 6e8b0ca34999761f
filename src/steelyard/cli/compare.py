"""`steelyard compare a.json b.json`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from steelyard.cli.console import print_json, tell
from steelyard.cli.options import HELP, JSON, PATH


@click.command(context_settings=HELP)
@click.argument("first", type=PATH)
@click.argument("second", type=PATH)
@click.option("--any-grasp", is_flag=True, help="Compare only mass and principal moments: the grasps may differ.")
@JSON
def compare(first: Path, second: Path, any_grasp: bool, as_json: bool) -> None:
    """Say whether two results can be the same object, held the same way."""
    from steelyard import api
    from steelyard.tables.estimate import columns

    found = api.compare(first, second, any_grasp)
    if as_json:
        print_json(asdict(found) | {"same": found.same})
        return
    verdict = "the same object" if found.same else "not the same object"
    p = f"{found.p_value:.3g}" if found.p_value > 0 else "0 to rounding"
    chi2 = f"{found.chi2:.1f}" if found.chi2 < 1e6 else f"{found.chi2:.1e}"
    tell(f"{verdict}: p = {p} (chi² {chi2}, {found.dof} degrees of freedom)")
    tell(columns([_row(*each) for each in found.compared]))


def _row(name: str, gap: float, std: float) -> tuple[str, str, str]:
    """Return what is compared, the gap with its standard deviation, and how far that is where it is far."""
    from steelyard.tables.numbers import inertia_unit, plus_minus

    inertia = inertia_unit(max(abs(gap), std))
    factor, unit = (1.0, "kg") if name == "mass" else (1e3, "mm") if name.startswith("com") else inertia
    times = abs(gap) / std
    far = "" if times <= 3 else f"{times:.0f} standard deviations" if times < 1e4 else "far beyond both bars"
    return name, plus_minus(factor * gap, factor * std, unit), far
