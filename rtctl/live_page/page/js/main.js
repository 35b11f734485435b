/** The page: the stream into the ring, the ring or a range of the run into the charts, at most 30 times a second. */

import { Charts } from "./charts.js";
import { Control } from "./control.js";
import { writeEvents, writeVerdict } from "./log.js";
import { Overview } from "./overview.js";
import { Planes } from "./planes.js";
import { Ring } from "./ring.js";
import { counters, Stream } from "./stream.js";
import { Timing } from "./timing.js";
import { View } from "./view.js";

const ROWS = 16384; // that the page keeps
const FRAME_MS = 1000 / 31;
const PLANES_EVERY = 3; // pictures of the charts for one of the planes
const SECONDS = [1, 2, 5, 10, 30, 60];
const RUNS_EVERY_MS = 3000;
const AROUND_EVENT_S = 1;

const element = (name) => document.getElementById(name);
const page = { run: null, paused: false, dirty: false, state: "waiting", drawn: 0, pictures: 0, events: [] };
const control = new Control(() => page.run?.name ?? "");
const stream = new Stream({ run: begin, rows, skipped, events, state, timing, lost, found });
window.rtctl = { counters, page };

function begin(run) {
  page.run = run;
  page.ring = new Ring(run.signals.length, ROWS);
  page.view = new View(run, page.ring, () => {
    page.dirty = true;
    buttons();
  });
  page.view.seconds = Number(element("seconds").value);
  page.timing = new Timing(run);
  page.events = [];
  element("title").textContent = run.title;
  document.title = `${run.title} – rtctl watch`;
  say(run.remark);
  writeEvents([], () => {});
  writeVerdict(null);
  pause(false);
  build();
}

/** Make all that has colours, at the beginning and when dark or light is chosen. */
function build() {
  page.charts?.destroy();
  page.charts = new Charts(element("charts"), page.run, {
    zoom: (from, to) => choose([from, to]),
    pan: (from, to) => choose([from, to]),
    back: () => (page.view.growing ? page.view.showLive() : choose(null)),
  });
  page.charts.marks = page.events;
  page.planes = new Planes(element("planes"), page.run);
  page.overview = new Overview(element("overview"), page.run, choose);
  page.timing.draw();
  page.dirty = true;
}

function choose(range) {
  pause(false);
  page.view.show(range);
}

function rows(samples, values, lastRow) {
  page.ring.append(samples, values, page.run.period_s, lastRow);
  const sample = samples[samples.length - 1];
  page.view.end_s = page.run.period_s * sample;
  page.timing.takeMissed(sample + 1 - lastRow);
  page.dirty = true;
}

function skipped() {
  page.ring.clear();
}

function events(content) {
  page.events = content;
  page.charts.marks = content;
  writeEvents(content, (time_s) => choose([Math.max(0, time_s - AROUND_EVENT_S), time_s + AROUND_EVENT_S]));
  page.dirty = true;
}

function state(content) {
  const before = page.state;
  page.state = content.state;
  pill();
  element("state").title = content.words;
  writeVerdict(content.summary);
  if (!page.run) {
    element("charts").textContent = content.words;
    return;
  }
  page.view.growing = content.state === "recording";
  if (content.state === "killed") say(content.words);
  if (before !== content.state || content.state === "recording") control.follow(page.view.growing);
  if (!page.view.growing && before !== "recording" && page.view.live) choose(null);
  buttons();
}

function timing(content) {
  page.timing.take(content);
}

function lost() {
  page.lost = true;
  pill();
}

function found() {
  page.lost = false;
  pill();
}

function pill() {
  const names = { recording: "running", ending: "ended", waiting: "waiting" };
  const text = page.lost ? "no connection, trying again" : (names[page.state] ?? page.state);
  element("state").textContent = page.paused && !page.lost ? `${text}, paused` : text;
  element("state").className = `pill ${page.lost ? "lost" : text}`;
}

function say(text) {
  element("message").textContent = text;
  element("message").hidden = !text;
}

function pause(on) {
  page.paused = on;
  page.dirty = true;
  buttons();
  pill();
}

function buttons() {
  const view = page.view;
  element("live").disabled = !view;
  element("live").setAttribute("aria-pressed", Boolean(view?.live));
  element("whole").setAttribute("aria-pressed", Boolean(view && !view.live && view.range === null));
  element("pause").setAttribute("aria-pressed", page.paused);
}

function draw(now) {
  requestAnimationFrame(draw);
  if (!page.run || now - page.drawn < FRAME_MS) return;
  page.view.renew();
  if (page.paused || !page.dirty) return;
  const data = page.view.data();
  if (!data) return;
  page.dirty = false;
  page.drawn = now;
  const begun = performance.now();
  page.charts.draw(data, data.range);
  if (page.pictures++ % PLANES_EVERY === 0 || !page.view.live) {
    page.planes.draw(data, page.view.live);
    page.overview.draw(data.range, page.view.growing, page.view.end_s);
  }
  counters.redraws += 1;
  counters.drawing_ms += performance.now() - begun;
}

async function listRuns() {
  const response = await fetch("runs").catch(() => null);
  if (!response?.ok) return;
  const { runs } = await response.json();
  const select = element("runs");
  select.hidden = runs.length < 2;
  const names = ["", ...runs];
  if (select.dataset.names === names.join("\n")) return;
  select.dataset.names = names.join("\n");
  const chosen = select.value;
  select.replaceChildren(...names.map((name) => new Option(name === "" ? "the newest run" : name, name)));
  select.value = names.includes(chosen) ? chosen : "";
}

element("live").onclick = () => {
  pause(false);
  page.view?.showLive();
};
element("pause").onclick = () => pause(!page.paused);
element("whole").onclick = () => page.view && choose(null);
element("runs").onchange = (event) => stream.follow(event.target.value);
element("seconds").replaceChildren(...SECONDS.map((one) => new Option(`${one} s`, one, one === 10, one === 10)));
element("seconds").onchange = (event) => {
  if (!page.view) return;
  page.view.seconds = Number(event.target.value);
  page.view.showLive();
};
element("theme").onclick = () => {
  const dark = document.documentElement.dataset.theme !== "dark";
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  localStorage.setItem("rtctl-theme", dark ? "dark" : "light");
  themeButton();
  if (page.run) build();
};
document.addEventListener("keydown", (event) => {
  if (event.key === " " && !["INPUT", "SELECT", "BUTTON"].includes(event.target.tagName)) {
    event.preventDefault();
    pause(!page.paused);
  }
});
addEventListener("resize", () => {
  page.dirty = true;
  page.timing?.draw();
});

function themeButton() {
  element("theme").textContent = document.documentElement.dataset.theme === "dark" ? "Light" : "Dark";
}

themeButton();
buttons();
stream.follow("");
listRuns();
setInterval(listRuns, RUNS_EVERY_MS);
requestAnimationFrame(draw);
