"""The folders of a workflow: one for what is made again from its seeds, and one for what is kept."""

from pathlib import Path

from snakemake.exceptions import WorkflowError


def folders(config, name):
    """Return both folders, `outputs/NAME` and `results/NAME` or what `--config` says.

    Raises:
        WorkflowError: A number of the experiment is given, and no folder for its results: rows of other settings would
            come to stand among those that have landed.
    """
    own = sorted(config.keys() - {"out", "results", "data_shards", "play_shards"})
    if own and "results" not in config:
        raise WorkflowError(
            f"--config {' '.join(own)} makes rows that are not those of the table, which would count as made; give them "
            "folders of their own, such as out=outputs/trial results=outputs/trial/page"
        )
    return config.get("out", f"outputs/{name}"), config.get("results", f"results/{name}")


def claim(folder, name):
    """Make a folder and mark it as the workflow's: Snakemake and the rules replace files and folders by name.

    Raises:
        WorkflowError: It holds something, and not the mark.
    """
    folder, mark = Path(folder), Path(folder, f".{name}_workflow")
    if folder.exists() and any(folder.iterdir()) and not mark.exists():
        raise WorkflowError(
            f"out={folder} holds something that this workflow has not made; choose another folder, --config out=FOLDER. "
            f"If an earlier version of it has made all of that: touch {mark}"
        )
    folder.mkdir(parents=True, exist_ok=True)
    mark.touch()
