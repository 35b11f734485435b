/** Histogram of lateness (of round trips where the device waits for the loop), missed periods. */

import { cleared } from "./canvas.js";
import { colour } from "./colours.js";

const HEIGHT = 120;
const BOTTOM = 20;

export class Timing {
  constructor(run) {
    this.live = run.live;
    this.content = null;
    this.missed = 0;
    this.box = document.getElementById("timing");
    this.box.hidden = true;
    const title = this.live ? "Lateness of the steps" : "Round trip of the exchanges";
    document.getElementById("timing-title").textContent = title;
  }

  /** Take what the server counted. */
  take(content) {
    this.content = content;
    this.box.hidden = false;
    this.draw();
  }

  /** Take the number of periods that were missed so far. */
  takeMissed(missed) {
    if (missed === this.missed) return;
    this.missed = missed;
    if (this.content) this.#words();
  }

  draw() {
    if (!this.content) return;
    const { ctx, width } = cleared(document.getElementById("histogram"), HEIGHT);
    bars(ctx, this.content.counts[this.#name], this.content.edges_us, width);
    this.#words();
  }

  get #name() {
    return this.live ? "lateness" : "round_trip";
  }

  #words() {
    const newest = this.content.newest_us[this.#name];
    const figures = `newest steps: p50 ${time(newest.p50)}, p99 ${time(newest.p99)}; largest ${time(this.content.largest_us[this.#name])}`;
    const periods = `${this.missed} ${this.missed === 1 ? "period" : "periods"} missed`;
    const late = this.live ? periods : "lockstep: the device waits, nothing is late";
    document.getElementById("timing-words").textContent = `${figures}; ${late}`;
  }
}

/** Draw counts over bins, both axes logarithmic: one late step in a million is seen. */
function bars(ctx, counts, edges_us, width) {
  const used = counts.map((count, bin) => (count ? bin : -1)).filter((bin) => bin >= 0);
  if (!used.length) return;
  const first = Math.max(0, used[0] - 1);
  const last = Math.min(counts.length - 1, used[used.length - 1] + 1);
  const each = width / (last - first + 1);
  const most = Math.log10(Math.max(...counts) + 1);
  ctx.font = "10px sans-serif";
  ctx.textAlign = "center";
  let free = 0;
  for (let bin = first; bin <= last; bin++) {
    const x = (bin - first) * each;
    const height = (Math.log10(counts[bin] + 1) / most) * (HEIGHT - BOTTOM - 14);
    ctx.fillStyle = colour("--accent");
    ctx.fillRect(x + 1, HEIGHT - BOTTOM - height, each - 2, height);
    ctx.fillStyle = colour("--dim");
    if (counts[bin]) ctx.fillText(short(counts[bin]), x + each / 2, HEIGHT - BOTTOM - height - 3);
    const text = time(edges_us[bin]);
    const half = ctx.measureText(text).width / 2;
    if (x - half >= free && bin > 0) {
      ctx.fillText(text, x, HEIGHT - 6);
      free = x + half + 6;
    }
  }
}

function short(count) {
  if (count < 1000) return `${count}`;
  return count < 1e6 ? `${(count / 1e3).toPrecision(2) * 1}k` : `${(count / 1e6).toPrecision(2) * 1}M`;
}

function time(value_us) {
  if (value_us < 1000) return `${Number(value_us.toPrecision(3))} µs`;
  return value_us < 1e6 ? `${Number((value_us / 1e3).toPrecision(3))} ms` : `${Number((value_us / 1e6).toPrecision(3))} s`;
}
