"""Facts that soil and machines share."""

TICK_S = 0.02
"""Duration of one control and soil step [s] (kind: paper, the published 50 Hz set-up)."""

TICKS_PER_SECOND = 50
"""Steps in a second; a frame of any environment is a whole number of them."""

GRAVITY_M_S2 = 9.81
"""Standard gravity [m/s2], rounded as the references round it (kind: paper)."""
