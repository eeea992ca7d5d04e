// SPDX-License-Identifier: Apache-2.0
// Numbers as texts: times, durations, counts.

/** Three digits with a unit, of microseconds. */
export function span(us) {
  if (us === undefined || us === null || Number.isNaN(us)) return "–";
  const size = Math.abs(us);
  if (size < 1e3) return `${+us.toPrecision(3)} us`;
  if (size < 1e6) return `${+(us / 1e3).toPrecision(3)} ms`;
  return `${+(us / 1e6).toPrecision(3)} s`;
}

export function duration(s) {
  const minutes = Math.floor(s / 60), hours = Math.floor(minutes / 60), days = Math.floor(hours / 24);
  if (days) return `${days} d ${hours % 24} h`;
  if (hours) return `${hours} h ${minutes % 60} min`;
  return minutes ? `${minutes} min ${Math.floor(s % 60)} s` : `${Math.floor(s)} s`;
}

/** A count with blanks between thousands. */
export const count = (n) => n === undefined || n === null ? "–" : String(n).replace(/\B(?=(\d{3})+$)/g, "\u202f");

/** A number for the eye: at most `digits` significant ones. */
export function figure(value, digits = 6) {
  if (value === null || value === undefined) return "–";
  if (typeof value !== "number") return String(value);
  return Number.isInteger(value) ? count(value) : String(+value.toPrecision(digits));
}

/** TAI in ns since 1970, a BigInt, as TAI date and time. `source` is what the state of a camera says of its TAI: with "unknown" it is UTC. */
export function taiText(ns, source) {
  const ms = Number(ns / 1000000n);
  return Number.isFinite(ms) && Math.abs(ms) < 8.64e15 ? `${new Date(ms).toISOString().replace("T", " ").replace("Z", "")} ${source === "unknown" ? "UTC" : "TAI"}` : "–";
}

/** Snake case for people. */
export const words = (name) => name.replaceAll("_", " ");

/** Value of a share of sorted numbers, as `obscura timing` counts: the smallest that at least that share does not exceed. */
export function quantile(sorted, share) {
  return sorted.length ? sorted[Math.max(1, Math.ceil(share * sorted.length)) - 1] : undefined;
}
