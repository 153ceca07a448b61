"""How often, how many times and how late the operator of a demonstration is told another target."""

from dataclasses import dataclass

LATE_S = 0.5
"""How long before the operator would touch its target a late change comes at most [s] (kind: guess).

The excavator's operator still turns away then, where a policy that has seen few late changes digs on.
"""


@dataclass(frozen=True)
class ChangeOdds:
    """Odds from which the changes of mind of an episode are drawn.

    Attributes:
        share: Share of the episodes that have some, 0 to 1.
        times: How many those have at most; the number is drawn, all from 1 on alike.
        late: Share of the changes that come in the last `LATE_S` of the operator's way, 0 to 1; the others are drawn
            from its whole way.
    """

    share: float = 0.0
    times: int = 1
    late: float = 0.0
