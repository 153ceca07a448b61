"""How fast this machine plays and records a task. `bench/` of the repository times soil and policies alone."""

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.simulation import play_demonstration
from lerobot_excav.setting import declared_settings


class Measurement(NamedTuple):
    """One measured number."""

    name: str
    value: float
    unit: str


def measure_environment(settings: DemonstrationSettings) -> list[Measurement]:
    """Measure whole scripted episodes, in one process, without and with pictures."""
    results = []
    for name, with_images in (("environment", False), ("environment with pictures", True)):
        # The first frames compile kernels and open the graphics context.
        play_demonstration(settings, settings.pairs()[0], with_images=with_images)
        start, frames = time.perf_counter(), 0
        for pair in settings.pairs():
            frames += play_demonstration(settings, pair, with_images=with_images).length
        rate = frames / (time.perf_counter() - start)
        results += [Measurement(name, rate, "steps/s"), Measurement(name, rate / settings.env.fps, "x real time")]
    return results


def measure_cycles(settings: DemonstrationSettings) -> list[Measurement]:
    """Measure the operator's cycles alone at every fidelity: simulated time over processor time, without pictures."""
    levels = declared_settings(type(settings.env)).get("fidelity")
    results = []
    for fidelity in (None,) if levels is None else levels.values or ():
        env = settings.env if fidelity is None else replace(settings.env, fidelity=fidelity)
        played = replace(settings, env=env)
        play_demonstration(played, played.pairs()[0], with_images=False)  # the first cycle loads or compiles kernels
        start, frames = time.process_time(), 0
        for pair in played.pairs():
            frames += play_demonstration(played, pair, with_images=False).length
        name = "operator's cycle" if fidelity is None else f"operator's cycle, {fidelity}"
        seconds = time.process_time() - start
        results.append(Measurement(name, frames / played.env.fps / seconds, "x real time"))
    return results


def measure_writing(settings: DemonstrationSettings) -> list[Measurement]:
    """Measure storing and assembling alone: frames through the episode store and LeRobot's writer."""
    from lerobot_excav.datasets.record.assembly import append_episode, create_dataset
    from lerobot_excav.datasets.record.episode_store import EpisodeStore

    pair = settings.pairs()[0]
    episode = play_demonstration(settings, pair)
    copies = [replace(episode, pair=pair._replace(scene_id=number)) for number in range(4)]
    with tempfile.TemporaryDirectory() as folder:
        store = EpisodeStore(Path(folder) / "episodes")
        dataset = create_dataset(Path(folder) / "dataset", settings)
        append_episode(dataset, copies[0], settings)  # the first call loads libraries
        start = time.perf_counter()
        for copy in copies[1:]:
            store.write(copy, keep_frames=True)
            append_episode(dataset, store.read(copy.pair), settings)
        elapsed = time.perf_counter() - start
        dataset.finalize()
    frames = episode.length * (len(copies) - 1)
    return [Measurement("writing frames alone", frames / elapsed, "frames/s")]


def measure_demonstrations(settings: DemonstrationSettings, *, workers: int) -> list[Measurement]:
    """Measure recording, from nothing to a finished dataset."""
    from lerobot_excav.datasets.record.demonstrations import record_demonstrations

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "dataset"
        summary = record_demonstrations(settings, out, workers=workers, show_progress=False)
    name = f"demonstrations, {workers} workers, start included"
    return [
        Measurement(name, 60.0 * summary.episodes / summary.wall_s, "episodes/min"),
        Measurement(name, summary.simulated_s / summary.wall_s, "x real time"),
    ]


def measures(settings: DemonstrationSettings, *, workers: int) -> dict[str, Callable[[], list[Measurement]]]:
    """Return what can be measured, by name."""
    return {
        "environment": lambda: measure_environment(settings),
        "cycle": lambda: measure_cycles(settings),
        "writing": lambda: measure_writing(settings),
        "demos": lambda: measure_demonstrations(settings, workers=workers),
    }
