"""The progress bar of recordings."""

from lerobot_excav.datasets.record.progress import EpisodeProgress


def test_the_bar_tells_played_failed_and_written_episodes(capsys):
    with EpisodeProgress(3, show=True) as progress:
        progress.skip()
        progress.count(success=True)
        progress.count(success=False)
        for _ in range(3):
            progress.count_written()
    last = capsys.readouterr().err.split("\r")[-1]
    assert "episodes 3/3" in last
    assert "1 without success" in last
    assert "3 written" in last


def test_a_hidden_bar_says_nothing(capsys):
    with EpisodeProgress(1, show=False) as progress:
        progress.count(success=True)
        progress.count_written()
    assert capsys.readouterr() == ("", "")
