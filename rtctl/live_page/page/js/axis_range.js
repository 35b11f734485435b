/** The range of an axis that follows what is in view: it grows at once and shrinks late, so that it does not flicker. */

const SHRINK_BELOW = 0.55; // share of the axis that the lines fill, below which it shrinks at once
const FITS_FROM = 0.8; // share from which it stays as it is; between the two it shrinks after a while
const SHRINK_AFTER_MS = 1500;

export class AxisRange {
  /** @param {number} spare share of the height that is left free at each end */
  constructor(spare) {
    this.spare = spare;
    this.range = null;
    this.#forget();
  }

  /**
   * Return the range for numbers from `low` to `high`.
   * @param {boolean} live whether the numbers move on; else the range is that of these numbers alone
   * @param {number} now_ms time of this look [ms]
   */
  follow(low, high, live, now_ms) {
    const old = this.range;
    if (!(low <= high)) return old ?? this.#take(0, 1); // there is no number in view
    const share = old ? heightOf(low, high) / (old[1] - old[0]) : 0;
    if (!live || !old || old[0] > low || old[1] < high || share <= SHRINK_BELOW) return this.#take(low, high);
    if (share >= FITS_FROM) {
      this.#forget();
      return old;
    }
    this.lowest = Math.min(this.lowest, low);
    this.highest = Math.max(this.highest, high);
    this.since_ms ??= now_ms;
    return now_ms - this.since_ms < SHRINK_AFTER_MS ? old : this.#take(this.lowest, this.highest);
  }

  #take(low, high) {
    const spare = this.spare * heightOf(low, high);
    this.range = [low - spare, high + spare];
    this.#forget();
    return this.range;
  }

  /** Forget since when the axis was too large, and what was seen meanwhile. */
  #forget() {
    this.since_ms = null;
    this.lowest = Infinity;
    this.highest = -Infinity;
  }
}

function heightOf(low, high) {
  return high - low || Math.abs(high) * 0.1 || 1;
}
