/* Where the sticks are: gamepads, keys, and the sticks on the screen. x to the right, y towards the operator. */

export const AXES = ["left_x", "left_y", "right_x", "right_y"];

const KEYS = {
  KeyA: [0, -1], KeyD: [0, 1], KeyW: [1, -1], KeyS: [1, 1],
  ArrowLeft: [2, -1], ArrowRight: [2, 1], ArrowUp: [3, -1], ArrowDown: [3, 1],
};

export class Sticks {
  constructor() {
    this.keys = new Set();
    this.screen = [0, 0, 0, 0];
    this.pads = [];        // ids of the pads in use
    this.isLost = false;   // whether one of them is gone, or new
    this.usesPads = true;
    addEventListener("blur", () => this.release());
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
  }

  release() {
    this.keys.clear();
    this.screen = [0, 0, 0, 0];
  }

  /* Take note of a key; tell whether it is one of the sticks'. */
  key(code, isDown) {
    if (!(code in KEYS)) return false;
    if (isDown) this.keys.add(code); else this.keys.delete(code);
    return true;
  }

  /* Return the four axes in [-1, 1]: of all sources, the one that is deflected most. */
  axes() {
    const sources = [this.screen, this.keyAxes(), this.padAxes()];
    return AXES.map((_, i) => sources.map((axes) => axes[i]).reduce((a, b) => (Math.abs(b) > Math.abs(a) ? b : a), 0));
  }

  keyAxes() {
    const axes = [0, 0, 0, 0];
    for (const code of this.keys) axes[KEYS[code][0]] += KEYS[code][1];
    return axes;
  }

  /* One gamepad that the browser knows, or the first two sticks of other devices, the left hand's first. */
  padAxes() {
    const pads = this.usesPads ? [...navigator.getGamepads()].filter((pad) => pad?.connected && pad.axes.length >= 2) : [];
    const whole = pads.find((pad) => pad.mapping === "standard" && pad.axes.length >= 4);
    const used = whole ? [whole] : pads.slice(0, 2);
    const ids = used.map((pad) => `${pad.index}:${pad.id}`);
    // A pad that comes back may be held over, so it has to be centred as one that is lost.
    if (this.usesPads && ids.join() !== this.pads.join()) this.isLost = true;
    this.pads = ids;
    this.names = used.map((pad) => pad.id.split("(")[0].trim());
    // Buttons of other devices have no names: a trigger is no wish.
    this.pressed = whole ? whole.buttons.map((button, i) => (button.pressed ? i : -1)).filter((i) => i >= 0) : [];
    const values = whole ? whole.axes.slice(0, 4) : used.flatMap((pad) => pad.axes.slice(0, 2));
    return AXES.map((_, i) => Math.max(-1, Math.min(1, values[i] ?? 0)));
  }

  /* Tell once that the pads in use are others than before: one is gone, or one has come. */
  takeLost() {
    const lost = this.isLost;
    this.isLost = false;
    return lost;
  }

  /* Return the number of every pad button that has just been pressed. */
  takePressed() {
    const now = new Set(this.pressed ?? []);
    const fresh = [...now].filter((i) => !(this.down ?? now).has(i));
    this.down = now;
    return fresh;
  }
}
