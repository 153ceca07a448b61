"""How a metrics file came about, in a JSON file of its name: command, code, versions and time."""

import json
import logging
import shlex
import subprocess
import sys
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import lerobot_excav
from lerobot_excav.whole_file import write_whole

logger = logging.getLogger(__name__)

PACKAGES = ("lerobot_env_excav", "lerobot", "mujoco", "torch", "numpy")

_STARTED = datetime.now(UTC)
_PACKAGE = Path(lerobot_excav.__file__).parent


def write_provenance(path: Path) -> None:
    """Write `X.json` beside a metrics file `X.jsonl`; call it whenever the file has grown.

    It holds `command`, `commit` and whether the package was `modified` since, `packages`, when the process `started`
    (UTC) and for how many `seconds` it has run, and the folder of the `policy` that the command names. A file of that
    name that holds something else is kept. Whatever goes wrong is logged only: no evaluation fails for its record.
    """
    record_path = path.with_suffix(".json")
    try:
        if record_path.exists() and not _is_record(record_path):
            raise ValueError(f"it holds something else; choose another name than {path.name}")
        write_whole(record_path, json.dumps(_record(), indent=1) + "\n")
    except (OSError, ValueError) as error:
        logger.warning(f"{record_path} is not written: {error}")


def _is_record(path: Path) -> bool:
    """Return whether a file holds a record of this module."""
    known = json.loads(path.read_text(encoding="utf-8"))
    return isinstance(known, dict) and known.keys() >= {"command", "commit", "modified", "packages", "started"}


def _record() -> dict[str, Any]:
    commit, modified = code_version()
    return {
        "command": shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        "commit": commit,
        "modified": modified,
        "packages": package_versions(),
        "started": _STARTED.isoformat(timespec="seconds"),
        "seconds": round((datetime.now(UTC) - _STARTED).total_seconds(), 1),
        "policy": _policy(),
    }


def _policy() -> str | None:
    """Return the checkpoint that the command names, without links: the checkpoint `last` is another one later."""
    for argument in sys.argv:
        name, _, value = argument.partition("=")
        if name == "--policy.path" and Path(value).is_dir():
            return str(Path(value).resolve())
    return None


@cache
def package_versions() -> dict[str, str]:
    """Return the installed versions by distribution."""
    found = {}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


@cache
def code_version() -> tuple[str | None, bool]:
    """Return the commit of the package's checkout, and whether the package differs from it; None outside of one."""
    if not _git("ls-files", "--error-unmatch", "__init__.py"):
        return None, False  # installed, perhaps within the repository of something else
    return _git("rev-parse", "HEAD") or None, bool(_git("status", "--porcelain", "--", "."))


def _git(*arguments: str) -> str:
    """Return git's answer; an empty one where there is no git, or no repository."""
    try:
        done = subprocess.run(
            ["git", *arguments], cwd=_PACKAGE, capture_output=True, encoding="utf-8", errors="replace", check=False
        )
    except OSError:
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
