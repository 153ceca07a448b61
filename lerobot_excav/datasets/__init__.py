"""Datasets of paired demonstrations.

- `environment`: what differs between environments; `environments` lists them, `excavator_environment` and
  `fr5_grasp_environment` describe them.
- `schema`: what a frame holds. `storage`: how its pictures are kept. `episode_table`: reading it back, episode by
  episode, with `pictures`.
- `demonstrations`: recording with the scripted operator; `demonstration_settings`, `target_rule`, `rig`, `episode`,
  `simulation`, `workers`, `episode_store`, `partial_run`, `assembly`, `progress` and `provenance` are its parts.
- `paired_index`: one row per episode; `pair_coverage`, `selection` and `split` work on it.
- `resimulation`: completing what `lerobot-record` recorded, from its `session` log, after `recording_check`.
- `quality_check`: `episode_check` and `replay_check` over a dataset. `version_check`: which simulation made it.
- `json_lines`: reading session logs and metrics files.
"""
