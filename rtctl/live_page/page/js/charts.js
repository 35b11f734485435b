/** The charts over time: one uPlot a panel, the same time axis and cursor in all, values of the cursor while live. */

import { AxisRange } from "./axis_range.js";
import { alongAxis, colour, colourOf, figure, words } from "./colours.js";

const HEIGHTS = { first: 230, other: 150 };
const TALL_ROLES = new Set(["setpoint", "measured", "estimate", "signal"]);
const SPARE = 0.06; // of the height, above and below the lines
const DENSE = 4; // points a pixel from which no line is wider than one pixel: wider ones take five times as long to draw
const ERROR_ROLES = new Set(["error", "sensing_error"]);
const USUAL = 0.98; // share of the errors that decide about an axis of errors
const BEYOND = 3; // times these errors that the axis reaches
const MARKED = new Set(["change", "refused", "fault", "rearmed", "injected", "model"]);

export class Charts {
  /**
   * @param {HTMLElement} place  @param {object} run description of the recording
   * @param {{zoom: Function, back: Function, pan: Function}} hear
   */
  constructor(place, run, hear) {
    this.run = run;
    this.hear = hear;
    this.marks = [];
    this.hidden = new Set();
    place.replaceChildren();
    this.charts = run.panels.map((panel, number) => this.#chart(place, panel, number));
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(place);
    this.place = place;
  }

  destroy() {
    this.observer.disconnect();
    for (const chart of this.charts) chart.plot.destroy();
  }

  /** Draw a range. @param {{time: Float64Array, values: Float32Array[], live: boolean}} data  @param {number[]} range [s] */
  draw(data, range) {
    this.live = data.live;
    for (const chart of this.charts) {
      const filled = chart.panel.signals.filter((number) => hasNumbers(data.values[number]));
      chart.box.hidden = filled.length === 0;
      if (chart.box.hidden) continue;
      chart.keys.forEach((key, number) => (key.hidden = !filled.includes(number)));
      const columns = chart.panel.signals.map((number) => data.values[number]);
      chart.columns = columns;
      if (chart.errors) this.#limit(chart, columns);
      const dense = data.time.length > DENSE * chart.plot.width;
      chart.panel.signals.forEach((number, column) => {
        if (this.run.signals[number].role === "measured") chart.plot.series[column + 1].width = dense ? 1 : 2;
      });
      chart.plot.batch(() => {
        chart.plot.setData([data.time, ...columns], false);
        chart.plot.setScale("x", { min: range[0], max: range[1] });
      });
      this.#values(chart, data);
    }
  }

  resize() {
    for (const { plot, box, height } of this.charts) {
      const width = box.clientWidth - 20;
      if (width > 0 && width !== plot.width) plot.setSize({ width, height });
    }
  }

  #chart(place, panel, number) {
    const box = document.createElement("div");
    box.className = "panel chart";
    const head = document.createElement("div");
    head.className = "head";
    const title = document.createElement("h2");
    title.textContent = panel.unit ? `${panel.title} [${panel.unit}]` : panel.title;
    head.append(title);
    box.append(head);
    place.append(box);
    const errors = panel.signals.every((one) => ERROR_ROLES.has(this.run.signals[one].role));
    const chart = { panel, box, head, keys: new Map(), axis: new AxisRange(SPARE), errors, limit: Infinity, whole: false };
    const tall = panel.signals.some((one) => TALL_ROLES.has(this.run.signals[one].role));
    chart.height = tall && number === 0 ? HEIGHTS.first : HEIGHTS.other;
    chart.plot = new uPlot(this.#options(chart, place.clientWidth - 20), [[], ...panel.signals.map(() => [])], box);
    this.#keys(chart);
    if (errors) this.#peaks(chart);
    this.#touch(chart);
    return chart;
  }

  #options(chart, width) {
    const { signals } = this.run;
    const band = chart.panel.signals.map((one, place) => [signals[one].role, place + 1]).filter(([role]) => role === "band");
    const axis = { stroke: colour("--dim"), grid: { stroke: colour("--grid"), width: 1 }, ticks: { show: false } };
    return {
      width: Math.max(width, 200),
      padding: [8, 20, 0, 0],
      height: chart.height,
      legend: { show: false },
      cursor: { sync: { key: "time", setSeries: false }, drag: { x: true, y: false, setScale: false }, points: { size: 6 } },
      scales: { x: { time: false }, y: { range: (plot, low, high) => this.#range(chart, low, high) } },
      axes: [
        { ...axis, size: 26, values: (plot, ticks) => alongAxis(ticks).map((one) => `${one} s`) },
        { ...axis, size: 62, values: (plot, ticks) => alongAxis(ticks) },
      ],
      series: [{}, ...this.#series(chart.panel)],
      bands: band.length === 2 ? [{ series: [band[1][1], band[0][1]], fill: colour("--band") }] : [],
      hooks: {
        setSelect: [(plot) => this.#selected(plot)],
        setCursor: [() => this.#values(chart, null)],
        draw: [(plot) => this.#drawMarks(plot, chart === this.charts?.[0])],
        ready: [(plot) => plot.over.addEventListener("dblclick", () => this.hear.back())],
      },
    };
  }

  #series(panel) {
    let place = -1;
    return panel.signals.map((number) => {
      const signal = this.run.signals[number];
      if (signal.role === "band") return { width: 0, stroke: "transparent", points: { show: false } };
      place += 1;
      return { label: signal.name, stroke: colourOf(signal, place), width: 1, points: { show: false } };
    });
  }

  #keys(chart) {
    let place = -1;
    chart.panel.signals.forEach((number, column) => {
      const signal = this.run.signals[number];
      const key = document.createElement("span");
      key.className = "key";
      if (signal.role === "band") {
        if (chart.keys.size && [...chart.keys.values()].some((one) => one.dataset.band)) return;
        key.dataset.band = "yes";
        key.append(swatch(colour("--band")), "± 2 standard errors");
      } else {
        place += 1;
        key.append(swatch(colourOf(signal, place)), `${words(signal.name)} `, document.createElement("b"));
        key.onclick = () => {
          key.classList.toggle("off");
          chart.plot.setSeries(column + 1, { show: !key.classList.contains("off") });
        };
      }
      chart.keys.set(number, key);
      chart.head.append(key);
    });
  }

  /** An axis of errors is set by the usual ones; a button shows the peaks of steps and faults, too. */
  #peaks(chart) {
    chart.peak = document.createElement("button");
    chart.peak.className = "small";
    chart.peak.title = "Show the whole range of the errors, or the usual ones";
    chart.peak.hidden = true;
    chart.peak.onclick = () => {
      chart.whole = !chart.whole;
      chart.axis = new AxisRange(SPARE);
      if (chart.data) this.draw(chart.data, chart.data.range);
    };
    chart.head.append(chart.peak);
  }

  #limit(chart, columns) {
    const sizes = columns.flatMap((column) => sampled(column).map(Math.abs)).sort((a, b) => a - b);
    const largest = Math.max(...columns.map(largestOf));
    const limit = BEYOND * (sizes[Math.floor(USUAL * (sizes.length - 1))] || largest);
    chart.peak.hidden = limit >= largest;
    chart.peak.textContent = chart.whole ? "usual errors" : `peaks to ${figure(largest)}`;
    chart.limit = chart.whole ? Infinity : limit;
  }

  /** Write the values at the cursor, or the newest ones, into the head of a chart. */
  #values(chart, data) {
    if (data) chart.data = data;
    if (!chart.data || !chart.plot) return;
    const { time, values } = chart.data;
    const index = chart.plot.cursor.idx ?? time.length - 1;
    for (const [number, key] of chart.keys) {
      const value = key.querySelector("b");
      if (value) value.textContent = figure(values[number][index]);
    }
  }

  /** Return the range of an axis: that of what is in view, with some patience while live. */
  #range(chart, low, high) {
    if (Number.isNaN(low) || Number.isNaN(high)) [low, high] = extremesOf(chart.columns); // a reading that is missing
    if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return chart.axis.range ?? [0, 1];
    return chart.axis.follow(Math.max(low, -chart.limit), Math.min(high, chart.limit), this.live, performance.now());
  }

