/** The server's events: rows are decoded, counted and checked against each other; a lost server is asked again. */

const ASK_AGAIN_MS = 1000;

/** Return the array of numbers in a text of base 64. */
export function unpacked(text, Kind) {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  return new Kind(bytes.buffer);
}

/** What the page has received and drawn; read by tests and by whoever opens the console. */
export const counters = {
  rows: 0, // rows received
  lost: 0, // rows that are missing between two events without a word
  doubled: 0, // rows that came twice
  skipped: 0, // rows that the server has left out because the page was too slow
  connections: 0, // times that a server has answered
  recordings: 0, // recordings that were begun
  redraws: 0, // pictures drawn
  drawing_ms: 0, // time that this took [ms]
  sum: 0, // of the numbers of all rows, so that no error cancels another one
};

export class Stream {
  /** @param {object} hear functions by event: run, rows, skipped, events, state, timing, lost, found */
  constructor(hear) {
    this.hear = hear;
    this.last = ""; // last event: KEY-ROW
    this.lastRow = 0;
    this.source = null;
  }

  /** Follow a run by its name; "": the newest. */
  follow(name) {
    this.name = name;
    this.last = "";
    this.#connect();
  }

  #connect() {
    this.source?.close();
    clearTimeout(this.again);
    const query = new URLSearchParams({ run: this.name });
    if (this.last) query.set("last", this.last);
    const source = (this.source = new EventSource(`stream?${query}`));
    source.onopen = () => {
      counters.connections += 1;
      this.hear.found();
    };
    source.onerror = () => {
      this.hear.lost();
      if (source.readyState === EventSource.CLOSED) this.again = setTimeout(() => this.#connect(), ASK_AGAIN_MS);
    };
    for (const name of ["run", "events", "state", "timing"]) {
      source.addEventListener(name, (event) => this.#take(name, event));
    }
    source.addEventListener("rows", (event) => this.#rows(event));
    source.addEventListener("skipped", (event) => this.#skipped(event));
  }

  #take(name, event) {
    const content = JSON.parse(event.data);
    if (name === "run") {
      const same = content.key === this.key && content.next === this.lastRow + 1;
      this.key = content.key;
      this.lastRow = content.next - 1;
      if (same) return; // it goes on where it was
      counters.recordings += 1;
    }
    this.hear[name](content);
  }

  #rows(event) {
    const content = JSON.parse(event.data);
    const gap = content.first - this.lastRow - 1;
    if (gap > 0) counters.lost += gap;
    if (gap < 0) counters.doubled -= gap;
    const last = content.first + content.count - 1;
    counters.rows += content.count;
    counters.sum += (content.count * (content.first + last)) / 2;
    this.lastRow = last;
    this.last = event.lastEventId;
    this.hear.rows(unpacked(content.samples, Int32Array), unpacked(content.values, Float32Array), last);
  }

  #skipped(event) {
    const { first, last } = JSON.parse(event.data);
    counters.skipped += last - first + 1;
    this.lastRow = last;
    this.hear.skipped();
  }
}
