"""Draw the README's figure from a bench result: steelyard bench identify --json > bench.json, then this file bench.json.

Needs matplotlib: pip install 'steelyard[plot]'.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt

CASES = (("stop_go", "moderate"), ("stop_go", "high"), ("dyn_slow", "high"))
TITLES = ("stop-and-go, moderate noise", "stop-and-go, high noise", "slow motion, high noise")
KEYS = (("mass_pct", "mass error, %"), ("com_mm", "centre of mass error, mm"), ("inertia_pct", "inertia error, %"))
METHODS = (
    ("noise-aware", "Steelyard noise-aware", "#0b6e4f"),
    ("rigeo-entropic", "rigeo SDP + prior", "#c9a227"),
    ("rigeo-psd", "rigeo SDP", "#d08c60"),
    ("pinocchio-log-cholesky", "Pinocchio log-Cholesky", "#7a89c2"),
    ("pinocchio-ols", "Pinocchio least squares", "#b0b0b0"),
)


def main(source: Path) -> None:
    """Draw median errors of every method as bars on a logarithmic scale, one row per case."""
    median = json.loads(source.read_text())["median"]
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "steelyard"})
    figure, axes = plt.subplots(len(CASES), len(KEYS), figsize=(10, 5.6), layout="constrained")
    for row, (motion, noise) in enumerate(CASES):
        for column, (key, label) in enumerate(KEYS):
            panel(axes[row][column], median[motion][noise], key)
            axes[row][column].set_title(label if row == 0 else "", fontweight="bold")
        axes[row][0].set_ylabel(TITLES[row].replace(", ", ",\n"), rotation=0, ha="right", va="center")
    handles = [plt.Rectangle((0, 0), 1, 1, color=colour) for _, _, colour in METHODS]
    figure.legend(handles, [name for _, name, _ in METHODS], loc="outside lower center", ncols=5, frameon=False)
    for suffix in ("svg", "png"):
        figure.savefig(source.parent / f"accuracy.{suffix}", metadata={"Date": None} if suffix == "svg" else None, dpi=150)


def panel(axes: plt.Axes, methods: dict[str, dict[str, float]], key: str) -> None:
    """Draw one bar per method with its number at the end."""
    shown = [(name, colour) for name, _, colour in METHODS if name in methods]
    values = [methods[name][key] for name, _ in shown]
    axes.barh(range(len(shown)), values, color=[colour for _, colour in shown], height=0.75)
    axes.set_xscale("log")
    axes.set_xlim(min(values) / 2, max(values) * 6)
    axes.invert_yaxis()
    axes.set_yticks([])
    for place, value in enumerate(values):
        axes.text(value * 1.12, place, f"{value:.2g}", va="center", fontsize=8, color="#333333")
    axes.tick_params(axis="x", which="both", labelsize=7, colors="#777777")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