  #selected(plot) {
    if (plot.select.width < 5) return;
    const from = plot.posToVal(plot.select.left, "x");
    const to = plot.posToVal(plot.select.left + plot.select.width, "x");
    plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    this.hear.zoom(from, to);
  }

  #drawMarks(plot, withText) {
    const { ctx, bbox } = plot;
    const shown = this.marks.filter((one) => MARKED.has(one.kind) && one.time_s >= plot.scales.x.min && one.time_s <= plot.scales.x.max);
    ctx.save();
    ctx.font = `${11 * devicePixelRatio}px sans-serif`;
    ctx.textAlign = "left";
    let free = 0;
    for (const mark of shown) {
      const x = Math.round(plot.valToPos(mark.time_s, "x", true));
      ctx.strokeStyle = ctx.fillStyle = colour(mark.kind === "fault" || mark.kind === "refused" ? "--alarm" : "--mark");
      ctx.setLineDash([4 * devicePixelRatio, 3 * devicePixelRatio]);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      if (!withText) continue;
      const text = mark.text.length > 28 ? `${mark.text.slice(0, 27)}…` : mark.text;
      const width = ctx.measureText(text).width + 8 * devicePixelRatio;
      const left = x + width < bbox.left + bbox.width ? x : x - width;
      if (left < free) continue; // the list of events has it
      free = left + width;
      const shade = ctx.fillStyle;
      ctx.fillStyle = colour("--card");
      ctx.fillRect(left + 2 * devicePixelRatio, bbox.top, width - 2 * devicePixelRatio, 16 * devicePixelRatio);
      ctx.fillStyle = shade;
      ctx.fillText(text, left + 4 * devicePixelRatio, bbox.top + 12 * devicePixelRatio);
    }
    ctx.restore();
  }

  /** A finger moves the range; a mouse chooses one. */
  #touch(chart) {
    const { over } = chart.plot;
    let begun = null;
    over.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch") begun = { x: event.clientX, min: chart.plot.scales.x.min, max: chart.plot.scales.x.max };
    });
    over.addEventListener("pointermove", (event) => {
      if (!begun) return;
      const shift = ((begun.x - event.clientX) / over.clientWidth) * (begun.max - begun.min);
      if (Math.abs(begun.x - event.clientX) > 8) this.hear.pan(begun.min + shift, begun.max + shift);
    });
    for (const end of ["pointerup", "pointercancel"]) over.addEventListener(end, () => (begun = null));
  }
}

function swatch(shade) {
  const mark = document.createElement("i");
  mark.style.setProperty("--colour", shade);
  return mark;
}

/** Return about a thousand of the numbers in a column. */
function sampled(column) {
  const stride = Math.max(1, Math.floor(column.length / 1000));
  const count = Math.floor(column.length / stride);
  return Array.from({ length: count }, (_, k) => column[k * stride]).filter((one) => !Number.isNaN(one));
}

function extremesOf(columns) {
  let low = Infinity;
  let high = -Infinity;
  for (const column of columns) {
    for (const value of column) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return [low, high];
}

function largestOf(column) {
  let largest = 0;
  for (const value of column) if (Math.abs(value) > largest) largest = Math.abs(value);
  return largest;
}

function hasNumbers(values) {
  for (let k = values.length - 1; k >= 0; k -= 7) if (!Number.isNaN(values[k])) return true;
  return false;
}
