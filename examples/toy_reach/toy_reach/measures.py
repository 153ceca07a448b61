"""What is measured of the task, and how reports show it."""

from typing import TYPE_CHECKING, Any

from lerobot_excav.envs.tasks.measures import Column, EpisodeRecord, Kind, TaskMeasures

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray


class ReachRecord(EpisodeRecord):
    """Outcome of one episode.

    Attributes:
        table: What the table was made of.
        final_distance_m: Distance from the spot at the end [m].
    """

    table: str
    final_distance_m: float


def reach_outcome(task_state: "NDArray[Any]") -> dict[str, Any]:
    """Return the final distance [m] from the task states of an episode, (n, 2)."""
    return {"final_distance_m": float(task_state[-1, 0])}


def reach_summary(index: "pd.DataFrame") -> str:
    """Describe the outcomes of an index."""
    return f"final distance: {index['final_distance_m'].mean():.2f} m on average"


REACH_MEASURES = TaskMeasures(
    record=ReachRecord,
    settings={"table": "tables"},
    shared={},
    setting={"table": "table", "mask": "mask"},
    columns=(
        Column(key="success", header="success [%]", kind=Kind.RATE, field="is_success"),
        Column(key="final_distance_m", header="distance [m]", kind=Kind.MEAN, field="final_distance_m"),
    ),
    compared=("success", "final_distance_m"),
    world="was played on {table} in version {simulation_version} of the simulation",
    simulation="version {simulation_version}",
    legend=lambda operator: [] if operator is None else [f"Operator: {operator}."],
    outcome=reach_outcome,
    summary=reach_summary,
)
