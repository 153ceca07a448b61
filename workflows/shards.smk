"""Shards: ranges of scenes that are recorded or played apart, on as many machines as there are."""

import json
from pathlib import Path

from snakemake.exceptions import WorkflowError


def step_name(checkpoint):
    """Return the folder of a checkpoint, which Snakemake reads as a number: LeRobot writes at least six digits."""
    return f"{checkpoint:06d}" if isinstance(checkpoint, int) else checkpoint


def ranges(count, shards):
    """Divide `count` scenes into at most `shards` ranges of nearly equal length: pairs of first and number."""
    edges = [round(count * i / shards) for i in range(shards + 1)]
    return [(first, end - first) for first, end in zip(edges, edges[1:]) if end > first]


def unless_there(made, needed):
    """Return what a rule needs, or nothing if what it makes is there: Snakemake would make all of it again.

    In how many parts something was made does not matter to what it is.
    """
    return [] if Path(made).exists() else needed


def keep_videos(out, name, number):
    """Return what puts the videos of the first part of a row where the page looks for them, in place of older ones."""
    folder = f"{out}/videos/{name}"
    return f" && rm -rf {folder} && mkdir -p {folder} && cp -r {out}/play/{name}/0-{number}/videos {folder}/"


def lines_of_part(part):
    """Return the episodes of a part, `FIRST-NUMBER.jsonl`.

    Two runs of a workflow without a lock may play a part at the same time, into one file: a row would count its scenes
    twice, or lack some.

    Raises:
        WorkflowError: The part holds several evaluations, or another number of episodes.
    """
    lines = [json.loads(line) for line in Path(part).read_text(encoding="utf-8").splitlines()]
    if len({line.get("evaluation") for line in lines}) > 1:
        raise WorkflowError(f"{part} holds several evaluations, and one is allowed; remove it, to play it again")
    if len(lines) != int(Path(part).stem.partition("-")[2]):
        raise WorkflowError(f"{part} holds {len(lines)} episodes, not as many as its name says; remove it, to play it again")
    return lines


def record_with_training(metrics):
    """Return the record beside a metrics file, with how its policy was trained: its folder does not land, and is gone one day.

    Paths are as seen from here.
    """
    from lerobot_excav.evaluation.provenance import EvaluationOrigin  # takes a second, which a dry run need not wait

    text = EvaluationOrigin.read(Path(metrics)).model_dump_json(indent=1) + "\n"
    return text.replace(f'"{Path.cwd().resolve()}/', '"')


def merge_metrics(parts, whole, *, keep_training=False):
    """Put metrics files together in their order, and say where the whole comes from.

    Episodes are the same as in one run, and numbered so: a reader takes a file whose numbers begin again for several
    evaluations, of which the last one counts. Commands are all of them, seconds their sum; where parts were played by
    other code, the commands say by which; `keep_training` writes down how the policy was trained. The whole appears when all
    of it is written.

    Raises:
        WorkflowError: There are none, since the row was there when a run was stopped; parts are of other policies, were played
            with other versions of packages, or one was played twice.
    """
    whole = Path(whole)
    if not parts:
        raise WorkflowError(f"{whole} was being written when a run was stopped, and Snakemake removes it; start again")
    lines = [line for part in parts for line in lines_of_part(part)]
    first = {"evaluation": lines[0]["evaluation"]} if "evaluation" in lines[0] else {}
    origins = [json.loads(Path(part).with_suffix(".json").read_text(encoding="utf-8")) for part in parts]
    for name in ("policy", "packages"):
        if differing := [str(part) for part, origin in zip(parts, origins) if origin[name] != origins[0][name]]:
            raise WorkflowError(
                f"{name} of {', '.join(differing)} differs from that of {parts[0]}; remove one side, to play it again"
            )
    commits = list(dict.fromkeys(str(origin["commit"]) for origin in origins))
    merged = {
        **origins[0],
        "command": " && ".join(origin["command"] for origin in origins)
        + (f"  # parts by commits {', '.join(commits)}" if len(commits) > 1 else ""),
        "seconds": sum(origin["seconds"] or 0.0 for origin in origins),
        "modified": any(origin["modified"] for origin in origins),
    }
    whole.with_suffix(".json").write_text(json.dumps(merged, indent=1) + "\n", encoding="utf-8")
    if keep_training:
        whole.with_suffix(".json").write_text(record_with_training(whole), encoding="utf-8")
    text = "".join(json.dumps({**line, **first, "episode_ix": number}) + "\n" for number, line in enumerate(lines))
    unfinished = whole.with_suffix(".tmp")
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(whole)


def remove_parts(parts):
    """Remove metrics files whose whole is written, with what says where they come from, and their folder if empty."""
    for part in map(Path, parts):
        part.unlink()
        part.with_suffix(".json").unlink()
    for folder in {Path(part).parent for part in parts}:
        if not any(folder.iterdir()):
            folder.rmdir()
