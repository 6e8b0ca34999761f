"""Draw the README's figure from a bench result: steelyard bench identify --json > bench.json, then this file on it.

Needs matplotlib: pip install 'steelyard[plot]'.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import matplotlib.ticker

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
    """Draw median errors of every method on logarithmic scales, one row per case."""
    median = json.loads(source.read_text())["median"]
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(len(CASES), len(KEYS), figsize=(10, 4.8), layout="constrained")
    for row, (motion, noise) in enumerate(CASES):
        for column, (key, label) in enumerate(KEYS):
            panel(axes[row][column], median[motion][noise], key)
            axes[row][column].set_title(label if row == 0 else "", fontweight="bold")
        axes[row][0].set_ylabel(TITLES[row].replace(", ", ",\n"), rotation=0, ha="right", va="center")
    handles = [plt.Line2D([], [], marker="o", linestyle="", markersize=8, color=colour) for _, _, colour in METHODS]
    figure.legend(handles, [name for _, name, _ in METHODS], loc="outside lower center", ncols=5, frameon=False)
    figure.savefig(Path(__file__).parent / "accuracy.png", dpi=110)


def panel(axes: plt.Axes, methods: dict[str, dict[str, float]], key: str) -> None:
    """Draw one dot per method on a logarithmic axis, its number beside it: bars would have no honest zero."""
    shown = [(name, colour) for name, _, colour in METHODS if name in methods]
    values = [methods[name][key] for name, _ in shown]
    axes.set_xscale("log")
    axes.set_xlim(min(values) / 1.6, max(values) * 2.5)
    axes.set_ylim(len(values) - 0.3, -0.7)
    axes.hlines(range(len(values)), *axes.get_xlim(), color="#ececec", linewidth=1, zorder=0)
    axes.scatter(values, range(len(values)), s=[90, *[55] * (len(values) - 1)], color=[c for _, c in shown], zorder=2)
    for place, value in enumerate(values):
        text = f"{value:.0f}" if value >= 20 else f"{value:.2g}"
        axes.annotate(
            text, (value, place), xytext=(9, 0), textcoords="offset points", va="center", color="#222222",
            fontsize=9, fontweight="bold" if place == 0 else "normal", zorder=3,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
        )  # fmt: skip
    axes.xaxis.set_minor_locator(mpl.ticker.NullLocator())
    axes.set_xticks([])
    axes.set_yticks([])
    for side in axes.spines.values():
        side.set_visible(False)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
