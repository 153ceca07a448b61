"""A hundred kills of a real `lerobot-record`, at random moments (about an hour on two cores)."""

import os

from ..robots.kills import kill_and_recover, record_server

KILLS, FIRST_SEED = int(os.environ.get("EXCAV_KILLS", "100")), 1000


def test_a_hundred_kills_lose_at_most_the_episode_in_hand_each(tmp_path):
    kills = []
    with record_server() as server:
        for seed in range(FIRST_SEED, FIRST_SEED + 2 * KILLS):
            folder = tmp_path / str(seed)
            folder.mkdir()
            kills += kill_and_recover(server, folder, seed, "excavator_sim" if seed % 5 == 0 else "fr5_sim")
            print(kills[-1], flush=True)
            if sum(kill.was_running for kill in kills) >= KILLS:
                break
    print(f"{len(kills)} recordings, {sum(kill.was_running for kill in kills)} of them killed at work")
    assert sum(kill.recovered is not None and kill.recovered > 0 for kill in kills) > KILLS / 2
