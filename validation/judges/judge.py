"""Run the judges, each in a virtual environment of its own, and read what they find."""

import json
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple


class Finding(NamedTuple):
    """Something that a judge does not like."""

    judge: str
    check: str
    text: str


def lerobot_doctor(programs: Path, dataset: Path) -> list[Finding]:
    """Run `lerobot-doctor --ci --fail-on=warn`; every warning and failure is a finding.

    Raises:
        RuntimeError: It ended without a verdict.
    """
    command = [str(programs / "lerobot-doctor"), str(dataset), "--ci", "--fail-on=warn"]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    start = done.stdout.find("{")
    if start < 0:
        raise RuntimeError(f"lerobot-doctor says nothing about {dataset}: {done.stderr[-500:]}")
    report, _ = json.JSONDecoder().raw_decode(done.stdout[start:])
    return [
        Finding("lerobot-doctor", check["name"], message["message"])
        for check in report["checks"]
        for message in check["messages"]
        if message["severity"] != "PASS"
    ]


def robovet(programs: Path, dataset: Path) -> list[Finding]:
    """Run `robovet doctor`; every warning and failure is a finding, its details in it.

    Raises:
        RuntimeError: It ended without a verdict.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "report.json"
        command = [str(programs / "robovet"), "doctor", str(dataset), "--json", str(path)]
        done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
        if not path.exists():
            raise RuntimeError(f"robovet says nothing about {dataset}: {(done.stdout + done.stderr)[-500:]}")
        report = json.loads(path.read_text(encoding="utf-8"))
    return [
        Finding("robovet", result["check_id"], "\n".join([result["summary"], *result["details"]]))
        for result in report["results"]
        if result["severity"] not in ("PASS", "INFO", "SKIP")
    ]


JUDGES: dict[str, Callable[[Path, Path], list[Finding]]] = {"lerobot-doctor": lerobot_doctor, "robovet": robovet}
