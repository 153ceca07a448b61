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
LEAST_SCENES = 5
"""Below that nothing is decided (kind: guess)."""
OBEDIENT_SLOPE = (0.8, 1.25)
"""Slopes of a policy that obeys (kind: design from below, guess from above)."""
OBEDIENT_LOW = 0.7
"""Above that its interval lies (kind: guess)."""
INSENSITIVE_SLOPE = 0.2
"""A slope whose interval lies below is none; one whose interval lies between that and `OBEDIENT_SLOPE[0]` is obedience
in part (kind: guess)."""


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
    if found.compared_scenes < LEAST_SCENES or found.slope is None:
        few = f"{found.compared_scenes} scenes with at least two masks to act on are too few; {LEAST_SCENES} are needed"
        return Verdict(verdict=UNDECIDED, reason=few)
    low, high, slope = found.slope.low, found.slope.high, found.slope.estimate
    shown = f"the slope of {slope:.2f} [{low:.2f}, {high:.2f}]"
    least, most = OBEDIENT_SLOPE
    if least <= slope <= most and low > OBEDIENT_LOW:
        return Verdict(
            verdict=OBEYS, reason=f"{shown} lies between {least} and {most}, its interval above {OBEDIENT_LOW}"
        )
    if high < INSENSITIVE_SLOPE:
        return Verdict(verdict=INSENSITIVE, reason=f"{shown} has its interval below {INSENSITIVE_SLOPE}")
    if low > INSENSITIVE_SLOPE and high < least:
        return Verdict(verdict=PARTLY, reason=f"{shown} has its interval between {INSENSITIVE_SLOPE} and {least}")
    if low > most:
        return Verdict(verdict=UNDECIDED, reason=f"{shown} lies above {most}: it goes further than the masks do")
    return Verdict(verdict=UNDECIDED, reason=f"{shown} has an interval that allows for more than one verdict")
