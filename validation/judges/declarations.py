"""Findings that stand, each with its reason."""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from validation.judges.judge import Finding

FILE = Path(__file__).with_name("declared.toml")


@dataclass(frozen=True)
class Declaration:
    """A kind of finding that stands.

    Attributes:
        judge: Who finds it.
        check: In which of its checks.
        pattern: What its whole text matches.
        reason: Why it stands.
    """

    judge: str
    check: str
    pattern: str
    reason: str

    def covers(self, finding: Finding) -> bool:
        """Tell whether a finding is of this kind."""
        is_here = (finding.judge, finding.check) == (self.judge, self.check)
        return is_here and re.fullmatch(self.pattern, finding.text, flags=re.DOTALL) is not None


def read_declarations(path: Path = FILE) -> list[Declaration]:
    """Read the file of declarations."""
    return [Declaration(**entry) for entry in tomllib.loads(path.read_text(encoding="utf-8"))["finding"]]


def undeclared(findings: Sequence[Finding], declarations: Sequence[Declaration]) -> list[Finding]:
    """Return the findings that nothing covers."""
    return [finding for finding in findings if not any(each.covers(finding) for each in declarations)]


def unused(findings: Sequence[Finding], declarations: Sequence[Declaration]) -> list[Declaration]:
    """Return the declarations that cover nothing, so that none outlives its cause."""
    return [each for each in declarations if not any(map(each.covers, findings))]
