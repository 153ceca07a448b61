"""How far a stage is, and whether its result is what the file would make now."""

from lerobot_excav.evaluation.experiment.experiment import Experiment
from lerobot_excav.evaluation.experiment.stage import Stage
from lerobot_excav.evaluation.experiment.stage_record import read_record

REASONS = {
    "changed": "was made by another command, or in another environment, than the file has now",
    "outdated": "was made from a result that has been made anew since",
}
"""Why a result is not what the file would make now, by the stage's state; it is kept all the same."""


def state(experiment: Experiment, stage: Stage) -> str:
    """Say in a word how far a stage is: `finished`, `changed`, `outdated`, `interrupted`, `to do` or `always`.

    A result without a record, made by hand, is trusted.
    """
    if stage.makes is None:
        return "always"
    if not stage.is_finished:
        return "interrupted" if stage.is_started else "to do"
    record = read_record(stage.makes)
    if record is None:
        return "finished"
    if (record.command, record.environment) != (stage.command, experiment.environment):
        return "changed"
    needs = made_from(experiment, stage)
    remade = any(needs.get(name, made) != made for name, made in record.needs.items())
    return "outdated" if remade else "finished"


def made_from(experiment: Experiment, stage: Stage) -> dict[str, str]:
    """Return when the needed results were made, by their stages, of those that have a record."""
    results = {name: experiment.stage(name).makes for name in stage.needs}
    records = {name: read_record(makes) for name, makes in results.items() if makes is not None}
    return {name: record.made for name, record in records.items() if record and record.made}
