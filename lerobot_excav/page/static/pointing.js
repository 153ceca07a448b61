/* The overlay of the main picture: outlines of the targets, clicks, and painting. */

export class Pointing {
  constructor(canvas, wish) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.wish = wish;
    this.targets = [];
    this.paint = document.createElement("canvas");
    this.hasPaint = false;
    this.isOffered = false; // whether anything may be commanded
    canvas.addEventListener("pointerdown", (event) => this.begin(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.end(event));
    canvas.addEventListener("pointercancel", () => this.forget());
  }

  get tool() { return document.querySelector("input[name=tool]:checked").value; }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    const clip = (value) => Math.max(0, Math.min(1, value));
    return [clip((event.clientX - box.left) / box.width), clip((event.clientY - box.top) / box.height)];
  }

  begin(event) {
    this.isPressed = event.button === 0 && this.isOffered;
    if (this.tool !== "paint" || !this.isPressed) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.paint.width = this.canvas.width;
    this.paint.height = this.canvas.height;
    this.hasPaint = true;
    this.last = this.place(event);
    this.stroke(this.last);
  }

  move(event) {
    if (this.hasPaint && this.canvas.hasPointerCapture(event.pointerId)) this.stroke(this.place(event));
  }

  forget() {
    this.isPressed = this.hasPaint = false;
    this.draw();
  }

  end(event) {
    const [x, y] = this.place(event);
    if (!this.isPressed) return; // the press began elsewhere, or with another button
    this.isPressed = false;
    if (this.tool === "point") {
      const hit = this.targets.find((target) => inside(target.outline, x, y));
      this.wish(hit ? { kind: "target", number: hit.number } : { kind: "point", x, y });
    } else if (this.hasPaint) {
      const black = document.createElement("canvas");
      black.width = this.paint.width;
      black.height = this.paint.height;
      const context = black.getContext("2d");
      context.fillRect(0, 0, black.width, black.height);
      context.drawImage(this.paint, 0, 0);
      this.wish({ kind: "paint", picture: black.toDataURL("image/png").split(",")[1] });
      this.hasPaint = false;
      this.draw();
    }
  }

  stroke([x, y]) {
    const context = this.paint.getContext("2d");
    context.lineCap = context.lineJoin = "round";
    context.lineWidth = 2 * Number(document.getElementById("brush").value);
    context.strokeStyle = "white";
    context.beginPath();
    context.moveTo(this.last[0] * this.paint.width, this.last[1] * this.paint.height);
    context.lineTo(x * this.paint.width + 0.01, y * this.paint.height);
    context.stroke();
    this.last = [x, y];
    this.draw();
  }

  show(targets, commanded, size) {
    this.targets = targets;
    this.commanded = commanded;
    if (this.canvas.width !== size[0]) [this.canvas.width, this.canvas.height] = size;
    this.draw();
  }

  draw() {
    const { width, height } = this.canvas;
    const context = this.context;
    context.clearRect(0, 0, width, height);
    context.font = "600 15px system-ui, sans-serif";
    context.textAlign = "center";
    for (const target of this.targets) {
      if (target.number === this.commanded) continue; // tinted in the picture
      context.beginPath();
      target.outline.forEach(([x, y]) => context.lineTo(x * width, y * height));
      context.closePath();
      context.strokeStyle = "rgba(0, 0, 0, 0.55)";
      context.lineWidth = 4;
      context.stroke();
      context.strokeStyle = "rgba(255, 255, 255, 0.9)";
      context.lineWidth = 1.5;
      context.stroke();
      context.strokeStyle = "rgba(0, 0, 0, 0.7)";
      context.lineWidth = 3;
      context.strokeText(target.number + 1, target.x * width, target.y * height + 5);
      context.fillStyle = "white";
      context.fillText(target.number + 1, target.x * width, target.y * height + 5);
    }
    if (this.hasPaint) {
      context.globalAlpha = 0.6;
      context.drawImage(this.paint, 0, 0);
      context.globalAlpha = 1;
    }
  }
}

/* Tell whether a place lies in a convex outline. */
function inside(outline, x, y) {
  let sign = 0;
  for (let i = 0; i < outline.length; i += 1) {
    const [ax, ay] = outline[i];
    const [bx, by] = outline[(i + 1) % outline.length];
    const side = Math.sign((bx - ax) * (y - ay) - (by - ay) * (x - ax));
    if (side && sign && side !== sign) return false;
    sign = side || sign;
  }
  return true;
}
