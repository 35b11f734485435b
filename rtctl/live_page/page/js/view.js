/** Which part of a recording is shown: its newest seconds from the ring, or a range that the server decimates. */

import { unpacked } from "./stream.js";

const POINTS = 1200;
const RENEW_MS = 1000; // the whole run while it grows
const LEAST_S = 1e-6;

export class View {
  /** @param {object} run description of the recording  @param {import("./ring.js").Ring} ring  @param {Function} changed */
  constructor(run, ring, changed) {
    this.run = run;
    this.ring = ring;
    this.changed = changed;
    this.seconds = 10;
    this.live = true;
    this.range = null; // [s], of a view that is not live; null: the whole run
    this.fetched = null;
    this.end_s = 0; // of the recording, as far as it is known
    this.growing = true;
    this.renewed = 0;
  }

  showLive() {
    this.live = true;
    this.range = this.fetched = null;
    this.changed();
  }

  /** Show a range [s], moved to where the run is, should it begin before its start; null: the whole run. */
  show(range) {
    this.live = false;
    const before_s = range ? Math.min(0, range[0]) : 0;
    this.range = range && range[1] - range[0] > LEAST_S ? [range[0] - before_s, range[1] - before_s] : null;
    this.#fetch();
    this.changed();
  }

  /** Ask the server again where the whole of a growing run is shown. */
  renew() {
    const due = performance.now() - this.renewed > RENEW_MS;
    if (!this.live && this.range === null && this.growing && due) this.#fetch();
  }

  /** Return what is drawn: times, values and the range [s]; null while the server has not answered. */
  data() {
    if (!this.live) return this.fetched;
    const { ring } = this;
    if (!ring.length) return null;
    const end = ring.time[ring.end - 1];
    const begin = Math.max(0, end - this.seconds); // no time before the run's start
    const from = ring.placeOf(begin);
    const values = ring.values.map((column) => column.subarray(from, ring.end));
    const range = [begin, Math.max(end, begin + this.run.period_s)];
    return { time: ring.time.subarray(from, ring.end), values, range, plane: values, step: 1, live: true };
  }

  async #fetch() {
    this.renewed = performance.now();
    const number = (this.asked = (this.asked ?? 0) + 1);
    const query = new URLSearchParams({ run: this.run.name, points: POINTS });
    if (this.range) {
      query.set("from", this.range[0]);
      query.set("to", this.range[1]);
    }
    let answer;
    try {
      const response = await fetch(`history?${query}`);
      if (!response.ok) return;
      answer = await response.json();
    } catch {
      return; // the stream says that the server is lost
    }
    if (number !== this.asked || this.live || answer.key !== this.run.key) return;
    this.end_s = answer.end_s;
    this.fetched = drawable(answer, this.run.signals.length, this.range);
    this.changed();
  }
}

/** Return the answer of the server as lines: a bin is drawn from its smallest to its largest value. */
export function drawable(answer, signals, range) {
  const begins = unpacked(answer.time_s, Float64Array);
  const count = begins.length;
  const low = columnsOf(answer.low, signals);
  const plane = columnsOf(answer.plane, signals);
  const step = answer.plane_step;
  const whole = range ?? [count ? begins[0] : 0, answer.end_s];
  if (answer.exact) return { time: begins, values: low, range: whole, plane, step, live: false };
  const high = columnsOf(answer.high, signals);
  const time = new Float64Array(2 * count);
  for (let k = 0; k < count; k++) {
    const next = k + 1 < count ? begins[k + 1] : Math.max(whole[1], begins[k]);
    time[2 * k] = begins[k];
    time[2 * k + 1] = (begins[k] + next) / 2;
  }
  const values = low.map((column, number) => {
    const both = new Float32Array(2 * count);
    for (let k = 0; k < count; k++) {
      both[2 * k] = column[k];
      both[2 * k + 1] = high[number][k];
    }
    return both;
  });
  return { time, values, range: whole, plane, step, live: false };
}

function columnsOf(text, signals) {
  const all = unpacked(text, Float32Array);
  const rows = signals ? all.length / signals : 0;
  return Array.from({ length: signals }, (_, number) => all.subarray(number * rows, (number + 1) * rows));
}
