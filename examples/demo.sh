#!/usr/bin/env bash
# The trained policy of this repository clears a pile, cycle by cycle, where it is pointed at.
# Usage: examples/demo.sh OUTPUT_FOLDER
set -euo pipefail
OUT=${1:?usage: demo.sh OUTPUT_FOLDER}
CHECKPOINT=${DEMO_CHECKPOINT:-checkpoints/excavator_mask_act}
SCENE=${DEMO_SCENE:-0} # of the test scenes, none of which a demonstration has seen
EVERY=20               # a frame every two seconds is drawn: a time lapse, twenty times as fast; LeRobot's own video stays tiny
export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1} # the network is small: more threads wait for each other
source "$(dirname "$0")/own_folder.sh"
require_checkpoint "$CHECKPOINT"

say "Clearing the pile of test scene $SCENE -> $OUT"
rm -rf "$OUT/play" "$OUT/film" "$OUT/metrics.jsonl"
lerobot-eval --policy.path="$CHECKPOINT" --policy.device=cpu \
  --env.type=excavator --env.task=Clear-v0 --env.scene_set=test --seed="$SCENE" --policy.n_action_steps=5 --env.camera_every=5 \
  --env.film_folder="$OUT/film" --env.film_every="$EVERY" --env.render_camera=overview_with_side \
  --env.render_every=1000 --env.render_height=32 --env.render_width=32 --env.metrics_path="$OUT/metrics.jsonl" \
  --eval.n_episodes=1 --eval.batch_size=1 --output_dir="$OUT/play"

say "Result"
lerobot-excav report "$OUT/metrics.jsonl" --out="$OUT/report"
echo "video:  $(find "$OUT/film" -name '*.mp4')"
echo "map:    $(find "$OUT/report" -name 'figure_*.png')"
echo "table:  $OUT/report/report.md"
