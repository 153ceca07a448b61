/* The page: shows moments as they come, and sends what the person does. */

import { Hand } from "./hands.js";
import { Link } from "./link.js";
import { Pointing } from "./pointing.js";
import { showGauges, showRecording } from "./panels.js";
import { AXES, Sticks } from "./sticks.js";

const SEND_MS = 20; // sticks are sent at 50 Hz
const STOP_KEYS = ["Space", "Escape"];
const WISH_KEYS = { KeyR: "record", KeyF: "finish", KeyK: "keep", KeyN: "again", KeyB: "restart", KeyX: "next-scene" }; // ids of buttons
const PAD_WISHES = { 0: "work", 1: "stop", 9: "record" }; // A, B and Start of a gamepad
const KEPT_MOMENTS = 400;

const $ = (id) => document.getElementById(id);
const sticks = new Sticks();
const hands = [new Hand($("left"), sticks, 0), new Hand($("right"), sticks, 2)];
const sent = new Map(); // when each message of the sticks was sent [ms]
let state = null;
let number = 0;

const wish = (message) => link.send({ values: {}, ...message });
const pointing = new Pointing($("overlay"), (message) => wish(message));
const isDriver = () => state !== null && state.driver === "you";

async function drawPicture(name, blob) {
  const canvas = $(`view-${name}`);
  if (!canvas) return;
  const bitmap = await createImageBitmap(blob);
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
    canvas.width = bitmap.width;
    canvas.height = bitmap.height;
  }
  canvas.getContext("2d").drawImage(bitmap, 0, 0);
  bitmap.close();
}

/* Draw a moment; return the time from stick to picture [ms], or null if the sticks were not part of it. */
async function showMoment(moment, pictures) {
  state = moment;
  const { sticks_number: acted, mode } = moment; // another moment may come while this one is drawn
  document.body.dataset.frame = state.frame;
  await Promise.all(Object.entries(pictures).map(([name, blob]) => drawPicture(name, blob)));
  await new Promise((resolve) => (document.hidden ? resolve() : requestAnimationFrame(resolve)));
  const main = $("view-main");
  pointing.isOffered = state.offers.includes("point") && isDriver();
  pointing.show(state.targets, state.target, [main.width, main.height]);
  showHeader();
  showGauges(state);
  showRecording(state, isDriver());
  const sentAt = sent.get(acted);
  const isNew = Object.keys(pictures).length > 0;
  const delay = isNew && isDriver() && mode === "drive" && sentAt !== undefined ? performance.now() - sentAt : null;
  const speed = state.speed < 0.95 ? `, ${Math.round(100 * state.speed)} % of real time` : "";
  if (delay !== null) $("delay").textContent = `stick to picture ${Math.round(delay)} ms${speed}`;
  else if (state.mode === "still") $("delay").textContent = "";
  return delay;
}

function showHeader() {
  $("task").textContent = state.task;
  const stage = state.scene.stage ? `, ${state.scene.stage} cycles dug` : "";
  $("scene").textContent = `scene ${state.scene.scene_id} of ${state.scene.set}${stage}: ${state.task_description}`;
  showStart();
  const names = { still: "time stands still", drive: state.taken_over ? "you drive, taken over" : "you drive", work: state.offers.includes("drive") ? "the policy works" : "the recording plays" };
  $("mode").textContent = names[state.mode];
  $("mode").dataset.mode = state.mode;
  $("driver").textContent = { you: "you have the controls", nobody: "nobody has the controls" }[state.driver] ?? "another page has the controls";
  $("driver").dataset.driver = state.driver;
  const waits = isDriver() && state.mode === "drive" && !state.ready;
  $("words").textContent = waits ? "let go of the sticks: they count once they were centred" : state.words;
  $("words").classList.toggle("fault", state.fault && !waits);
  $("take").textContent = isDriver() ? "Give the controls up" : state.driver === "nobody" ? "Take the controls" : "Take them from the other page";
  for (const part of document.querySelectorAll("[data-wish], [data-offer]")) {
    part.hidden = !state.offers.includes(part.dataset.wish ?? part.dataset.offer);
    if (part.dataset.wish) part.disabled = !isDriver();
  }
  $("work").disabled = $("once").disabled = !isDriver() || state.over;
  const isShown = !state.offers.includes("drive") && state.offers.includes("work"); // a recording
  $("work").textContent = isShown ? "Play" : state.taken_over ? "Hand back" : "Let it work";
  if (!state.task.startsWith("Clear")) $("once").hidden = true;
  if (state.recording) $("restart").hidden = true; // the recording has a button of its own
  $("drive").disabled = !isDriver() || state.over;
  $("plan").hidden = !state.views.includes("plan");
  $("stage-field").hidden = !state.last_stage;
  const words = state.legend[$("pattern").value];
  const axes = isDriver() ? sticks.axes() : AXES.map((axis) => state.axes[axis]);
  const turned = [...document.querySelectorAll("input[name=invert]:checked")].map((input) => input.value);
  const said = (axis) => (turned.includes(axis) ? [...words[axis]].reverse() : words[axis]);
  hands.forEach((hand) => hand.show(axes, hand.axes.map((i) => said(AXES[i])), isDriver() && state.ready));
  for (const part of document.querySelectorAll("#start input, #start button")) part.disabled = !isDriver();
  $("device").textContent = sticks.names?.length ? sticks.names.join(" and ") : "keys and on-screen sticks";
}

