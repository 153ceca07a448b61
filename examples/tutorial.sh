#!/usr/bin/env bash
# From nothing to a policy that digs: record, train, evaluate, with LeRobot's own commands.
# Usage: examples/tutorial.sh OUTPUT_FOLDER      Steps that are finished are not run again; delete the folder to start over.
set -euo pipefail
OUT=${1:?usage: tutorial.sh OUTPUT_FOLDER}
SCENES=${TUTORIAL_SCENES:-6}     # x 4 targets = paired demonstrations
STEPS=${TUTORIAL_STEPS:-900}     # training steps
EPISODES=${TUTORIAL_EPISODES:-4} # evaluation episodes, on test scenes
source "$(dirname "$0")/own_folder.sh"

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
