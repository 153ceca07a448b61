import importlib
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from lerobot_excav.envs.soil import compiled

CALLER = """
from lerobot_excav.envs.soil.compiled import kernel
from digest_probe.envs.callee import inner
from digest_probe.envs import numbers

OFFSET = numbers.OFFSET

@kernel
def outer(x):
    return 2.0 * inner(x) + OFFSET
"""
CALLEE = """
from lerobot_excav.envs.soil.compiled import kernel

@kernel
def inner(x):
    return x + {added}
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A kernel of one file calls one of another file and uses a constant that a third file has from a fourth."""
    envs = tmp_path / "digest_probe" / "envs"
    envs.mkdir(parents=True)
    (envs / "caller.py").write_text(CALLER)
    (envs / "callee.py").write_text(CALLEE.format(added=1.0))
    (envs / "numbers.py").write_text("from digest_probe.envs.shared import OFFSET\n")
    (envs / "shared.py").write_text("OFFSET = 0.0\n")
    (envs / "notes.py").write_text("NOTHING = 0\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(compiled, "_SOURCES", envs)
    monkeypatch.setattr(compiled.numba.config, "CACHE_DIR", "")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    return envs


def result(monkeypatch):
    """Import the package as a new process would, and call its kernel."""
    for name in [name for name in sys.modules if name.split(".")[0] == "digest_probe"]:
        del sys.modules[name]
    importlib.invalidate_caches()
    monkeypatch.setattr(compiled, "_CACHE", compiled._cache_directory())
    caller = importlib.import_module("digest_probe.envs.caller")
    return float(caller.outer(1.0))


def rewrite(path, text):
    """Change a file so that Python, too, sees it: bytecode is kept by size and whole seconds."""
    path.write_text(text)
    later = path.stat().st_mtime + 10.0
    os.utime(path, (later, later))


def test_a_change_of_a_called_kernel_or_a_constant_in_another_file_is_seen(package, monkeypatch):
    assert result(monkeypatch) == 4.0
    rewrite(package / "callee.py", CALLEE.format(added=5.0))
    assert result(monkeypatch) == 12.0
    rewrite(package / "shared.py", "OFFSET = 0.5\n")
    assert result(monkeypatch) == 12.5


def test_compiled_code_is_kept_beside_the_sources_under_their_digest(package, monkeypatch):
    result(monkeypatch)
    first = compiled._cache_directory()
    assert first.parent == package / "__pycache__"
    assert list(first.rglob("*.nbi"))
    rewrite(package / "notes.py", "NOTHING = 1\n")  # no kernel knows it
    assert compiled._cache_directory() == first
    rewrite(package / "callee.py", CALLEE.format(added=7.0))
    assert compiled._cache_directory() != first


def test_two_versions_of_numba_do_not_share_a_directory(package, monkeypatch):
    # Each would throw the code of the other away and compile at every start.
    first = compiled._cache_directory()
    monkeypatch.setattr(compiled.numba, "__version__", "0.0.0")
    assert compiled._cache_directory() != first


def test_the_shared_constants_belong_to_the_kernels():
    assert any("GRAVITY_M_S2 = " in source for source in compiled._kernel_sources())


def test_where_sources_cannot_be_written_the_user_cache_is_used(package, monkeypatch, tmp_path):
    monkeypatch.setattr(compiled.os, "access", lambda *_: False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert compiled._cache_directory().parent == tmp_path / "cache" / "lerobot_excav"


def test_a_cache_directory_that_was_chosen_is_left_alone(package, monkeypatch, tmp_path):
    chosen = str(tmp_path / "chosen")
    monkeypatch.setattr(compiled.numba.config, "CACHE_DIR", chosen)
    result(monkeypatch)
    assert compiled.numba.config.CACHE_DIR is chosen
    assert list(Path(chosen).rglob("*.nbi"))


PROBE = """
from lerobot_excav.envs.soil.compiled import kernel

@kernel
def added(x):
    return x + 1.0

@kernel
def twice(x):
    return 2.0 * x

print(added(1.0), twice(1.0))
"""


def test_where_nothing_can_be_written_code_is_compiled_anyway_and_it_is_said_once(tmp_path):
    """A folder that holds a file in place of `__pycache__` cannot keep code, whoever the user is."""
    shutil.copytree(
        Path(compiled.__file__).parents[2], tmp_path / "lerobot_excav", ignore=shutil.ignore_patterns("__pycache__")
    )
    (tmp_path / "probe.py").write_text(PROBE)
    for folder in [tmp_path, *(path for path in tmp_path.rglob("*") if path.is_dir())]:
        (folder / "__pycache__").write_text("")
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null/cache", "IPYTHONDIR": "/dev/null"}
    environment = {**os.environ, **nowhere, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, str(tmp_path / "probe.py")]
    done = subprocess.run(command, env=environment, text=True, capture_output=True, check=False)
    assert (done.returncode, done.stdout) == (0, "2.0 2.0\n"), done.stderr
    assert done.stderr.count("cannot be kept") == 1
    assert "set NUMBA_CACHE_DIR to a folder that can be written" in done.stderr


def test_kernels_let_other_threads_run():
    """The kernel sees a flag that another thread raises while it runs; if it held the interpreter, none could."""

    @compiled.kernel
    def waits_for(flag, turns, most):
        while turns[0] < most:
            turns[0] += 1
            np.random.random()  # noqa: NPY002 - it keeps its state in memory, so the compiler cannot read the flag only once
            if flag[0] > 0:
                return True
        return False

    flag, turns = np.zeros(1, np.int64), np.zeros(1, np.int64)
    waits_for(flag, turns, 1)
    with ThreadPoolExecutor(1) as pool:
        seen = pool.submit(waits_for, flag, turns, 3 * 10**9)  # half a minute: long enough for the busiest machine
        while turns[0] < 2:
            time.sleep(0.001)
        flag[0] = 1
        assert seen.result()
