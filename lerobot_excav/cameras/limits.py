"""What a camera of this package may be set to."""

MOST_PX = 8192
"""Greatest side of a picture [px] (kind: guess)."""

MOST_FPS = 1000
"""Most pictures a second (kind: guess)."""
