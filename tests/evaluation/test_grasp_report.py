import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.report import make_report
from lerobot_excav.evaluation.report_text import report_text

NOTHING = {"is_success": False, "target_in_tray": False, "blocks_in_tray": 0, "episode_return": 0.0}


@pytest.fixture
def lines(grasp_line):
    """Four successes, two dropped blocks, three wrong ones and one hand that grasped none."""
    return [
        *(grasp_line(i) for i in range(4)),
        *(grasp_line(i, **{**NOTHING, "episode_return": 50.0}) for i in (4, 5)),
        *(grasp_line(i, **NOTHING, first_grasped_block=(i + 1) % 4) for i in (6, 7, 8)),
        grasp_line(9, **NOTHING, first_grasped_block=-1),
    ]


def test_target_selection_is_told_apart_from_success(make_run, lines):
    report = make_report([make_run("a", lines)])
    (row,) = report.runs
    assert (row["success"].estimate, row["grasped"].estimate) == (0.4, 0.9)
    assert row["episode_return"].estimate == pytest.approx(330.0)
    assert (row["target_selection"].estimate, row["target_selection"].n) == (pytest.approx(6 / 9), 9)
    assert (row["placed"].estimate, row["placed"].n) == (pytest.approx(4 / 6), 6)
    assert row["first_grasped"] == {"commanded": 6, "other": 3, "none": 1}
    text = report_text(report)
    for shown in ("40.0 [16.8, 68.7]", "66.7 [35.4, 87.9] of 9", "6 / 3 / 1", "commanded / other / none"):
        assert shown in text
    assert "kg" not in text
    (plain,) = report.as_dict()["runs"]
    assert (plain["task"], plain["mask_noise"], plain["target_selection"]["n"]) == ("FR5Grasp-v0", "none", 9)
    assert "n" not in plain["success"]


def test_following_a_wrong_mask_is_told_apart_from_the_command(make_run, grasp_line):
    wrong = {**NOTHING, "mask_condition": "mismatched"}
    lines = [
        *(grasp_line(i, **wrong, shown_target_id=(i + 1) % 4, first_grasped_block=(i + 1) % 4) for i in range(3)),
        grasp_line(3, **wrong, shown_target_id=0, first_grasped_block=3),
        grasp_line(4, **wrong, shown_target_id=1, first_grasped_block=-1),
    ]
    run = make_run("a", lines)
    (row,) = make_report([run]).runs
    assert (row["mask_followed"].estimate, row["mask_followed"].n) == (0.75, 4)
    assert row["target_selection"].estimate == 0.25
    assert [episode.obeyed_shown_mask for episode in run.episodes] == [True, True, True, False, False]


@pytest.mark.parametrize(
    ("changes", "keys"),
    [
        ({"mask_condition": "zero", "shown_target_id": -1}, ["mask_followed"]),
        ({"first_grasped_block": -1}, ["target_selection", "mask_followed", "placed"]),
    ],
)
def test_what_cannot_be_said_is_left_open(make_run, grasp_line, changes, keys):
    report = make_report([make_run("a", [grasp_line(0, **changes)])])
    assert [key for key, value in report.runs[0].values.items() if value is None] == keys
    assert "| -" in report_text(report)


def test_after_a_change_of_the_command_the_last_one_counts(make_run, grasp_line):
    lines = [
        grasp_line(0, commands=[[0, 0], [25, 3]], first_grasped_block=3),
        grasp_line(1, commands=[[0, 1], [25, 3]], first_grasped_block=1),
    ]
    (row,) = make_report([make_run("a", lines)]).runs
    assert row["first_grasped"] == {"commanded": 1, "other": 1, "none": 0}
    assert row.run.setting == {"mask": "correct, changed at frame 25"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mask_noise": "shift", "mask_noise_px": 4}, "correct, shift 4 px"),
        ({"mask_condition": "mismatched", "target_overlay": True}, "mismatched, as overlay"),
        ({"mask_source": "detector"}, "correct, from detector"),
        ({"mask_noise": "shift", "mask_noise_px": 4, "mask_snap": True}, "correct, shift 4 px, snapped"),
        ({"mask_dropout": 0.25}, "correct, dropout 25 %"),
        ({"camera_every": 5}, "correct, camera every 5 frames"),
        ({"commands": [[0, 0], [25, 3], [60, 1]]}, "correct, changed at frame 25 and 60"),
    ],
)
def test_the_words_of_a_mask_say_all_that_was_done_to_it(make_run, grasp_line, changes, words):
    assert make_run("a", [grasp_line(0, **changes)]).setting == {"mask": words}


def test_a_run_does_not_mix_times_at_which_the_command_changes(make_run, grasp_line):
    with pytest.raises(ConfigurationError, match=r"a mixes times at which the command changes: \(\) and \(9,\)"):
        make_run("a", [grasp_line(0), grasp_line(1, commands=[[0, 1], [9, 2]])])


def test_runs_on_the_same_scenes_are_compared_by_success_and_return(make_run, lines, grasp_line):
    perfect = make_run("perfect", [grasp_line(i) for i in range(10)])
    report = make_report([make_run("a", lines), perfect])
    success, total = report.differences["perfect - a"]
    assert success.difference.estimate == pytest.approx(0.6)
    assert success.p_value == pytest.approx(2 / 2**6)
    assert total.difference.estimate == pytest.approx(470.0)
    assert "| success [%] | +60.0" in report_text(report)
