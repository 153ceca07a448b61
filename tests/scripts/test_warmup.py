from lerobot_excav.scripts.main import main


def test_an_episode_of_the_environment_has_started(capsys):
    assert main(["warmup", "--env.type=toy_reach"]) == 0
    assert " is ready: an episode started after " in capsys.readouterr().out
