/* The panels of numbers and of the recording. */

const UNITS = { kg: 0, m: 2 }; // decimals

const $ = (id) => document.getElementById(id);

/* Show what is measured: bucket_mass_kg becomes "bucket mass", "431 kg". */
export function showGauges(state) {
  $("measured").textContent = [...state.measured, ...(state.outcome ? [state.outcome] : [])].join(" · ");
  const rows = Object.entries(state.task_state).flatMap(([name, value]) => {
    const [, words, unit] = name.match(/^(.*?)(?:_(kg|m))?$/);
    const term = document.createElement("dt");
    const data = document.createElement("dd");
    term.textContent = words.replaceAll("_", " ");
    data.textContent = unit ? `${value.toFixed(UNITS[unit])} ${unit}` : String(value);
    return [term, data];
  });
  $("state").replaceChildren(...rows);
}

export function showRecording(state, isDriver) {
  const recording = state.recording;
  $("recording").hidden = !recording;
  if (!recording) return;
  const { next, verdict } = recording;
  const where = next ? `next: scene ${next.scene_id}${next.stage ? `, ${next.stage} cycles dug` : ""}, target ${next.target_id + 1}` : "all are recorded";
  $("next").textContent = recording.complete
    ? `written: ${recording.out}`
    : recording.running ? `recording, ${recording.frames} frames` : `${where}; ${recording.left} of ${recording.count} left, ${recording.kept} kept`;
  $("progress").value = recording.count ? 1 - recording.left / recording.count : 1;
  $("record").disabled = !isDriver || recording.running || Boolean(verdict) || !next || recording.complete;
  $("finish").disabled = !isDriver || !recording.frames;
  $("skip").disabled = !isDriver || Boolean(verdict) || recording.frames > 0 || !next || recording.complete;
  for (const id of ["drive", "work", "once"]) if (verdict) $(id).disabled = true;
  $("complete").disabled = !isDriver || recording.running || Boolean(verdict) || !recording.kept || recording.complete;
  $("complete").classList.toggle("wanted", !recording.left && !recording.complete && !verdict);
  $("verdict").hidden = !verdict;
  if (verdict) $("judged").textContent = `${verdict.success ? "success" : "no success"}, ${verdict.frames} frames:`;
}
