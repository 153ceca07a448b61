"""Demonstrations of every kind of DATA, recorded in parts and put together.

Taken from the workflow: OUT, DATA (flags of every kind), SCENES (how many of each), RECORDING (flags of all), DATA_SHARDS,
and DATASET_NAME.
"""

WORKERS = 2 if DATA_SHARDS == 1 else 0  # one core a shard


def shards_of(data):
    """Return the folders of the parts of a kind of data."""
    return [f"{OUT}/shards/{data}/{first}-{number}" for first, number in ranges(SCENES[data], DATA_SHARDS)]


# Appears when it is complete; an interrupted recording continues from its last episode.
rule data_shard:
    output:
        directory(f"{OUT}/shards/{{data}}/{{first}}-{{number}}"),
    params:
        played=lambda wildcards: DATA[wildcards.data],
    log:
        f"{OUT}/shards/{{data}}/{{first}}-{{number}}.log",
    threads: max(1, WORKERS)
    shell:
        "lerobot-excav demos {RECORDING} --first_scene={wildcards.first} --scenes={wildcards.number} {params.played} "
        "--workers={WORKERS} --out={output} --resume=true > {log} 2>&1"


# LeRobot's own tool puts them together; every shard has its statistics already, and keeps its own video files.
rule data:
    input:
        lambda wildcards: unless_there(f"{OUT}/data/{wildcards.data}", ancient(shards_of(wildcards.data))),
    output:
        directory(f"{OUT}/data/{{data}}"),
    params:
        ids=lambda wildcards, input: str([f"local/{wildcards.data}_{i}" for i, _ in enumerate(input)]),
        roots=lambda wildcards, input: str([str(part) for part in input]),
    log:
        f"{OUT}/data/{{data}}.log",
    shell:
        "lerobot-edit-dataset --new_repo_id=local/{DATASET_NAME}_{wildcards.data} --new_root={output} "
        "--operation.type=merge "
        '--operation.repo_ids="{params.ids}" --operation.roots="{params.roots}" '
        "--operation.concatenate_videos=false > {log} 2>&1"
