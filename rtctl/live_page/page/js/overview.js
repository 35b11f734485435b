/** A strip of the whole run, in which a range is chosen by dragging, with a mouse or a finger. */

import { cleared } from "./canvas.js";
import { colour, colourOf } from "./colours.js";
import { drawable } from "./view.js";

const POINTS = 400;
const HEIGHT = 64;
const RENEW_MS = 2000;
const LEAST_DRAG = 5; // pixels
const DRAWN_ROLES = ["setpoint", "measured", "estimate", "signal"];

export class Overview {
  /** @param {HTMLCanvasElement} canvas  @param {object} run  @param {Function} choose called with a range [s] or null */
  constructor(canvas, run, choose) {
    Object.assign(this, { canvas, run, choose, data: null, renewed: -Infinity, dragged: null });
    this.numbers = run.signals.map((one, number) => number).filter((number) => DRAWN_ROLES.includes(run.signals[number].role));
    if (!this.numbers.some((number) => run.signals[number].role !== "signal")) this.numbers = this.numbers.slice(0, 1);
    canvas.onpointerdown = (event) => this.#down(event);
    canvas.onpointermove = (event) => this.#moved(event);
    canvas.onpointerup = (event) => this.#up(event);
    canvas.onpointercancel = () => (this.dragged = null);
    canvas.ondblclick = () => this.choose(null);
  }

  /** Draw the run and the range that is shown; ask for more of the run now and then while it grows. */
  draw(shown, growing, end_s) {
    this.shown = shown;
    const now = performance.now();
    if (now - this.renewed > (this.data && !growing ? Infinity : RENEW_MS)) {
      this.renewed = now;
      this.#fetch();
    }
    this.end_s = end_s;
    this.#paint();
  }

  async #fetch() {
    try {
      const response = await fetch(`history?${new URLSearchParams({ run: this.run.name, points: POINTS })}`);
      const answer = response.ok ? await response.json() : null;
      if (answer?.key !== this.run.key) return;
      this.data = drawable(answer, this.run.signals.length, null);
      this.#paint();
    } catch {
      // the stream says that the server is lost
    }
  }

  #paint() {
    const { canvas, data } = this;
    this.span = [data?.range[0] ?? 0, Math.max(this.end_s, data?.range[1] ?? 0)];
    const { ctx, width } = cleared(canvas, HEIGHT);
    if (data) for (const number of this.numbers) this.#line(ctx, data.time, data.values[number], number, width);
    const range = this.dragged ?? this.shown;
    if (!range) return;
    const [from, to] = range.map((one) => this.#x(one, width));
    ctx.fillStyle = colour("--accent");
    ctx.globalAlpha = 0.18;
    ctx.fillRect(from, 0, Math.max(to - from, 2), HEIGHT);
    ctx.globalAlpha = 1;
    ctx.fillRect(from, 0, 1.5, HEIGHT);
    ctx.fillRect(Math.max(to, from + 2) - 1.5, 0, 1.5, HEIGHT);
  }

  #line(ctx, time, values, number, width) {
    let low = Infinity;
    let high = -Infinity;
    for (const column of this.numbers.map((one) => this.data.values[one])) {
      for (const value of column) {
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    ctx.strokeStyle = colourOf(this.run.signals[number], 0);
    ctx.lineWidth = 1;
    ctx.beginPath();
    for (let k = 0; k < time.length; k++) {
      const y = HEIGHT - 4 - ((values[k] - low) / (high - low || 1)) * (HEIGHT - 8);
      if (!Number.isNaN(y)) ctx.lineTo(this.#x(time[k], width), y);
    }
    ctx.stroke();
  }

  #x(time_s, width) {
    return ((time_s - this.span[0]) / (this.span[1] - this.span[0] || 1)) * width;
  }

  #time(event) {
    const share = event.offsetX / this.canvas.clientWidth;
    return this.span[0] + Math.min(Math.max(share, 0), 1) * (this.span[1] - this.span[0]);
  }

  #down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.from = event.offsetX;
    this.begun = this.#time(event);
  }

  #moved(event) {
    if (this.begun === undefined) return;
    const now = this.#time(event);
    this.dragged = [Math.min(this.begun, now), Math.max(this.begun, now)];
    this.#paint();
  }

  #up(event) {
    if (this.dragged && Math.abs(event.offsetX - this.from) >= LEAST_DRAG) this.choose(this.dragged);
    this.begun = undefined;
    this.dragged = null;
  }
}
