# Sourced: makes the output folder OUT of a script, and stays out of one that the script has not made.
# Folders in it are removed by name, so it has to be a folder of the script.
NAME=$(basename "$0")
if [ -n "$(ls -A "$OUT" 2>/dev/null)" ] && [ ! -f "$OUT/.made_by_$NAME" ]; then
  echo "$NAME: $OUT holds something that this script has not made; move it elsewhere, or name another folder:" >&2
  echo "  examples/$NAME FOLDER" >&2
  exit 2
fi
mkdir -p "$OUT"
touch "$OUT/.made_by_$NAME"

say() { printf '\n\033[1m%s\033[0m\n' "$*"; }

require_checkpoint() {
  if [ ! -f "$1/config.json" ]; then
    echo "$NAME: $1 holds no policy; run this in a clone of the repository, or name the pretrained_model folder of a" >&2
    echo "  training: DEMO_CHECKPOINT=FOLDER examples/$NAME $OUT" >&2
    exit 2
  fi
}
