// An orthographic sphere with a track on it, that can be turned. Plain SVG: prints, and needs no WebGL.

const SVG = "http://www.w3.org/2000/svg";
const SEGMENTS = 24;

const VIEWS = { "+x": [0, 0], "+y": [90, 0], "+z": [0, 90] };

function svg(name, attributes = {}, parent = null) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}

/** Colour between two hex colours. */
function mixed(a, b, part) {
  const channel = (hex, i) => parseInt(hex.slice(i, i + 2), 16);
  return `rgb(${[1, 3, 5].map((i) => Math.round(channel(a, i) * (1 - part) + channel(b, i) * part)).join(",")})`;
}

class Sphere {
  /** `track`: {t, y: [x, y, z]} with null as gap. */
  constructor(parent, track, gyro) {
    this.track = track;
    // The first view is towards the middle of the track, from a little above.
    const mean = track.y.map((axis) => axis.reduce((sum, v) => sum + (v ?? 0), 0));
    this.longitude = (Math.atan2(mean[1], mean[0]) * 180) / Math.PI + 25;
    this.latitude = 25;
    const box = document.createElement("div");
    box.className = "sphere";
    box.innerHTML = `<div>Gyro ${gyro}</div>`;
    this.root = svg("svg", { viewBox: "-1.32 -1.28 2.64 2.5", role: "img", tabindex: 0,
      "aria-label": `Track of the momentum of gyro ${gyro} on the sphere of its case axes` });
    box.append(this.root, this.buttons());
    parent.append(box);
    this.listen();
  }

  buttons() {
    const row = document.createElement("div");
    row.className = "views";
    for (const [name, [longitude, latitude]] of Object.entries(VIEWS)) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = `from ${name}`;
      button.addEventListener("click", () => this.turn(longitude - this.longitude, latitude - this.latitude));
      row.append(button);
    }
    return row;
  }

  listen() {
    this.root.addEventListener("pointerdown", (event) => this.root.setPointerCapture(event.pointerId));
    this.root.addEventListener("pointermove", (event) => {
      if (event.buttons) this.turn(-0.5 * event.movementX, 0.5 * event.movementY);
    });
    const steps = { ArrowLeft: [-10, 0], ArrowRight: [10, 0], ArrowUp: [0, 10], ArrowDown: [0, -10] };
    this.root.addEventListener("keydown", (event) => {
      if (steps[event.key]) {
        event.preventDefault();
        this.turn(...steps[event.key]);
      }
    });
  }

  turn(longitude, latitude) {
    this.longitude += longitude;
    this.latitude = Math.max(-90, Math.min(90, this.latitude + latitude));
    this.draw(this.colour);
  }

  /** [right, up, towards the eye] of a vector in case axes. */
  project(x, y, z) {
    const [sl, cl] = [Math.sin, Math.cos].map((f) => f((this.longitude * Math.PI) / 180));
    const [sb, cb] = [Math.sin, Math.cos].map((f) => f((this.latitude * Math.PI) / 180));
    return [-sl * x + cl * y, -sb * (cl * x + sl * y) + cb * z, cb * (cl * x + sl * y) + sb * z];
  }

  /** Path of the points on the near or the far side. */
  path(points, near) {
    let d = "";
    let drawing = false;
    for (const point of points) {
      const shown = point !== null && point[2] >= 0 === near;
      if (shown) d += `${drawing ? "L" : "M"}${point[0].toFixed(4)} ${(-point[1]).toFixed(4)}`;
      drawing = shown;
    }
    return d;
  }

  draw(colour) {
    this.colour = colour;
    this.root.replaceChildren();
    svg("circle", { r: 1, fill: colour.shade, stroke: colour.muted, "stroke-width": 0.008 }, this.root);
    this.drawGrid();
    this.drawTrack();
    this.drawAxes();
  }

  drawGrid() {
    const circle = (at) => Array.from({ length: 73 }, (_, i) => this.project(...at((i * 5 * Math.PI) / 180)));
    const lines = [];
    for (const latitude of [-60, -30, 0, 30, 60]) {
      const [s, c] = [Math.sin, Math.cos].map((f) => f((latitude * Math.PI) / 180));
      lines.push([circle((u) => [c * Math.cos(u), c * Math.sin(u), s]), latitude === 0]);
    }
    for (const longitude of [0, 30, 60, 90, 120, 150]) {
      const [s, c] = [Math.sin, Math.cos].map((f) => f((longitude * Math.PI) / 180));
      lines.push([circle((u) => [c * Math.cos(u), s * Math.cos(u), Math.sin(u)]), longitude % 90 === 0]);
    }
    for (const [points, main] of lines) {
      svg("path", { d: this.path(points, true), fill: "none", stroke: main ? this.colour.muted : this.colour.line,
        "stroke-width": main ? 0.006 : 0.005 }, this.root);
    }
  }

  drawTrack() {
    const [x, y, z] = this.track.y;
    const points = x.map((_, i) => (x[i] === null ? null : this.project(x[i], y[i], z[i])));
    const length = Math.ceil(points.length / SEGMENTS);
    for (const near of [false, true]) {
      for (let i = 0; i < SEGMENTS; ++i) {
        const d = this.path(points.slice(i * length, (i + 1) * length + 1), near);
        if (d === "") continue;
        svg("path", { d, class: "track", fill: "none", "stroke-linejoin": "round",
          stroke: mixed(this.colour["track-start"], this.colour["track-end"], i / (SEGMENTS - 1)),
          "stroke-width": near ? 0.016 : 0.006, opacity: near ? 0.9 : 0.45 }, this.root);
      }
    }
    const ends = points.filter((point) => point !== null);
    if (ends.length === 0) return;
    this.mark(ends[0], "circle", { r: 0.035 }, "track-start");
    this.mark(ends[ends.length - 1], "rect", { x: -0.032, y: -0.032, width: 0.064, height: 0.064 }, "track-end");
  }

  mark(point, shape, attributes, colour) {
    svg(shape, { ...attributes, transform: `translate(${point[0]} ${-point[1]})`, fill: this.colour[colour],
      stroke: this.colour.ink, "stroke-width": 0.012, opacity: point[2] >= 0 ? 1 : 0.45 }, this.root);
  }

  drawAxes() {
    for (const [name, axis] of Object.entries({ x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] })) {
      const [right, up, near] = this.project(...axis);
      svg("line", { x1: right, y1: -up, x2: 1.14 * right, y2: -1.14 * up, stroke: this.colour.ink, "stroke-width": 0.012,
        opacity: near >= -0.05 ? 1 : 0.35 }, this.root);
      svg("text", { x: 1.23 * right, y: -1.23 * up + 0.035, "text-anchor": "middle", style: "font-size:0.11px",
        opacity: near >= -0.05 ? 1 : 0.5 }, this.root).textContent = name;
    }
  }
}
