#!/usr/bin/env bash
# The trained policy of this repository at work: it puts the block that the mask names into the tray, whichever it is.
# Usage: examples/demo_fr5.sh OUTPUT_FOLDER
set -euo pipefail
OUT=${1:?usage: demo_fr5.sh OUTPUT_FOLDER}
CHECKPOINT=${DEMO_CHECKPOINT:-checkpoints/fr5_grasp_mask_act}
EPISODES=${DEMO_EPISODES:-4} # test scenes, each played with the correct mask and with that of another block

if [ ! -f "$CHECKPOINT/config.json" ]; then
  echo "demo_fr5.sh: $CHECKPOINT holds no policy; run this in a clone of the repository, or name the pretrained_model" >&2
  echo "  folder of a training: make demo-fr5 DEMO_CHECKPOINT=FOLDER" >&2
  exit 2
fi

# Folders in it are removed by name, so it has to be a folder of this script.
if [ -n "$(ls -A "$OUT" 2>/dev/null)" ] && [ ! -f "$OUT/.made_by_demo_fr5.sh" ]; then
  echo "demo_fr5.sh: $OUT holds something that this script has not made; move it elsewhere, or name another folder:" >&2
  echo "  examples/demo_fr5.sh FOLDER" >&2
  exit 2
fi
mkdir -p "$OUT"
touch "$OUT/.made_by_demo_fr5.sh"

say() { printf '\n\033[1m%s\033[0m\n' "$*"; }

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
