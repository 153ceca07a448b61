/* Two sticks on the screen: they show where the sticks are, what each direction does, and can be dragged. */

const SVG = "http://www.w3.org/2000/svg";
const REACH = 52; // of the knob, in the drawing's units
const LIT = 0.15; // deflection from which on a word lights up
const PLACES = [[-1, 0], [1, 0], [0, -1], [0, 1]]; // left, right, up, down

export class Hand {
  constructor(svg, sticks, first) {
    this.svg = svg;
    this.axes = [first, first + 1];
    this.make("circle", { class: "ring", r: REACH });
    this.knob = this.make("circle", { class: "knob", r: 16 });
    this.words = PLACES.map(([x, y]) => this.make("text", { x: 100 * x, y: 92 * y + 5 }));
    const drag = (event) => {
      const box = svg.getBoundingClientRect();
      const scale = 220 / box.width;
      const x = ((event.clientX - box.left) * scale - 110) / REACH;
      const y = ((event.clientY - box.top) * scale - 110) / REACH;
      sticks.screen[first] = Math.max(-1, Math.min(1, x));
      sticks.screen[first + 1] = Math.max(-1, Math.min(1, y));
    };
    const rest = () => { sticks.screen[first] = sticks.screen[first + 1] = 0; };
    svg.addEventListener("pointerdown", (event) => { svg.setPointerCapture(event.pointerId); drag(event); });
    svg.addEventListener("pointermove", (event) => svg.hasPointerCapture(event.pointerId) && drag(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) svg.addEventListener(end, rest);
  }

  make(name, attributes) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    this.svg.append(element);
    return element;
  }

  /* Show the sticks, and the words of a control pattern: [negative, positive] of both axes. */
  show(axes, words, isLive) {
    const [x, y] = this.axes.map((i) => axes[i]);
    this.knob.setAttribute("cx", x * REACH);
    this.knob.setAttribute("cy", y * REACH);
    const values = [-x, x, -y, y];
    words.flat().forEach((word, i) => {
      this.words[i].replaceChildren(...this.lines(word, i));
      this.words[i].classList.toggle("lit", values[i] > LIT);
    });
    this.svg.parentElement.classList.toggle("live", isLive);
  }

  /* Words at the sides stand one below the other, or they would run out of the drawing. */
  lines(word, place) {
    if (place > 1) return [word];
    return word.split(" ").map((part, i, parts) => {
      const line = document.createElementNS(SVG, "tspan");
      line.setAttribute("x", this.words[place].getAttribute("x"));
      line.setAttribute("dy", i ? 16 : -8 * (parts.length - 1));
      line.textContent = part;
      return line;
    });
  }
}