/* The form of the scene shows the present one, until a person changes it. */
function showStart() {
  const form = $("start");
  if (form.dataset.scene === JSON.stringify(state.scene)) return;
  form.dataset.scene = JSON.stringify(state.scene);
  form.elements.scene_id.value = state.scene.scene_id;
  form.elements.stage.value = state.scene.stage;
  form.elements.stage.max = state.last_stage;
}

function sendSticks() {
  const axes = sticks.axes();
  if (!isDriver() || document.hidden) return;
  number += 1;
  sent.set(number, performance.now());
  sent.delete(number - KEPT_MOMENTS);
  link.send({ kind: "sticks", axes, number, lost: sticks.takeLost() });
  for (const button of sticks.takePressed()) {
    const control = $(PAD_WISHES[button]);
    if (control && !control.disabled && control.offsetParent) wish({ kind: control.dataset.wish });
  }
}

function sendResponse() {
  const invert = [...document.querySelectorAll("input[name=invert]:checked")].map((input) => input.value);
  const response = { pattern: $("pattern").value, dead_zone: Number($("dead_zone").value), expo: Number($("expo").value), invert };
  localStorage.setItem("response", JSON.stringify(response));
  link.send({ kind: "response", ...response });
}

function recallResponse() {
  const kept = JSON.parse(localStorage.getItem("response") ?? "null");
  if (!kept) return;
  for (const name of ["pattern", "dead_zone", "expo"]) $(name).value = kept[name];
  for (const input of document.querySelectorAll("input[name=invert]")) input.checked = kept.invert.includes(input.value);
}

function onKey(event, isDown) {
  const isTyping = event.target.matches("input[type=number], select");
  if (!isDown) sticks.key(event.code, false); // whatever else is pressed, or a key would stick
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (isDown && !isTyping && sticks.key(event.code, true)) event.preventDefault();
  if (!isDown || event.repeat || !isDriver()) return;
  if (isTyping && !STOP_KEYS.includes(event.code)) return;
  if (STOP_KEYS.includes(event.code)) {
    event.preventDefault();
    wish({ kind: "stop" });
  } else if (event.code in WISH_KEYS) {
    const button = $(WISH_KEYS[event.code]);
    if (!button.disabled && button.offsetParent) wish({ kind: button.dataset.wish });
  }
}

let refusals = 0; // in a row
const link = new Link(showMoment, (isOpen) => {
  refusals = isOpen ? 0 : refusals + 1;
  const lost = refusals > 3 ? "not connected: open the address that the command printed" : "not connected";
  $("link").textContent = isOpen ? "connected" : lost;
  $("link").dataset.link = isOpen ? "open" : "lost";
  if (isOpen) link.send({ kind: "take", force: false });
  if (isOpen) sendResponse();
});

$("take").addEventListener("click", () => {
  link.send(isDriver() ? { kind: "leave" } : { kind: "take", force: true });
  sendResponse();
});
for (const button of document.querySelectorAll("[data-wish]")) {
  button.addEventListener("click", () => {
    wish({ kind: button.dataset.wish, values: button.dataset.once ? { once: 1 } : {} });
    button.blur(); // or the space bar, which stops, would press it again
  });
}
$("start").addEventListener("submit", (event) => {
  event.preventDefault();
  const form = new FormData(event.target);
  const values = { scene_id: Number(form.get("scene_id")) };
  if (state.last_stage) values.stage = Number(form.get("stage"));
  wish({ kind: "start", values });
  document.activeElement.blur();
});
for (const id of ["pattern", "dead_zone", "expo"]) {
  $(id).addEventListener("change", (event) => { sendResponse(); event.target.blur(); }); // or arrows would change it
}
$("pads").addEventListener("change", (event) => { sticks.usesPads = event.target.checked; event.target.blur(); });
for (const input of document.querySelectorAll("input[name=invert]")) input.addEventListener("change", sendResponse);
addEventListener("keydown", (event) => onKey(event, true));
addEventListener("keyup", (event) => onKey(event, false));
addEventListener("gamepadconnected", () => sticks.axes());
recallResponse();
setInterval(sendSticks, SEND_MS);
