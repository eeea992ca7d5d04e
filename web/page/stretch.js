// SPDX-License-Identifier: Apache-2.0
// Display levels of digital numbers, with the formulas and defaults of `--stretch` on the command line.

export const STRETCHES = {
  auto: "automatic",
  linear: "linear, full scale",
  percentile: "linear, 0.5 % to 99.5 %",
  asinh: "asinh",
  log: "logarithm",
  manual: "manual black and white",
};
const DEFAULTS = {asinh: 0.01, log: 1000};
const NUMBERS = 65536;

/** Number of pixels of each digital number. */
export function countsOf(pixels) {
  const counts = new Uint32Array(NUMBERS);
  for (let i = 0; i < pixels.length; ++i) ++counts[pixels[i]];
  return counts;
}

/** Digital number that the given share of the pixels does not exceed. */
export function quantileOf(counts, total, share) {
  if (!total) return 0;
  const index = Math.floor(share * (total - 1));
  let below = 0;
  for (let dn = 0; dn < NUMBERS; ++dn) if ((below += counts[dn]) > index) return dn;
  return NUMBERS - 1;
}

/** Black and white in DN. `manual`: {black, white}. */
export function endsOf(kind, counts, total, bits, manual) {
  const at = (share) => quantileOf(counts, total, share);
  let black, white;
  if (kind === "linear") [black, white] = [0, 2 ** bits - 1];
  else if (kind === "percentile") [black, white] = [at(0.005), at(0.995)];
  else if (kind === "manual") [black, white] = [manual.black, manual.white];
  else [black, white] = [at(0.05), at(0.9999)];
  // A star field has fewer bright pixels than that.
  if (!(white > black) && kind !== "manual") white = at(1);
  if (!(white > black)) white = black + 1;
  return {black, white};
}

/** Level from 0 (black) to 1 (white). */
export function level(kind, dn, {black, white}) {
  const x = Math.min(1, Math.max(0, (dn - black) / (white - black)));
  if (!(x > 0)) return 0;
  if (kind === "auto") return 0.8 * x ** (1 / 2.2) + 0.2 * Math.asinh(x / 1e-3) / Math.asinh(1e3);
  if (kind === "asinh") return Math.asinh(x / DEFAULTS.asinh) / Math.asinh(1 / DEFAULTS.asinh);
  if (kind === "log") return Math.log1p(DEFAULTS.log * x) / Math.log1p(DEFAULTS.log);
  return x;
}

/** Pixels of canvas (little-endian RGBA) for each digital number. */
export function tableOf(kind, ends) {
  const table = new Uint32Array(NUMBERS);
  for (let dn = 0; dn < NUMBERS; ++dn) {
    // Above white all are white: the formulas need not be worked out.
    const grey = dn >= ends.white ? 255 : Math.round(255 * level(kind, dn, ends));
    table[dn] = 0xff000000 | grey << 16 | grey << 8 | grey;
  }
  return table;
}
