// SPDX-License-Identifier: Apache-2.0
// Whole frames in the browser: fetched by their ids, cut and binned as the server does, compared with one another.
import {ask, cameraPath} from "./api.js";

/** A frame that the server keeps: {id, frame, width, height, rows, bits, pixels}. Throws Refused. */
export async function fetchFrame(camera, id) {
  const answer = await ask(cameraPath(camera.id, `frames/${id}.raw`));
  const told = (name) => Number(answer.headers.get(`X-Obscura-${name}`));
  return {id, frame: answer.headers.get("X-Obscura-Frame"), width: told("Width"), height: told("Height"), rows: told("Rows"), bits: told("Bits"),
          pixels: new Uint16Array(await answer.arrayBuffer())};
}

/** The part {x, y, w, h} of a frame in blocks of bin x bin, w or h 0 up to its edge: {x, y, w, h, bin, reduce, columns, lines, pixels}. */
export function viewOf(frame, view) {
  const {bin, reduce} = view, x = Math.min(view.x, frame.width - 1), y = Math.min(view.y, frame.height - 1);
  const w = Math.min(view.w || frame.width, frame.width - x), h = Math.min(view.h || frame.height, frame.height - y);
  const columns = Math.ceil(w / bin), lines = Math.ceil(h / bin), pixels = new Uint16Array(columns * lines);
  const largest = reduce === "max", sums = new Float64Array(columns);
  for (let line = 0; line < lines; ++line) {
    const first = y + line * bin, end = Math.min(first + bin, y + h);
    sums.fill(0);
    for (let row = first; row < end; ++row) {
      const from = row * frame.width + x;
      for (let column = 0, k = 0; column < columns; ++column) {
        for (const stop = Math.min(w, (column + 1) * bin); k < stop; ++k) {
          const dn = frame.pixels[from + k];
          if (!largest) sums[column] += dn;
          else if (dn > sums[column]) sums[column] = dn;
        }
      }
    }
    for (let column = 0; column < columns; ++column) {
      const count = (end - first) * (Math.min(w, (column + 1) * bin) - column * bin);
      pixels[line * columns + column] = largest ? sums[column] : Math.floor(sums[column] / count + 0.5);
    }
  }
  return {x, y, w, h, bin, reduce, columns, lines, pixels};
}

/** Pixel by pixel, this minus the reference: {values, least, most, mean, differing}. */
export function differenceOf(pixels, reference) {
  const values = new Int32Array(pixels.length);
  let least = Infinity, most = -Infinity, sum = 0, differing = 0;
  for (let i = 0; i < values.length; ++i) {
    const by = values[i] = pixels[i] - reference[i];
    if (by) ++differing;
    sum += by;
    if (by < least) least = by;
    if (by > most) most = by;
  }
  return {values, least, most, mean: values.length ? sum / values.length : 0, differing};
}
