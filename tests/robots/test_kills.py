"""A few kills of a real `lerobot-record`; `make test-long` tries a hundred."""

import pytest

from .kills import kill_and_recover, record_server

pytestmark = pytest.mark.slow


def test_a_killed_recording_loses_at_most_the_episode_in_hand(tmp_path):
    with record_server() as server:
        for seed, robot_type in enumerate(["fr5_sim", "excavator_sim"]):
            folder = tmp_path / str(seed)
            folder.mkdir()
            kill_and_recover(server, folder, seed, robot_type)
