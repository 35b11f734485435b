/** Planes of two signals: the path of the newest rows with a trail that fades, or the samples of a range as dots. */

import { AxisRange } from "./axis_range.js";
import { alongAxis, capital, colour, colourOf, words } from "./colours.js";

const HEIGHT = 210;
const EDGE = { left: 62, right: 10, top: 8, bottom: 34 };
const TRAIL_ROWS = 2000; // newest rows of which a live plane shows the path
const FADES = 6; // parts of a trail, each fainter than the next newer one
const JUMP = 0.2; // share of the plane from which a move between two samples is no line
const SPARE = 0.07;
const OUTSIDE = 0.003; // share of the values that an axis may leave outside, at each end

export class Planes {
  constructor(place, run) {
    this.run = run;
    place.replaceChildren();
    this.planes = run.planes.map((plane) => this.#plane(place, plane));
  }

  /** Draw. @param {{plane: Float32Array[], step: number}} data  @param {boolean} live whether the trail fades */
  draw(data, live) {
    const columns = live ? data.plane.map((column) => column.subarray(-TRAIL_ROWS)) : data.plane;
    for (const plane of this.planes) {
      const curves = plane.y.filter((number) => columns[number].some((one) => !Number.isNaN(one)));
      plane.box.hidden = curves.length === 0 || !columns[plane.x].length;
      if (plane.box.hidden) continue;
      this.#fit(plane, [columns[plane.x]], "across", live);
      this.#fit(plane, curves.map((number) => columns[number]), "up", live);
      const ctx = this.#frame(plane);
      for (const number of curves) {
        ctx.strokeStyle = ctx.fillStyle = colourOf(this.run.signals[number], 0);
        const points = this.#points(plane, columns[plane.x], columns[number]);
        if (live) trail(ctx, plane, points);
        else path(ctx, plane, points, data.step > 1);
      }
      ctx.restore(); // what `#frame` clips
    }
  }

  #plane(place, plane) {
    const box = document.createElement("div");
    box.className = "panel";
    const head = document.createElement("div");
    head.className = "head";
    const [x, y] = [this.run.signals[plane.x], this.run.signals[plane.y[0]]];
    const title = document.createElement("h2");
    title.textContent = capital(`${words(y.name)} over ${words(x.name)}`);
    head.append(title);
    const canvas = document.createElement("canvas");
    box.append(head, canvas);
    place.append(box);
    return { ...plane, box, canvas, across: new AxisRange(SPARE), up: new AxisRange(SPARE), labels: [axisLabel(x), axisLabel(y)] };
  }

  /** Fit an axis: while live with some patience, so that the loop stands still. */
  #fit(plane, columns, axis, live) {
    const [low, high] = most(columns);
    plane[axis].follow(low, high, live, performance.now());
  }

  #points(plane, across, up) {
    const points = new Float32Array(2 * across.length);
    for (let k = 0; k < across.length; k++) {
      points[2 * k] = plane.px(across[k]);
      points[2 * k + 1] = plane.py(up[k]);
    }
    return points;
  }

  #frame(plane) {
    const { canvas } = plane;
    const width = canvas.clientWidth;
    const ratio = devicePixelRatio;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== HEIGHT * ratio) {
      canvas.width = Math.round(width * ratio);
      canvas.height = HEIGHT * ratio;
      canvas.style.height = `${HEIGHT}px`;
    }
    plane.width = width - EDGE.left - EDGE.right;
    plane.height = HEIGHT - EDGE.top - EDGE.bottom;
    plane.px = (value) => EDGE.left + ((value - plane.across.range[0]) / (plane.across.range[1] - plane.across.range[0])) * plane.width;
    plane.py = (value) => EDGE.top + (1 - (value - plane.up.range[0]) / (plane.up.range[1] - plane.up.range[0])) * plane.height;
    const ctx = canvas.getContext("2d");
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    ctx.clearRect(0, 0, width, HEIGHT);
    axes(ctx, plane);
    ctx.beginPath();
    ctx.rect(EDGE.left, EDGE.top, plane.width, plane.height);
    ctx.save();
    ctx.clip();
    return ctx;
  }
}

