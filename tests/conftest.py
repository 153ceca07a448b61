import os

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

os.environ.setdefault("MUJOCO_GL", "egl")
os.environ.setdefault("HF_HUB_OFFLINE", "1")

# A first example may compile kernels, and a busy machine is no error.
settings.register_profile("no deadline", deadline=None)
# `make fuzz`: long and many plays of tests/fuzz.
settings.register_profile(
    "fuzz", deadline=None, max_examples=500, stateful_step_count=50, suppress_health_check=list(HealthCheck)
)
settings.load_profile("no deadline")


@pytest.fixture
def rng():
    return np.random.default_rng(0)
