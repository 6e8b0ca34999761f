"""The real recordings: three clocks, an accelerometer of unknown mount and delay, taps in the second run."""

import numpy as np
import pytest
from made_recordings import fitted

from steelyard.io.log_files import read_recording
from steelyard.logs.alignment import align


@pytest.fixture(scope="module")
def runs(data_dir, examples_dir):
    return [align(read_recording(examples_dir / f"kuka_run{k}.toml", data=data_dir)) for k in (1, 2)]


def of(aligned, ending):
    return next(v for k, v in aligned.delays_s.items() if k.endswith(ending))


def test_accelerometer_delay_and_mount(runs):
    delays = [of(r, "accel.csv") for r in runs]
    assert all(0.0055 < d < 0.009 for d in delays)
    assert abs(delays[0] - delays[1]) < 0.0015
    expected = np.array([[0, -1.0, 0], [0, 0, 1], [-1, 0, 0]])  # its (x, y, z) are (-z, -x, +y) of S
    for run in runs:
        (mount,) = run.mounts.values()
        assert np.abs(mount.rotation.matrix - expected).max() < 0.03


def test_findings_are_the_true_ones(runs):
    codes = [{f.code for f in r.findings} for r in runs]
    assert codes[0] == {"stream-delayed", "imu-rotated", "nearly-planar"}
    assert codes[1] == codes[0] | {"outliers"}
    assert len(runs[1].left_out) == 4


def test_a_plain_fit_of_the_aligned_log_finds_the_mass(runs):
    for run in runs:
        assert fitted(run.log)[0] == pytest.approx(0.932, rel=0.01)
