"""What the simulated robot noted while `lerobot-record` recorded: how each episode began, and what was done in it."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from lerobot_excav.datasets.complete.session_events import (
    ActionEvent,
    CommandEvent,
    DiscardEvent,
    EndEvent,
    EpisodeEvent,
    Event,
    HeldEvent,
    OperatorEvent,
    RestartEvent,
    SessionEvent,
    read_events,
)
from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.envs.tasks.registry import env_types, task_of_settings
from lerobot_excav.envs.tasks.selection import Schedule, checked_schedule
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.envs.tasks.task import TaskSpec
from lerobot_excav.errors import ConfigurationError, DatasetError, require, require_choice, require_integer


@dataclass(kw_only=True)
class Run:
    """What was done from a start of a scene on.

    Attributes:
        scene_id: Scene.
        stage: Cycles dug before the start.
        target_id: Target that is commanded first.
        frames: What LeRobot recorded, in order; only the last may be a restart, whose action was not carried out.
        changes: Changes of the command, as pairs of the number of actions before and the target.
    """

    scene_id: int
    stage: int
    target_id: int
    frames: list[ActionEvent | RestartEvent] = field(default_factory=list)
    changes: list[tuple[int, int]] = field(default_factory=list)

    @property
    def actions(self) -> int:
        """How many actions were carried out."""
        return sum(isinstance(frame, ActionEvent) for frame in self.frames)

    @property
    def schedule(self) -> Schedule:
        """Changes of the command; what was commanded after the last action was never obeyed, nor shown in a frame."""
        return tuple((frame, target_id) for frame, target_id in self.changes if frame < self.actions)


@dataclass(kw_only=True)
class SessionEpisode:
    """One recorded episode.

    Attributes:
        episode_index: Its number when it was recorded.
        place: File and line where it begins, for messages.
        session: What the simulation was set to.
        runs: What was done; a restart begins another run.
        restarts: Numbers of actions after which the scene was restarted, or the machine held until its mask was found.
        end: How it ended: `ended`, `stopped`, or None where the log breaks off.
        operator: Who commanded, if the log says so.
    """

    episode_index: int
    place: str
    session: SessionEvent
    runs: list[Run]
    restarts: list[int] = field(default_factory=list)
    end: str | None = None
    operator: str | None = None

    @property
    def simulation_version(self) -> int:
        """Version of the simulation."""
        return self.session.simulation_version

    @property
    def env(self) -> str:
        """Name of the environment."""
        return self.session.env

    @cached_property
    def spec(self) -> TaskSpec:
        """The task."""
        return task_of_settings(self.task_settings)

    @cached_property
    def task_settings(self) -> TaskSettings:
        """Settings of an environment that behaves as the robot did."""
        return env_types()[self.env].settings.of(self.session.settings)

    @property
    def pair(self) -> Pair:
        """Start and first target."""
        first = self.runs[0]
        return Pair(self.env, self.task_settings.scene_set, first.scene_id, first.stage, first.target_id)

    @property
    def schedule(self) -> Schedule:
        """Changes of the command in an episode that was not restarted."""
        return self.runs[0].schedule

    @property
    def frames(self) -> int:
        """How many actions were carried out."""
        return sum(run.actions for run in self.runs)


def read_session(path: Path) -> dict[int, SessionEpisode]:
    """Read the episodes of a session that were not discarded, by index.

    An episode takes the place of all earlier ones with its index or a higher one: LeRobot counts on from what it has,
    so those were discarded, or not kept when the recording was interrupted.

    Raises:
        DatasetError: The file is missing, a line is not an event or comes out of turn, or has an environment, a
            setting, a scene, a target or a number of values that is not possible. The message names line and field.
    """
    reader = _Reader()
    for place, event in read_events(path):
        try:
            reader.take(event, place)
        except ConfigurationError as error:
            raise DatasetError(f"{place}: {error}") from None
    return reader.episodes


def _run(event: EpisodeEvent | RestartEvent) -> Run:
    return Run(scene_id=event.scene_id, stage=event.stage, target_id=event.target_id)


class _Reader:
    """Puts events together."""

    def __init__(self) -> None:
        self.episodes: dict[int, SessionEpisode] = {}
        self._session: SessionEvent | None = None
        self._last: SessionEpisode | None = None  # the one to which events belong

    def take(self, event: Event, place: str) -> None:
        """Take the next event; raise ConfigurationError if it is not possible."""
        match event:
            case SessionEvent():
                require_choice("env", event.env, tuple(env_types()))
                task_of_settings(env_types()[event.env].settings.of(event.settings))
                self._session, self._last = event, None
            case EpisodeEvent():
                self._begin(event, place)
            case DiscardEvent():
                self.episodes.pop(self._episode(event).episode_index, None)
                self._last = None
            case EndEvent():
                self._end(event, self._running(event))
            case _:
                self._note(event, self._running(event))

    def _begin(self, event: EpisodeEvent, place: str) -> None:
        require(self._session is not None, "an episode begins before the line of its session")
        assert self._session is not None
        start, index = _run(event), event.episode_index
        self._last = SessionEpisode(episode_index=index, place=place, session=self._session, runs=[start])
        self._require_start(event, self._last)
        self.episodes = {i: episode for i, episode in self.episodes.items() if i < index} | {index: self._last}

    @staticmethod
    def _end(event: EndEvent, episode: SessionEpisode) -> None:
        noted = sum(len(run.frames) for run in episode.runs)
        require(
            event.frames == noted,
            f"frames={event.frames}, but the log has {noted} frames of episode {episode.episode_index}; lines were "
            "lost or added, so it cannot be repeated",
        )
        episode.end = event.event

    def _note(self, event: Event, episode: SessionEpisode) -> None:
        run = episode.runs[-1]
        match event:
            case ActionEvent():
                self._require_values(event, episode)
                run.frames.append(event)
            case OperatorEvent():
                episode.operator = event.operator
            case HeldEvent():
                episode.restarts.append(episode.frames)
            case CommandEvent():
                run.changes.append((run.actions, event.target_id))
                checked_schedule(run.changes, episode.spec.target_count, run.actions + 1)
            case RestartEvent():
                episode.restarts.append(episode.frames)
                self._require_start(event, episode)
                if event.state is not None and event.action is not None:
                    self._require_values(event, episode)
                    run.frames.append(event)
                episode.runs.append(_run(event))

    def _episode(self, event: Event) -> SessionEpisode:
        require(self._last is not None, f"event={event.event!r} comes before the line of its episode")
        assert self._last is not None
        return self._last

    def _running(self, event: Event) -> SessionEpisode:
        episode = self._episode(event)
        require(episode.end is None, f"event={event.event!r} comes after its episode has {episode.end}")
        return episode

    @staticmethod
    def _require_start(event: EpisodeEvent | RestartEvent, episode: SessionEpisode) -> None:
        require_integer("target_id", event.target_id, 0, episode.spec.target_count - 1)
        require_integer("stage", event.stage, 0, episode.spec.last_stage)

    @staticmethod
    def _require_values(event: ActionEvent | RestartEvent, episode: SessionEpisode) -> None:
        names = {"state": episode.spec.state_names, "action": episode.spec.action_names}
        for name, expected in names.items():
            found = getattr(event, name)
            require(
                len(found) == len(expected),
                f"{name}={found} has {len(found)} values; {episode.env} has {len(expected)}: {', '.join(expected)}",
            )
