import pytest

from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.result_page.contents import CurveSource
from lerobot_excav.evaluation.result_page.curves import read_curve


@pytest.fixture
def curve(tmp_path, metrics_file, grasp_line):
    """Write evaluations of 2 episodes by the stem of their file, and read them as a curve."""

    def read(**evaluations):
        for name, changes in evaluations.items():
            lines = [grasp_line(i, **{"scene_set": "val", **changes, **changes.get(f"at_{i}", {})}) for i in range(2)]
            metrics_file(f"{name[1:]}.jsonl", lines)
        return read_curve(CurveSource(label="c", folder=str(tmp_path)))

    return read


def test_points_stand_by_their_step_and_files_whose_name_is_no_step_are_no_points(curve):
    points = curve(_2000={}, _100={}, _3a={}).points
    assert [point.step for point in points] == [100, 2000]
    assert [(p.scene_set, p.run.setting, p.n) for p in points] == 2 * [("val", {"mask": "correct"}, 2)]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mask_condition": "mismatched"}, r"100.jsonl has mask_condition='correct' and .*200.jsonl 'mismatched'"),
        ({"scene_set": "test"}, r"100.jsonl has scene_set='val' and .*200.jsonl 'test'"),
        ({"simulation_version": 2}, r"simulation_version=1 and .* 2; .* folders of their own"),
        ({"at_1": {"scene_set": "test"}}, r"200.jsonl mixes scenes of test and val"),
    ],
)
def test_a_curve_is_of_one_set_of_scenes_and_one_condition(curve, changes, message):
    with pytest.raises(DatasetError, match=message):
        curve(_100={}, _200=changes)
