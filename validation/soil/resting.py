"""Soil that comes to rest."""

from collections.abc import Iterator

from lerobot_excav.envs.soil import Soil


def steps_until_rest(soil: Soil, *, dt_s: float, limit_s: float) -> Iterator[int]:
    """Step a soil until no parcel is left and no height changes; yield the number of every step after it, from 1 on.

    Parcels may be added between the steps. It gives up after a limit.
    """
    before = b""
    for number in range(1, round(limit_s / dt_s) + 1):
        soil.step(dt_s)
        yield number
        now = soil.heights_m.tobytes()
        if now == before and len(soil.parcel_positions_w) == 0:
            return
        before = now
