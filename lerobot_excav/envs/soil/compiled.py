"""The one way this package compiles a kernel."""

import ast
import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numba

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


def kernel[F: Callable[..., Any]](function: F) -> F:
    """Compile a function to serial machine code that gives the same bits on every run.

    Strict floating point (no reassociation) and one thread: a soil step is a pure function of its inputs.
    The compiled code is cached on disk, beside the source where that can be written, so only the first run compiles.
    """
    chosen = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = chosen or str(_CACHE)
    try:
        return cast(
            F, numba.njit(cache=True, fastmath=False, parallel=False, nogil=True, error_model="numpy")(function)
        )
    finally:
        numba.config.CACHE_DIR = chosen
