"""The file in which a study keeps what was played, line by line, so that an interrupted one goes on."""

import json
from pathlib import Path
from typing import Any

from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.whole_file import write_whole


def read_finished(path: Path) -> list[dict[str, Any]]:
    """Return the finished plays of the present simulation, of a file that may not exist yet."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
    if lines and not lines[-1].endswith("\n"):  # an interruption cut it short: that one is played again
        write_whole(path, "".join(lines[:-1]))
        lines.pop()
    plays = [json.loads(line) for line in lines]
    return [play for play in plays if play["simulation_version"] == SCOOP.simulation_version]
