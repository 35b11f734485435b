/** The events of a run as a list, and its verdict once it has ended. */

import { figure } from "./colours.js";

/** Write the events, the newest first. @param {Function} show called with the time [s] of an event that is clicked */
export function writeEvents(events, show) {
  const list = document.getElementById("log");
  list.parentElement.hidden = events.length === 0;
  list.replaceChildren(
    ...events.toReversed().map((event) => {
      const item = document.createElement("li");
      item.className = event.kind;
      const time = document.createElement("time");
      time.textContent = `${figure(event.time_s)} s`;
      time.title = "Show this moment";
      time.onclick = () => show(event.time_s);
      const text = document.createElement("span");
      text.textContent = event.text;
      item.append(time, text);
      return item;
    }),
  );
}

/** Write verdict and figures of a run that has ended; null: it has not. */
export function writeVerdict(summary) {
  const box = document.getElementById("verdict");
  box.hidden = !summary;
  if (!summary) return;
  box.className = summary.verdict;
  const verdict = document.createElement("b");
  verdict.textContent = summary.verdict;
  const lines = summary.lines.map((line) => {
    const text = document.createElement("span");
    text.textContent = line;
    return text;
  });
  box.replaceChildren(verdict, ...lines);
}
