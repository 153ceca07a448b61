"""What an experiment is: its source, what it measures, its gate, and how it is run."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from tqdm import tqdm

from lerobot_excav.errors import require
from validation.soil.results import Check, Result


@dataclass(frozen=True, kw_only=True)
class Conditions:
    """Under which conditions the experiments run."""

    # Experiments that compare soils, or that were made with one sand, say so and do not follow the preset.
    preset: str = "sand"
    fidelity: str = "standard"
    seeds: tuple[int, ...] = (0, 1, 2)  # each repeats the random parts: arrangement of parcels, their jitter
    quick: bool = False  # leaves out repetitions and coarsens series; gates stay as they are

    def __post_init__(self) -> None:
        require(len(self.seeds) >= 1, "--seeds is empty; give at least one, as in --seeds=0")
        require(min(self.seeds) >= 0, f"--seeds={self.seeds}; allowed: 0 and above")

    @property
    def repeats(self) -> tuple[int, ...]:
        """The seeds with which an experiment is repeated."""
        return self.seeds[:1] if self.quick else self.seeds


@dataclass(frozen=True, kw_only=True)
class SoilExperiment:
    """One experiment: how it is run, and in words where its numbers come from, what it measures and its gate."""

    run: Callable[[Conditions], Result]
    name: str  # that of its file, as in `--only`
    title: str
    source: str
    measures: str
    gate: str
    reasons: dict[str, str] = field(default_factory=dict)  # why a check may miss, by the start of its name
    is_timed: bool = False  # its values depend on the machine: they are reported but decide nothing

    @property
    def anchor(self) -> str:
        """Where a link to its section of the report leads, as Markdown names it."""
        title = self.title.lower().replace(" ", "-")
        return "".join(c for c in title if c.isalnum() or c == "-")

    def reason(self, check: Check) -> str:
        """Return why a check may miss; empty if nobody has found out."""
        return next((text for start, text in self.reasons.items() if check.name.startswith(start)), "")


def experiment(**words: Any) -> Callable[[Callable[[Conditions], Result]], SoilExperiment]:
    """Make an experiment of a function; the words are the other fields of `SoilExperiment`."""
    return lambda run: SoilExperiment(run=run, **words)


def track[Item](items: Iterable[Item], label: str) -> Iterator[Item]:
    """Yield the items of a long series while a bar on a terminal counts them; silent in files and tests."""
    yield from tqdm(items, desc=label, leave=False, disable=None)
