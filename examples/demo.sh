#!/usr/bin/env bash
# From nothing to a policy that digs: record, train, evaluate, with LeRobot's own commands.
# Usage: examples/demo.sh OUTPUT_FOLDER      Steps that are finished are not run again; delete the folder to start over.
set -euo pipefail
OUT=${1:?usage: demo.sh OUTPUT_FOLDER}
SCENES=${DEMO_SCENES:-6}     # x 4 targets = paired demonstrations
STEPS=${DEMO_STEPS:-900}     # training steps
EPISODES=${DEMO_EPISODES:-4} # evaluation episodes, on test scenes
# Folders in it are removed by name, so it has to be a folder of this script.
if [ -n "$(ls -A "$OUT" 2>/dev/null)" ] && [ ! -f "$OUT/.made_by_demo.sh" ]; then
  echo "demo.sh: $OUT holds something that this script has not made; move it elsewhere, or name another folder:" >&2
  echo "  examples/demo.sh FOLDER" >&2
  exit 2
fi
mkdir -p "$OUT"
touch "$OUT/.made_by_demo.sh"

say() { printf '\n\033[1m%s\033[0m\n' "$*"; }

say "1/3  Recording $((SCENES * 4)) paired demonstrations -> $OUT/dataset"
[ -d "$OUT/dataset" ] || lerobot-excav demos --env.type=excavator --scenes="$SCENES" --targets=4 \
  --out="$OUT/dataset" --resume=true

say "2/3  Training mask_act for $STEPS steps -> $OUT/train"
[ -d "$OUT/train/checkpoints/last" ] || {
  rm -rf "$OUT/train"
  lerobot-train --policy.type=mask_act --policy.preset=fast --policy.target_token=true \
    --policy.chunk_size=10 --policy.actions_per_token=1 --policy.device=cpu --policy.push_to_hub=false \
    --dataset.repo_id=local/excavator_demo --dataset.root="$OUT/dataset" --output_dir="$OUT/train" \
    --steps="$STEPS" --batch_size=16 --num_workers=1 --log_freq=50 --save_freq="$STEPS" --env_eval_freq=0 --wandb.enable=false
}

say "3/3  Evaluating on $EPISODES test scenes -> $OUT/eval"
rm -rf "$OUT/eval" "$OUT/metrics.jsonl"
lerobot-eval --policy.path="$OUT/train/checkpoints/last/pretrained_model" --policy.device=cpu \
  --env.type=excavator --env.scene_set=test --env.metrics_path="$OUT/metrics.jsonl" \
  --eval.n_episodes="$EPISODES" --eval.batch_size=1 --output_dir="$OUT/eval"

[ -f "$OUT/dig.mp4" ] || python -m bench.dig_film "$OUT/dig.mp4"

say "Result"
lerobot-excav report "$OUT/metrics.jsonl" --out="$OUT/report"
echo "table:  $OUT/report"
echo "video:  $(find "$OUT/eval" -name '*.mp4' | sort | head -1)"
echo "film:   $OUT/dig.mp4  (the scripted operator in slow motion)"
