"""The one way this package compiles a kernel."""

from collections.abc import Callable
from typing import Any, cast

from numba import njit


def kernel[F: Callable[..., Any]](function: F) -> F:
    """Compile a function to serial machine code that gives the same bits on every run.

    Strict floating point (no reassociation) and one thread: a soil step is a pure function of its inputs.
    The compiled code is cached on disk beside the source, so only the first run of a machine compiles.
    """
    return cast(F, njit(cache=True, fastmath=False, parallel=False)(function))
