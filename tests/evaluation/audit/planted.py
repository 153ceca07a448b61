"""Policies whose obedience is known, on the example task."""

import numpy as np


class Planted:
    """Slides to a place that follows the commanded spot with a given slope, around the mean of all spots.

    Slope 1 goes to the spot, 0 to the mean whatever is commanded; None stands still.
    """

    def __init__(self, slope):
        self._slope = slope

    def begin(self, env):
        pass

    def act(self, env, observation):
        if self._slope is None:
            return np.zeros(2, np.float32)
        spots_w = env.world.spots_w
        middle_w = spots_w.mean(axis=0) + 0.3  # away from the start, so that it moves at all
        place_w = middle_w + self._slope * (spots_w[env.target_id] - middle_w)
        return np.clip(4.0 * (place_w - env.world.pos_w), -1.0, 1.0).astype(np.float32)


SLOPES = {"obeys": 1.0, "half": 0.5, "ignores": 0.0, "still": None}
