// SPDX-License-Identifier: Apache-2.0
// Marks: figures since an instant that the operator chooses. The daemon counts on; a mark is kept as long as the page is.
import {useState} from "./vendor/preact-htm.js";

const marks = new Map(); // of cameras, by their ids

/** The mark of a camera, or null: {mark, setMark}. */
export function useMark(camera) {
  const [, setTurn] = useState(0);
  const setMark = (mark) => {
    if (mark) marks.set(camera.id, mark);
    else marks.delete(camera.id);
    setTurn((turn) => turn + 1);
  };
  return {mark: marks.get(camera.id) ?? null, setMark};
}

/** What a mark remembers. `acquisition`: that of the newest frames; `up_s`: of the daemon. */
export const markOf = ({state}, acquisition, up_s) =>
  ({frame: Number(state.frame_id), acquisition, up_s, camera: state.camera, latency_us: state.latency_us ?? {}, stages_us: state.stages_us ?? {}});

/** Counts since those of the mark, by their names; without a mark as they are. */
export const countsSince = (now, then) => then ? Object.fromEntries(Object.entries(now ?? {}).map(([name, n]) => [name, typeof n === "number" ? n - (then[name] ?? 0) : n])) : now ?? {};

/** A histogram since that of the mark: buckets are exact, of quantiles only the bucket is known (`atMost`). */
export function histogramSince(now, then, bounds) {
  if (!then) return now;
  const upTo = now.up_to.map((n, k) => n - then.up_to[k]), count = now.count - then.count, grown = now.max > then.max;
  const atMost = (share) => count ? Math.min(bounds[upTo.findIndex((n) => n >= Math.max(1, Math.ceil(share * count)))] ?? now.max, now.max) : undefined;
  return {count, up_to: upTo, sum: now.sum - then.sum, p50: atMost(0.5), p99: atMost(0.99), max: grown ? now.max : atMost(1), atMost: true, maxExact: grown};
}

/** The frames that have begun since the mark. */
export function rowsSince({columns, rows}, mark) {
  const acquisition = columns.indexOf("acquisition");
  return mark ? rows.filter((row) => row[acquisition] !== mark.acquisition || row[0] > mark.frame) : rows;
}
