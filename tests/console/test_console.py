"""What a person may do at the console, and what happens then."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from lerobot_excav.console.wishes import painted_pixels
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.page.sticks import LOST_S
from lerobot_excav.page.wishes import Wish

from .conftest import CENTRE, PAGE, Planted

SWING_LEFT = [-1.0, 0.0, 0.0, 0.0]


def png_of(pixels):
    buffer = io.BytesIO()
    Image.fromarray(np.where(pixels, 255, 0).astype(np.uint8)).save(buffer, format="png")
    return base64.b64encode(buffer.getvalue()).decode()


def test_time_stands_still_until_a_person_drives_and_then_until_the_first_motion(open_driver):
    driver = open_driver()
    assert driver.tick(SWING_LEFT, times=3) == 0
    assert driver.state["mode"] == "still"
    driver.wish("drive")
    assert driver.tick(times=5) == 0
    assert driver.tick(SWING_LEFT, times=5) == 5
    assert driver.state["mode"] == "drive"
    assert driver.console.env.agent_pos[4] > 0.1  # swings to the left
    assert driver.tick(times=3) == 3  # from then on time passes with the sticks at rest too
    driver.wish("stop")
    assert driver.tick(SWING_LEFT, times=3) == 0


def test_sticks_that_were_not_centred_drive_nothing(open_driver):
    driver = open_driver()
    driver.seat.leave(PAGE)
    driver.seat.take(PAGE)
    driver.console.tick()
    driver.seat.wish(PAGE, Wish(kind="drive"))
    assert driver.tick(SWING_LEFT, times=5) == 0
    driver.centre()
    assert driver.tick(SWING_LEFT, times=5) == 5


def test_time_stands_still_when_the_page_that_drives_is_gone_and_the_page_says_why(open_driver):
    driver = open_driver(policy=Planted())
    driver.wish("work")
    assert driver.tick(times=3) == 3
    driver.seat.leave(PAGE)
    assert not driver.console.tick()
    assert driver.state["mode"] == "still"
    assert "the controls were given up" in driver.state["words"]


def test_a_policy_stops_when_the_page_is_not_heard_any_more_or_another_page_has_taken_the_controls(open_driver):
    driver = open_driver(policy=Planted())
    driver.wish("work")
    assert driver.tick(times=3) == 3
    driver.now_s += 2.0 * LOST_S  # a connection that is half open, a page that is hidden
    driver.console.tick()
    assert "not heard any more" in driver.state["words"]
    assert driver.state["mode"] == "still"
    driver.centre()
    driver.wish("work")
    driver.seat.take(PAGE + 1, force=True)
    driver.console.tick()
    assert driver.state["mode"] == "still"
    assert "another page" in driver.state["words"]


class Broken(Planted):
    """A policy that fails, or asks for something that is no number."""

    def __init__(self, action=None):
        super().__init__()
        self._action = action

    def act(self, env, observation):
        return self._action if self._action is not None else {}["no such weight"]


@pytest.mark.parametrize(
    ("policy", "words"), [(Broken(), "no such weight"), (Broken(np.full(4, np.nan, np.float32)), "not finite")]
)
def test_a_policy_that_fails_stops_and_the_console_goes_on(open_driver, policy, words):
    driver = open_driver(policy=policy)
    driver.wish("work")
    assert driver.state["mode"] == "still"
    assert words in driver.state["words"]
    driver.wish("drive")
    assert driver.tick(SWING_LEFT, times=3) == 3


def test_a_fault_of_the_program_itself_is_told_and_the_console_goes_on(open_driver, monkeypatch):
    driver = open_driver()
    monkeypatch.setattr(driver.console.env, "recommand", lambda target_id: {}[target_id])
    driver.wish("target", number=1)
    assert "a fault of the program" in driver.state["words"]
    driver.wish("start", values={"scene_id": 1})
    assert driver.state["scene"]["scene_id"] == 1


def test_a_policy_works_a_stick_takes_over_and_it_is_handed_back(open_driver):
    policy = Planted()
    driver = open_driver(policy=policy)
    driver.wish("work")
    assert (policy.begun, driver.state["mode"]) == (1, "work")
    assert driver.tick(times=5) == 5
    assert driver.state["action"]["bucket.vel"] == -0.25
    assert driver.tick([0.1, 0.0, 0.0, 0.0]) == 1  # a hand that rests on the stick does not take over
    assert driver.state["mode"] == "work"
    assert driver.tick(SWING_LEFT) == 1
    assert (driver.state["mode"], driver.state["taken_over"]) == ("drive", True)
    assert driver.state["action"] == {"swing.vel": 1.0, "boom.vel": 0.0, "arm.vel": 0.0, "bucket.vel": 0.0}
    driver.wish("work")
    assert (policy.begun, driver.state["mode"], driver.state["taken_over"]) == (2, "work", False)


def test_what_is_not_possible_is_refused_with_words_and_nothing_changes(open_driver):
    driver = open_driver()
    for kind, values, words in (
        ("work", {}, "no policy is loaded"),
        ("record", {}, "nothing is recorded"),
        ("keep", {}, "no episode is finished"),
        ("finish", {}, "nothing is recorded now"),
        ("point", {}, "needs x and y"),
        ("point", {"x": 0.0, "y": 0.0}, "nothing to act on"),
        ("target", {"number": 9}, "target_id"),
        ("paint", {"picture": "nonsense"}, "no picture"),
        ("start", {"values": {"scene_id": 0, "stage": 99}}, "stage"),
        ("start", {"values": {"colour": 3}}, "colour"),
        ("start", {"values": {"self": 3}}, "self"),
    ):
        driver.wish(kind, **values)
        assert words in driver.state["words"], kind
        assert driver.state["fault"], kind
        assert driver.state["mode"] == "still"


def test_a_click_commands_a_place_and_a_painted_mask_reaches_the_policys_picture(open_driver):
    driver = open_driver()
    driver.wish("point", x=0.6, y=0.55)
    env = driver.console.env
    assert env.target_id == 4
    assert "commanded" in driver.state["words"]
    painted = np.zeros((480, 640), dtype=bool)
    painted[250:300, 300:380] = True
    driver.wish("paint", picture=png_of(painted))
    expected = np.zeros((96, 128), dtype=bool)
    expected[50:60, 60:76] = True
    assert (env.mask.pixels == expected).all()
    assert (driver.console.observation["pixels"]["target_mask"][..., 0] == 255 * expected).all()
    driver.wish("target", number=2)
    assert env.target_id == 2


def test_painted_masks_of_any_size_become_the_policys_pixels_and_thin_lines_do_not_count():
    pixels = np.zeros((96, 128), dtype=bool)
    pixels[10:20, 30:50] = True
    for scale in (1, 2, 5):
        large = np.kron(pixels, np.ones((scale, scale), dtype=bool))
        assert (painted_pixels(png_of(large), (96, 128)) == pixels).all()
    line = np.zeros((480, 640), dtype=bool)
    line[:, 100] = True
    assert not painted_pixels(png_of(line), (96, 128)).any()
    data = base64.b64decode(png_of(pixels))
    jpeg = io.BytesIO()
    Image.fromarray(pixels).convert("L").save(jpeg, format="jpeg")
    broken = data.replace(b"IDAT", b"IDAX")
    for wrong in (b"PNG", data[:40], broken, jpeg.getvalue()):
        with pytest.raises(ConfigurationError, match="no picture"):
            painted_pixels(base64.b64encode(wrong).decode(), (96, 128))


def test_another_scene_is_shown_at_its_stage(open_driver):
    driver = open_driver()
    before = driver.state["targets"]
    driver.wish("start", values={"scene_id": 5})
    assert driver.state["scene"] == {"set": "train", "scene_id": 5, "stage": 0}
    assert driver.state["targets"] != before
    assert [target["number"] for target in driver.state["targets"]] == [0, 1, 2, 3]


def test_one_cycle_of_clearing_ends_where_the_planner_commands_the_next(open_driver, monkeypatch):
    from lerobot_excav.envs.tasks.clear import clearing

    monkeypatch.setattr(clearing, "CYCLE_LIMIT_S", 1.0)
    driver = open_driver(env={"task": "Clear-v0"}, policy=Planted())
    driver.wish("work", values={"once": 1})
    assert driver.tick(times=30) < 15
    assert driver.state["mode"] == "still"
    assert "the cycle is over" in driver.state["words"]
    # At the standstill the planner's choice is of this very frame, and so is what a person points at, twice.
    driver.wish("point", x=0.6, y=0.55)
    driver.wish("point", x=0.55, y=0.6)
    assert "commanded" in driver.state["words"]
    assert driver.console.env.commands[-1].since_frame == driver.console.env.frame
    driver.wish("work")
    assert driver.tick(times=30) == 30
    assert "the planner commands the next region" in driver.state["words"]


def test_pointing_gives_a_cycle_its_whole_time_and_driving_is_not_stopped_at_its_end(open_driver, monkeypatch):
    from lerobot_excav.envs.tasks.clear import clearing

    monkeypatch.setattr(clearing, "CYCLE_LIMIT_S", 1.0)
    driver = open_driver(env={"task": "Clear-v0"}, policy=Planted())
    driver.wish("work", values={"once": 1})  # a frame passes in which it is granted
    driver.tick(times=7)
    driver.wish("point", x=0.6, y=0.55)
    assert driver.tick(times=8) == 8
    assert driver.state["mode"] == "work"
    driver.tick(SWING_LEFT)
    assert driver.tick(SWING_LEFT, times=15) == 15
    assert driver.state["mode"] == "drive"


def test_the_pictures_are_those_of_the_cameras_and_a_map_and_the_mask_is_tinted_into_main(open_driver):
    driver = open_driver()
    pictures = driver.pictures
    assert list(pictures) == ["main", "view_0", "policy", "plan"]
    sizes = {name: Image.open(io.BytesIO(data)).size for name, data in pictures.items()}
    assert sizes == {"main": (128, 96), "view_0": (128, 96), "policy": (256, 96), "plan": (240, 240)}
    main = np.asarray(Image.open(io.BytesIO(pictures["main"]))).astype(int)
    plain = driver.console.observation["pixels"]["main"].astype(int)
    redness = (main - plain)[..., 0] - (main - plain)[..., 2]
    mask = driver.console.env.mask.pixels
    assert redness[mask].mean() > 25 > 5 > abs(redness[~mask].mean())


def test_the_arm_is_led_by_the_sticks_and_holds_still_when_they_rest(open_driver):
    driver = open_driver("fr5_grasp")
    cell = driver.console.env.workcell
    driver.wish("drive")
    for axes, axis, sign in (
        ([0.0, -1.0, 0.0, 0.0], 0, 1),  # forward: away
        ([-1.0, 0.0, 0.0, 0.0], 1, 1),  # left
        ([0.0, 0.0, 0.0, 1.0], 2, 1),  # back: up
    ):
        before = cell.grasp_pos_w
        driver.tick(axes, times=25)
        moved = cell.grasp_pos_w - before
        assert np.argmax(np.abs(moved)) == axis
        assert sign * moved[axis] > 0.03
        driver.tick(CENTRE, times=10)  # what is under way comes to rest
        rest = cell.grasp_pos_w
        driver.tick(CENTRE, times=25)
        assert np.linalg.norm(cell.grasp_pos_w - rest) < 2e-3
    driver.tick([0.0, 0.0, -1.0, 0.0], times=50)
    assert cell.opening < 0.1
    driver.tick([0.0, 0.0, 1.0, 0.0], times=50)
    assert cell.opening > 0.9