function axes(ctx, plane) {
  ctx.font = "11px sans-serif";
  ctx.strokeStyle = colour("--grid");
  ctx.fillStyle = colour("--dim");
  ctx.lineWidth = 1;
  ctx.textAlign = "center";
  const across = ticks(plane.across.range, plane.width / 55);
  const below = alongAxis(across);
  for (const [k, value] of across.entries()) {
    const x = Math.round(plane.px(value)) + 0.5;
    line(ctx, x, EDGE.top, x, EDGE.top + plane.height);
    ctx.fillText(below[k], x, EDGE.top + plane.height + 13);
  }
  ctx.textAlign = "right";
  const up = ticks(plane.up.range, plane.height / 32);
  const beside = alongAxis(up);
  for (const [k, value] of up.entries()) {
    const y = Math.round(plane.py(value)) + 0.5;
    line(ctx, EDGE.left, y, EDGE.left + plane.width, y);
    ctx.fillText(beside[k], EDGE.left - 5, y + 4);
  }
  ctx.textAlign = "center";
  ctx.fillText(plane.labels[0], EDGE.left + plane.width / 2, HEIGHT - 5);
  ctx.save();
  ctx.translate(10, EDGE.top + plane.height / 2);
  ctx.rotate(-Math.PI / 2);
  ctx.fillText(plane.labels[1], 0, 0);
  ctx.restore();
}

/** Return the range of the values without the few outermost ones, which would squeeze the loop: a start, a fault. */
function most(columns) {
  const values = columns.flatMap((column) => {
    const stride = Math.max(1, Math.floor(column.length / 1000));
    return Array.from({ length: Math.floor(column.length / stride) }, (_, k) => column[k * stride]);
  });
  const sorted = values.filter((one) => !Number.isNaN(one)).sort((a, b) => a - b);
  const place = Math.floor(OUTSIDE * sorted.length);
  return [sorted[place], sorted[sorted.length - 1 - place]];
}

/** Draw the path of the newest rows, the older the fainter, and where it is now. */
function trail(ctx, plane, points) {
  const count = points.length / 2;
  for (let part = 0; part < FADES; part++) {
    const from = Math.floor((count * part) / FADES);
    const to = Math.min(count, Math.floor((count * (part + 1)) / FADES) + 1);
    ctx.globalAlpha = 0.12 + (0.88 * (part + 1)) / FADES;
    path(ctx, plane, points.subarray(2 * from, 2 * to), false);
  }
  ctx.globalAlpha = 1;
  if (count) dot(ctx, points[2 * count - 2], points[2 * count - 1], 4);
}

function path(ctx, plane, points, dotted) {
  ctx.lineWidth = 1; // wider lines take several times as long to draw
  ctx.beginPath();
  let drawn = false;
  for (let k = 0; k < points.length; k += 2) {
    const [x, y] = [points[k], points[k + 1]];
    if (Number.isNaN(x) || Number.isNaN(y)) {
      drawn = false;
    } else if (dotted) {
      ctx.fillRect(x - 1.2, y - 1.2, 2.4, 2.4);
    } else {
      const far = Math.abs(x - points[k - 2]) > JUMP * plane.width || Math.abs(y - points[k - 1]) > JUMP * plane.height;
      if (!drawn || far) {
        ctx.moveTo(x, y);
        ctx.lineTo(x + 0.7, y); // a sample by itself is seen too
      } else ctx.lineTo(x, y);
      drawn = true;
    }
  }
  ctx.stroke();
}

function dot(ctx, x, y, radius) {
  if (Number.isNaN(x) || Number.isNaN(y)) return;
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, 2 * Math.PI);
  ctx.fill();
}

function line(ctx, x0, y0, x1, y1) {
  ctx.beginPath();
  ctx.moveTo(x0, y0);
  ctx.lineTo(x1, y1);
  ctx.stroke();
}

/** Return round numbers within a range, about so many. */
export function ticks([low, high], about) {
  const raw = (high - low) / Math.max(about, 1);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= raw) ?? raw;
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high && found.length < 20; k++) found.push(k * step);
  return found;
}

function axisLabel(signal) {
  return signal.unit ? `${words(signal.name)} [${signal.unit}]` : words(signal.name);
}
