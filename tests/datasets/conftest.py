import pytest
import toy_reach.env

from .toy import command_next_spot, record_small, record_toy


@pytest.fixture(scope="session", autouse=True)
def spot_out_of_reach():
    """Put spot 1 of scene 3 where the camera sees it but the disc never comes, so that one episode fails."""
    draw = toy_reach.env.draw_spots

    def draw_spots(scene_set, scene_id):
        spots = draw(scene_set, scene_id)
        if (scene_set, scene_id) == ("train", 3):
            spots[1] = (1.13, 0.5)
        return spots

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(toy_reach.env, "draw_spots", draw_spots)
        yield


@pytest.fixture(scope="session")
def paired_dataset(tmp_path_factory):
    """Five scenes with four targets each, except scene 3, which lacks target 1. Not to be changed by tests."""
    out = tmp_path_factory.mktemp("paired") / "dataset"
    record_toy(out, scenes=5)
    return out


@pytest.fixture(scope="session")
def changing_datasets(tmp_path_factory):
    """Two scenes with four targets, by storage; the command changes in every episode. Not to be changed by tests."""
    folder = tmp_path_factory.mktemp("changing")
    with pytest.MonkeyPatch.context() as patch:
        command_next_spot(patch)
        for storage in ("image", "video"):
            record_toy(folder / storage, scenes=2, storage=storage)
    return {storage: folder / storage for storage in ("image", "video")}


@pytest.fixture(scope="session")
def small_datasets(tmp_path_factory):
    """Two scenes with two targets, by storage. Not to be changed by tests."""
    return record_small(tmp_path_factory.mktemp("small"))


@pytest.fixture
def command_changes(monkeypatch):
    """Let the task command another spot within every episode."""
    command_next_spot(monkeypatch)
