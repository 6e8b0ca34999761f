"""Kernels are handed one kind of array, and so compiled once: the first identification waits for each of them."""

from __future__ import annotations

import json
import subprocess
import sys

SCRIPT = """
import json, sys
from numba.core.dispatcher import Dispatcher
import steelyard as sy
from steelyard.simulate import hammer

recording = hammer.recording(0).recording
before = {id(k) for m in list(sys.modules.values()) for k in list(vars(m).values())
          if isinstance(k, Dispatcher) and k.signatures}
sy.identify(recording)
kernels = {id(k): k for name, m in list(sys.modules.items()) if name.startswith("steelyard")
           for k in list(vars(m).values()) if isinstance(k, Dispatcher) and id(k) not in before}
print(json.dumps({k.__name__: len(k.signatures) for k in kernels.values() if k.signatures}))
"""


def test_an_identification_compiles_each_kernel_for_one_kind_of_array():
    # In a process of its own: other tests hand kernels other arrays.
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    signatures = json.loads(done.stdout)
    assert len(signatures) > 20
    assert {name: count for name, count in signatures.items() if count > 1} == {}
