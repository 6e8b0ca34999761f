"""`steelyard doctor`."""

from __future__ import annotations

import platform
import sys
from importlib import metadata

import click

from steelyard import __version__
from steelyard.cli.console import print_json, say_if_compiling, tell
from steelyard.cli.options import HELP, JSON
from steelyard.errors import CannotAnswer

CORE = ("numpy", "scipy", "numba", "click", "manifold3d")
EXTRAS = {
    "pillow": "images", "pyarrow": "parquet", "rosbags": "bags", "pin": "peers", "rigeo": "peers",
    "pytetwild": "tetwild", "tetgen": "tetgen",
}  # fmt: skip
# A noise-free log must give the answer to rounding; the weak prior alone moves it by less than this share.
TOLERANCE = 1e-4


@click.command(context_settings=HELP)
@JSON
def doctor(as_json: bool) -> None:
    """Show versions and what is installed, and identify a made body whose answer is known."""
    say_if_compiling()
    versions = {name: _version(name) for name in (*CORE, *EXTRAS)}
    error, seconds = _known_answer()
    healthy = error < TOLERANCE
    if as_json:
        print_json(
            {
                "steelyard": __version__, "python": platform.python_version(), "packages": versions,
                "mass_error": error, "seconds": seconds, "healthy": healthy,
            }
        )  # fmt: skip
    else:
        tell(f"steelyard {__version__}, Python {platform.python_version()} on {platform.system()} {platform.machine()}")
        for name in CORE:
            tell(f"  {name:10s} {versions[name]}")
        for name, extra in EXTRAS.items():
            tell(f"  {name:10s} {versions[name] or f'not installed (optional: {extra})'}")
        missing = sorted({extra for name, extra in EXTRAS.items() if versions[name] is None})
        if missing:
            extra = missing[0]
            tell(f"  to add one: {sys.executable} -m pip install 'steelyard[{extra}]' (in a clone '.[{extra}]')")
        tell(f"  identification of a known body: worst error {error:.1e} of its size in {seconds:.2f} s")
    if not healthy:
        raise CannotAnswer(
            f"The known body came out wrong by {error:.2g} of its size: this installation cannot be trusted."
        )


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _known_answer() -> tuple[float, float]:
    """Return the worst relative error in mass and first moment on a noise-free log, and the wall time [s]."""
    import time

    import numpy as np

    from steelyard.identify.noise_aware import NoiseAware
    from steelyard.simulate.logs import simulate_log

    start = time.perf_counter()
    log, true = simulate_log("hammer", "stop_go", "none", 0)
    found = NoiseAware().identify(log).parameters
    error = np.abs(found.vector[:4] - true.vector[:4]).max() / float(true.mass)
    return float(error), time.perf_counter() - start
