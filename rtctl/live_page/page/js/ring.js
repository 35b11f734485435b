/** The newest rows, in arrays that are made once: when they are full, the newer half moves to the front. */
export class Ring {
  /** @param {number} signals number of signals  @param {number} rows rows that are kept at least */
  constructor(signals, rows) {
    this.rows = rows;
    this.time = new Float64Array(2 * rows);
    this.values = Array.from({ length: signals }, () => new Float32Array(2 * rows));
    this.begin = 0; // place of the oldest row
    this.end = 0; // place behind the newest row
    this.lastRow = 0; // number of the newest row
  }

  get length() {
    return this.end - this.begin;
  }

  clear() {
    this.begin = this.end = 0;
  }

  /**
   * Append rows.
   * @param {Int32Array} samples numbers of their samples  @param {Float32Array} values signals one after the other
   * @param {number} period_s sample period [s]  @param {number} lastRow number of the last of them
   */
  append(samples, values, period_s, lastRow) {
    const count = samples.length;
    const kept = Math.min(count, this.rows);
    const from = count - kept;
    if (this.end + kept > this.time.length) this.#move(Math.min(this.length, this.rows - kept));
    for (let k = 0; k < kept; k++) this.time[this.end + k] = period_s * samples[from + k];
    this.values.forEach((column, number) => {
      column.set(values.subarray(number * count + from, (number + 1) * count), this.end);
    });
    this.end += kept;
    this.begin = Math.max(this.begin, this.end - this.rows);
    this.lastRow = lastRow;
  }

  /** Return the place of the first row at or after a time [s]. */
  placeOf(time_s) {
    let low = this.begin;
    let high = this.end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time[middle] < time_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  #move(rows) {
    const from = this.end - rows;
    this.time.copyWithin(0, from, this.end);
    for (const column of this.values) column.copyWithin(0, from, this.end);
    this.begin = 0;
    this.end = rows;
  }
}
