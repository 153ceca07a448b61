"""How fast this machine simulates, records, trains and plans."""

import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.rig import ExcavatorRig
from lerobot_excav.datasets.record.simulation import play_demonstration
from lerobot_excav.envs.tasks.settings import FIDELITIES

_SOIL_NUMBERS = (
    ("", "real_time_factor", "x real time"),
    (", half of the ticks", "p50_ms", "ms"),
    (", 95 % of the ticks", "p95_ms", "ms"),
    (", worst tick", "worst_ms", "ms"),
    (", parcels (mean)", "mean_parcels", ""),
    (", parcels (most)", "most_parcels", ""),
    (", awake (mean)", "mean_awake", ""),
    (", awake (most)", "most_awake", ""),
)
"""What is shown of `real_time_factor`: name, key, unit."""


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One measured number.

    Attributes:
        name: What was measured.
        value: The number.
        unit: Its unit.
    """

    name: str
    value: float
    unit: str

    def as_dict(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)


def measure_soil(*, quick: bool) -> list[Measurement]:
    """Measure the soil alone over a scripted dig cycle, in every fidelity; of several runs the quickest counts."""
    from lerobot_excav.envs.soil.benchmark import real_time_factor

    results = []
    for fidelity in ("standard",) if quick else FIDELITIES:
        runs = [real_time_factor(seed, fidelity) for seed in range(1 if quick else 3)]
        best = max(runs, key=lambda run: run["real_time_factor"])
        results += [
            Measurement(name=f"soil alone, {fidelity}{what}", value=best[key], unit=unit)
            for what, key, unit in _SOIL_NUMBERS
        ]
    return results


def measure_environment(*, quick: bool) -> list[Measurement]:
    """Measure whole scripted episodes, in one process, without and with pictures."""
    settings = DemonstrationSettings(scenes=1)
    results = []
    for name, with_images in (("environment", False), ("environment with pictures", True)):
        rig = ExcavatorRig(with_images=with_images)
        # The first frames compile kernels and open the graphics context.
        play_demonstration(rig, settings, settings.pairs()[0])
        start, frames = time.perf_counter(), 0
        for pair in settings.pairs()[: 1 if quick else 3]:
            frames += play_demonstration(rig, settings, pair).length
        rate = frames / (time.perf_counter() - start)
        results += [
            Measurement(name=name, value=rate, unit="steps/s"),
            Measurement(name=name, value=rate / settings.fps, unit="x real time"),
        ]
    return results


def measure_demonstrations(*, quick: bool, workers: int) -> list[Measurement]:
    """Measure recording, from nothing to a finished dataset."""
    from lerobot_excav.datasets.record.demonstrations import record_demonstrations

    settings = DemonstrationSettings(scenes=1 if quick else 3, keep_failures=True)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "dataset"
        summary = record_demonstrations(settings, out, workers=workers, show_progress=False)
    name = f"demonstrations, {workers} workers, start included"
    return [
        Measurement(name=name, value=60.0 * summary.episodes / summary.wall_s, unit="episodes/min"),
        Measurement(name=name, value=summary.simulated_s / summary.wall_s, unit="x real time"),
    ]


def measure_writing(*, quick: bool) -> list[Measurement]:
    """Measure storing and assembling alone: frames through the episode store and LeRobot's writer."""
    from lerobot_excav.datasets.record.assembly import append_episode, create_dataset
    from lerobot_excav.datasets.record.episode_store import EpisodeStore

    settings = DemonstrationSettings(scenes=1, episode_length=40 if quick else 120, keep_failures=True)
    pair = settings.pairs()[0]
    episode = play_demonstration(ExcavatorRig(), settings, pair)
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
    return [Measurement(name="writing frames alone", value=frames / elapsed, unit="frames/s")]


def measure_policies(*, quick: bool) -> list[Measurement]:
    """Measure `mask_act` beside LeRobot's ACT."""
    from lerobot_excav.policies.mask_act.benchmark import measure_policies as measure

    results = []
    for speed in measure(rounds=2 if quick else 5):
        results += [
            Measurement(name=f"training {speed.name}", value=speed.training_samples_per_s, unit="samples/s"),
            Measurement(name=f"planning {speed.name}", value=speed.inference_ms, unit="ms per chunk"),
        ]
    return results


def measures(*, workers: int) -> dict[str, Callable[[bool], list[Measurement]]]:
    """Return what can be measured, by name; each takes whether to be quick.

    Args:
        workers: Worker processes of the demonstrations.
    """
    return {
        "soil": lambda quick: measure_soil(quick=quick),
        "environment": lambda quick: measure_environment(quick=quick),
        "writing": lambda quick: measure_writing(quick=quick),
        "demos": lambda quick: measure_demonstrations(quick=quick, workers=workers),
        "policy": lambda quick: measure_policies(quick=quick),
    }
