"""The one way this package compiles a kernel."""

import ast
import hashlib
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, cast

import numba
from numba.core import event

_SOURCES = Path(__file__).parents[1]


def _kernel_sources() -> list[str]:
    """Return the sources that kernels are made of: files that hold any, and what these import, near and far."""
    root = _SOURCES.parents[1]
    sources = {
        ".".join(path.relative_to(root).with_suffix("").parts): path.read_text(encoding="utf-8")
        for path in sorted(_SOURCES.rglob("*.py"))
    }
    names = [name for name, source in sources.items() if "@kernel" in source]
    for name in names:  # grows on the way
        names += [found for found in _imports(sources[name]) if found in sources and found not in names]
    return [sources[name] for name in sorted(names)]


def _imports(source: str) -> list[str]:
    """Return the names of the modules that a source may import, `from package import module` included."""
    nodes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom) and node.module]
    modules = {str(node.module) for node in nodes}
    return sorted(modules | {f"{node.module}.{alias.name}" for node in nodes for alias in node.names})


def _cache_directory() -> Path:
    """Return a directory for compiled code that belongs to exactly these kernels and this version of numba.

    Numba looks at the file of a kernel alone: after a change in another file, of a kernel that it calls or of a
    constant, it would go on with the old code. Another version of numba throws the code away, so that two environments
    with one checkout would compile at every start.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for source in _kernel_sources():
        digest.update(source.encode())
    name = f"kernels-{digest.hexdigest()[:16]}"
    beside = _SOURCES / "__pycache__"
    if os.access(beside if beside.exists() else _SOURCES, os.W_OK):
        return beside / name
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(home) / "lerobot_excav" / name


_CACHE = _cache_directory()

# Strict floating point (no reassociation) and one thread: a soil step is a pure function of its inputs. Other threads
# of Python may run meanwhile. Without Python's own error model a division by zero gives infinity, as in NumPy, and
# every other division the same bits with less code. No C function calls a kernel: without that entry there is a tenth
# less to compile.
_OPTIONS = {
    "fastmath": False,
    "parallel": False,
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
}


def kernel[F: Callable[..., Any]](function: F) -> F:
    """Compile a function to serial machine code that gives the same bits on every run.

    The compiled code is cached on disk, beside the source where that can be written, so only the first run compiles.
    Where no folder can be written, every process compiles, and says so once.
    """
    chosen = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = chosen or str(_CACHE)
    try:
        return cast(F, numba.njit(cache=True, **_OPTIONS)(function))
    except RuntimeError as error:
        if "no locator" not in str(error):
            raise
        _say_that_nothing_is_kept(numba.config.CACHE_DIR)
        return cast(F, numba.njit(**_OPTIONS)(function))
    finally:
        numba.config.CACHE_DIR = chosen


@cache
def _say_that_nothing_is_kept(folder: str) -> None:
    _say(
        f"Compiled code of the simulation cannot be kept: {folder} cannot be written. Every start compiles it again, "
        "which takes about a minute; set NUMBA_CACHE_DIR to a folder that can be written."
    )


def _say(words: str) -> None:
    """Write a line to stderr at once: what follows takes long."""
    sys.stderr.write(f"{words}\n")
    sys.stderr.flush()


class _Announcement(event.Listener):  # type: ignore[misc]  # numba is untyped here
    """Says what happens when a kernel is compiled for the first time."""

    def __init__(self) -> None:
        self.is_made = False

    def on_start(self, event: Any) -> None:
        if not self.is_made:
            self.is_made = True
            _say("Compiling the simulation: about a minute, this once ...")

    def on_end(self, event: Any) -> None:
        """Stay quiet: hundreds of functions are compiled."""


@contextmanager
def announced() -> Iterator[None]:
    """Tell on stderr if something is compiled inside, and when that is over; code from the cache needs no words."""
    announcement, start = _Announcement(), time.perf_counter()
    with event.install_listener("numba:compile", announcement):
        yield
    if announcement.is_made:
        _say(f"Compiled in {time.perf_counter() - start:.0f} s.")
