"""Datasets of paired demonstrations.

- `schema`: what a frame holds. `episode_table`: reading it back, episode by episode.
- `demonstrations`: recording with the scripted operator; `demonstration_settings`, `rig`, `episode`, `simulation`,
  `workers`, `episode_store`, `partial_run`, `assembly`, `progress` and `provenance` are its parts.
- `paired_index`: one row per episode; `pair_coverage`, `selection` and `split` work on it.
- `resimulation`: completing what `lerobot-record` recorded, from its `session` log, after `recording_check`.
- `quality_check`: `episode_check` and `replay_check` over a dataset. `version_check`: which simulation made it.
- `json_lines`: reading session logs and metrics files.
"""
