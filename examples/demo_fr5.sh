#!/usr/bin/env bash
# The trained policy of this repository at work: it puts the block that the mask names into the tray, whichever it is.
# Usage: examples/demo_fr5.sh OUTPUT_FOLDER
set -euo pipefail
OUT=${1:?usage: demo_fr5.sh OUTPUT_FOLDER}
CHECKPOINT=${DEMO_CHECKPOINT:-checkpoints/fr5_grasp_mask_act}
EPISODES=${DEMO_EPISODES:-4} # test scenes, each played with the correct mask and with that of another block

source "$(dirname "$0")/own_folder.sh"
require_checkpoint "$CHECKPOINT"

rm -rf "$OUT/correct" "$OUT/mismatched"
for MASK in correct mismatched; do
  say "Playing $EPISODES test scenes, mask: $MASK -> $OUT/$MASK"
  lerobot-eval --policy.path="$CHECKPOINT" --policy.device=cpu \
    --env.type=fr5_grasp --env.scene_set=test --env.mask_condition="$MASK" \
    --env.metrics_path="$OUT/$MASK/metrics.jsonl" \
    --eval.n_episodes="$EPISODES" --eval.batch_size=1 --output_dir="$OUT/$MASK"
done

say "Result"
lerobot-excav report "$OUT/correct" "$OUT/mismatched"
lerobot-excav report --rows=examples/demo_fr5_rows.toml --metrics_folder="$OUT" --out="$OUT/report"
echo "table:  $OUT/report/report.md"
echo "video:  $OUT/report/rollouts.mp4  (the mask tinted; above the correct one, below that of another block)"
