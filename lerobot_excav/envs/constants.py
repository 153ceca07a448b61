"""Numbers that every simulation shares, each with unit, source and kind. Imports nothing, so that all may import it."""

TICKS_PER_SECOND = 50
"""Rate of control and soil [Hz] (kind: paper, the published 50 Hz set-up)."""

TICK_S = 0.02
"""Duration of one command and of one step of the soil [s]: one over `TICKS_PER_SECOND` (kind: paper)."""

GRAVITY_M_S2 = 9.81
"""Standard gravity [m/s2], rounded as the references and MuJoCo round it (kind: paper)."""
