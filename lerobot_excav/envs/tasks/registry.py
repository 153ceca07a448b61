"""The tasks: the only list of them.

A package of one's own adds a task with `register_task`; environments, recordings, checks and reports then have it.
"""

from pkgutil import resolve_name

import gymnasium as gym

from lerobot_excav.envs.tasks.clear.spec import CLEAR
from lerobot_excav.envs.tasks.grasp.spec import GRASP
from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import DatasetError, require, require_choice
from lerobot_excav.setting import declared_settings

TASKS: dict[str, TaskSpec] = {}
"""Tasks by their id."""

MANY_WORLDS_ENTRY = "lerobot_excav.envs.tasks.many_worlds:ManyWorlds"
"""What `gymnasium.make_vec` makes of any task; loaded at first use."""

SHARED_BY_A_ROBOT = (
    *("env_type", "cameras", "views", "state_names", "action_names", "action_low", "action_high", "task_state_names"),
    *("settings", "simulation_version", "changes", "target_count"),
)
"""What all tasks of a robot have in common, so that their recordings have the same columns and can be merged."""


def register_task(spec: TaskSpec) -> None:
    """Add a task, and register it with Gymnasium; adding the same one again changes nothing.

    Raises:
        ConfigurationError: Another task has this id, or the robot has a task with other columns.
    """
    _require_fitting_robot(spec)
    known = TASKS.setdefault(spec.id, spec)
    require(known is spec, f"the task {spec.id!r} exists; give the new one another id")
    # No time limit of Gymnasium's: the environment owns its length, and hands out its metrics when that is over.
    gym.register(
        id=spec.gym_id, entry_point=spec.env_entry, vector_entry_point=MANY_WORLDS_ENTRY, kwargs={"task": spec.id}
    )


def _require_fitting_robot(spec: TaskSpec) -> None:
    for other in TASKS.values():
        if other.robot_type == spec.robot_type:
            unlike = [name for name in SHARED_BY_A_ROBOT if getattr(other, name) != getattr(spec, name)]
            require(
                not unlike,
                f"the task {spec.id!r} has another {', '.join(unlike)} than {other.id!r}, which has the same "
                f"robot_type={spec.robot_type!r}; make them equal, or give the new task a robot_type and an env_type "
                "of its own",
            )


def task_spec(field: str, task_id: str | None, *, env_type: str | None = None) -> TaskSpec:
    """Return the task whose id the user gave for a field, of an environment if one is named.

    Raises:
        ConfigurationError: There is no such task.
    """
    known = tuple(id for id, spec in TASKS.items() if env_type in (None, spec.env_type))
    require_choice(field, task_id, known, hint="A task is a gym id without the part before the slash.")
    return TASKS[str(task_id)]


def task_played_by(env_class: type, own_task: str, task_id: str | None) -> TaskSpec:
    """Return the task that a class of environments plays: its own, or another one that names this class.

    Raises:
        ConfigurationError: There is no such task of this environment, or another class plays it.
    """
    spec = task_spec("task", own_task if task_id is None else task_id, env_type=TASKS[own_task].env_type)
    require(
        spec.id == own_task or resolve_name(spec.env_entry) is env_class,
        f"task={spec.id!r} is not played by {env_class.__name__}; make it by gymnasium.make({spec.gym_id!r})",
    )
    return spec


def task_of_settings(settings: TaskSettings) -> TaskSpec:
    """Return the task that settings name.

    Raises:
        ConfigurationError: Their environment has no such task.
    """
    return task_spec(f"{settings.PREFIX}task", settings.task, env_type=settings.ENV_TYPE)


def task_settings(config: TaskSettings) -> TaskSettings:
    """Return the settings alone of a configuration of LeRobot that is made of them."""
    kind = task_of_settings(config).settings
    return kind(**{name: getattr(config, name) for name in declared_settings(kind)})


def env_types() -> dict[str, TaskSpec]:
    """Return the environments by `--env.type`, each with its first task."""
    types: dict[str, TaskSpec] = {}
    for spec in TASKS.values():
        types.setdefault(spec.env_type, spec)
    return types


def task_of_robot(robot_type: str | None, task_id: str | None = None) -> TaskSpec:
    """Return a task of the robot that a dataset was recorded with; without an id the first.

    All tasks of a robot share what `SHARED_BY_A_ROBOT` lists, hence their columns.

    Raises:
        DatasetError: It was recorded with another robot, or the robot has no such task.
    """
    tasks = {spec.id: spec for spec in TASKS.values() if spec.robot_type == robot_type}
    if tasks:
        if task_id is not None and task_id not in tasks:
            raise DatasetError(
                f"excav.task={task_id!r} is not a task of robot_type={robot_type!r}; allowed: {', '.join(tasks)}"
            )
        return tasks[task_id] if task_id is not None else next(iter(tasks.values()))
    known = ", ".join(dict.fromkeys(repr(spec.robot_type) for spec in TASKS.values()))
    raise DatasetError(
        f"robot_type={robot_type!r} in meta/info.json is not a simulation of this package; allowed: {known}"
    )


for _spec in (SCOOP, CLEAR, GRASP):
    register_task(_spec)
