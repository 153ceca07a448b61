"""FR5Grasp-v0 as data."""

from lerobot_excav.envs.machines.fr5.features import ACTION_HIGH, ACTION_LOW, ACTION_NAMES, CAMERAS, STATE_NAMES, VIEWS
from lerobot_excav.envs.tasks.grasp.settings import EPISODE_DURATION_S, FR5Settings
from lerobot_excav.envs.tasks.task import TaskSpec

TASK_STATE_NAMES = (
    "target_height_m",
    "gripper_to_target_m",
    "target_to_tray_m",
    "fingers_on_target",
    "target_lifted",
    "target_in_tray",
    "blocks_in_tray",
    "first_grasped_block",
)
"""Entries of `task_state`: centre of the commanded block above its place on the table [m], its distance from the grasp
point [m] and from the tray's axis [m], pads that touch it [0..2], whether it is lifted by the fingers, whether it rests
in the tray, released, how many blocks do so, and the first block that was lifted since the last command (-1: none)."""

ENVIRONMENT_STATE_NAMES = tuple(
    f"{thing}.{axis}_w" for thing in ("target", "block_0", "block_1", "block_2", "block_3") for axis in "xyz"
)
"""Elements of `environment_state`: middle of the commanded block, then of every block [m], world frame."""

GRASP = TaskSpec(
    id="FR5Grasp-v0",
    robot_type="fr5_sim",
    description="Put the block that the mask marks into the tray.",
    cameras=CAMERAS,
    views=VIEWS,
    state_names=STATE_NAMES,
    action_names=ACTION_NAMES,
    action_low=ACTION_LOW,
    action_high=ACTION_HIGH,
    task_state_names=TASK_STATE_NAMES,
    environment_state_names=ENVIRONMENT_STATE_NAMES,
    duration_s=EPISODE_DURATION_S,
    storage="video",
    settings=FR5Settings,
    simulation_version=1,
    changes={1: "the first: servos at their speed limits, four blocks, a tray with a rim"},
    env_entry="lerobot_excav.envs.tasks.grasp.env:FR5GraspEnv",
    operator_entry="lerobot_excav.envs.tasks.grasp.operator:GraspOperator",
    measures_entry="lerobot_excav.envs.tasks.grasp.measures:GRASP_MEASURES",
    nearest_target_entry="lerobot_excav.envs.tasks.grasp.nearest_block:nearest_target",
    sticks_entry="lerobot_excav.envs.tasks.grasp.sticks:GraspSticks",
    place_probe_entry="lerobot_excav.envs.tasks.grasp.place_probe:TakenBlock",
    task_state_tolerance=1e-4,  # [m], or a count (kind: guess; the same build repeats exactly)
    judges_at_the_end=True,
)
