"""What an audit comes to, by stated thresholds."""

from dataclasses import dataclass

from lerobot_excav.evaluation.audit.obedience import Obedience

OBEYS, PARTLY, INSENSITIVE, OUT_OF_SUPPORT, UNDECIDED = VERDICTS = (
    "obeys",
    "obeys in part",
    "insensitive",
    "out of support",
    "undecided",
)

LEAST_ACTED = 0.5
"""A policy that acts after fewer of the masks is out of support (kind: guess)."""
FIRM_SLOPE = 0.8
"""Least slope of a policy that obeys (kind: design); its interval has to lie above `PARTLY_SLOPE[1]`."""
PARTLY_SLOPE = (0.2, 0.7)
"""A slope whose interval lies below the first is none; one whose interval lies between both is obedience in part
(kind: guess)."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """A verdict and why.

    Attributes:
        verdict: One of `VERDICTS`.
        reason: The figures and thresholds that led to it, as a sentence.
    """

    verdict: str
    reason: str


def judge(found: Obedience) -> Verdict:
    """Judge by whether the machine acts at all, then by the interval of the slope."""
    if found.acted.estimate < LEAST_ACTED:
        acted = 100.0 * found.acted.estimate
        return Verdict(
            verdict=OUT_OF_SUPPORT,
            reason=f"the machine acts after {acted:.0f} % of the masks only (less than {100.0 * LEAST_ACTED:.0f} %)",
        )
    if found.slope is None:
        return Verdict(verdict=UNDECIDED, reason="no scene has two masks after which the machine acts")
    low, high, slope = found.slope.low, found.slope.high, found.slope.estimate
    shown = f"the slope of {slope:.2f} [{low:.2f}, {high:.2f}]"
    if slope >= FIRM_SLOPE and low > PARTLY_SLOPE[1]:
        return Verdict(verdict=OBEYS, reason=f"{shown} is at least {FIRM_SLOPE}, its interval above {PARTLY_SLOPE[1]}")
    if high < PARTLY_SLOPE[0]:
        return Verdict(verdict=INSENSITIVE, reason=f"{shown} has its interval below {PARTLY_SLOPE[0]}")
    if low > PARTLY_SLOPE[0] and high < FIRM_SLOPE:
        return Verdict(verdict=PARTLY, reason=f"{shown} has its interval between {PARTLY_SLOPE[0]} and {FIRM_SLOPE}")
    return Verdict(verdict=UNDECIDED, reason=f"{shown} has an interval that allows for more than one verdict")
