/** Colours of the signals by their role, from the style sheet, so that dark and light have their own. */

const ALWAYS = {
  setpoint: "--ink", measured: "--measured", estimate: "--estimate", band: "--band", error: "--ink",
  sensing_error: "--estimate",
};
const FIRST = { command: 3, reading: 4 }; // the others of a panel follow in the order of the cycle
const CYCLE = [1, 2, 3, 4, 5, 6];

const known = new Map(); // a look into the style sheet costs more than a line of a chart
let theme = "";

/** Return a colour of the style sheet. */
export function colour(name) {
  const root = document.documentElement;
  if (theme !== root.dataset.theme) known.clear();
  theme = root.dataset.theme;
  if (!known.has(name)) known.set(name, getComputedStyle(root).getPropertyValue(name).trim());
  return known.get(name);
}

/** Return the colour of a signal that is the `place`-th one of its panel. */
export function colourOf(signal, place) {
  const first = FIRST[signal.role] ?? 1;
  const order = [first, ...CYCLE.filter((one) => one !== first)];
  return colour(ALWAYS[signal.role] ?? `--other-${order[place % order.length]}`);
}

/** Return words for a signal's name. */
export function words(name) {
  return name.replaceAll("_", " ");
}

/** Return a number with as many digits as a person reads. */
export function figure(value, digits = 5) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e7 || size < 1e-3) return Number(value.toPrecision(digits - 1)).toExponential().replace("e+", "e");
  return `${Number(value.toPrecision(digits))}`;
}

/** Return the numbers along an axis, with as many digits as tell each from the next: 7.01755 and 7.0176. */
export function alongAxis(values) {
  const step = Math.abs(values[1] - values[0]);
  const size = Math.max(...values.map(Math.abs));
  const needed = Math.ceil(Math.log10(size / step)) + 2;
  const digits = Number.isFinite(needed) ? Math.min(Math.max(needed, 5), 15) : 5;
  return values.map((one) => figure(one, digits));
}

/** Return words with a capital letter. */
export function capital(text) {
  return text.slice(0, 1).toUpperCase() + text.slice(1);
}
