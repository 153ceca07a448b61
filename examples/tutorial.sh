#!/usr/bin/env bash
# From nothing to a policy that digs where it is pointed at: record, train, evaluate, with LeRobot's own commands.
# Usage: examples/tutorial.sh OUTPUT_FOLDER      Steps that are finished are not run again; delete the folder to start over.
set -euo pipefail
OUT=${1:?usage: tutorial.sh OUTPUT_FOLDER}
SCENES=${TUTORIAL_SCENES:-30}     # piles of the set train
STAGES=${TUTORIAL_STAGES:-0,1-13} # each as it is drawn, and after 1 to 13 dug cycles; x 4 targets = paired demonstrations
STEPS=${TUTORIAL_STEPS:-7500}     # training steps
EPISODES=${TUTORIAL_EPISODES:-10} # evaluation episodes, on test scenes
export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1} # the network is small: more threads wait for each other
source "$(dirname "$0")/own_folder.sh"

say "1/4  Recording up to 4 paired demonstrations of $SCENES piles at stages $STAGES -> $OUT/dataset"
[ -d "$OUT/dataset" ] || lerobot-excav demos --env.type=excavator --scenes="$SCENES" --stages="$STAGES" --targets=4 \
  --keep_failures=true --storage=video --out="$OUT/dataset" --resume=true

say "2/4  Looking at what was recorded"
lerobot-excav qc "$OUT/dataset"
lerobot-excav index "$OUT/dataset"

say "3/4  Training mask_act for $STEPS steps -> $OUT/train"
[ -f "$OUT/train.done" ] || {
  rm -rf "$OUT/train"
  lerobot-train --policy.type=mask_act --policy.preset=fast --policy.n_encoder_layers=1 --policy.target_token=true \
    --policy.chunk_size=10 --policy.n_action_steps=5 --policy.actions_per_token=1 --policy.device=cpu \
    --policy.push_to_hub=false \
    --dataset.repo_id=local/tutorial --dataset.root="$OUT/dataset" --output_dir="$OUT/train" \
    --steps="$STEPS" --batch_size=16 --num_workers=1 --log_freq=50 --save_freq=1500 --env_eval_freq=0 --wandb.enable=false
  touch "$OUT/train.done"
}

say "4/4  Evaluating on $EPISODES test scenes -> $OUT/eval"
rm -rf "$OUT/eval" "$OUT/metrics.jsonl"
lerobot-eval --policy.path="$OUT/train/checkpoints/last/pretrained_model" --policy.device=cpu \
  --env.type=excavator --env.scene_set=test --env.metrics_path="$OUT/metrics.jsonl" \
  --eval.n_episodes="$EPISODES" --eval.batch_size=1 --output_dir="$OUT/eval"

say "Result"
lerobot-excav report "$OUT/metrics.jsonl" --out="$OUT/report"
echo "table:  $OUT/report"
echo "video:  $(find "$OUT/eval" -name '*.mp4' | sort | head -1)"
