import os

import numpy as np
import pytest
from hypothesis import settings

os.environ.setdefault("MUJOCO_GL", "egl")
os.environ.setdefault("HF_HUB_OFFLINE", "1")

# A first example may compile kernels, and a busy machine is no error.
settings.register_profile("no deadline", deadline=None)
settings.load_profile("no deadline")


@pytest.fixture
def rng():
    return np.random.default_rng(0)
