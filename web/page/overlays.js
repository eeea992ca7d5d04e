// SPDX-License-Identifier: Apache-2.0
// Drawing of a frame's truth over its picture: centres, limbs, motion, stars, windows, hot pixels.

/** What can be switched: key in `options.layers`, text of the switch, and whether it is on at first. */
export const overlayLayers = [
  {key: "centres", label: "centres", on: true},
  {key: "limb", label: "limbs", on: true},
  {key: "motion", label: "motion", on: true},
  {key: "stars", label: "stars", on: true},
  {key: "windows", label: "windows", on: false},
  {key: "hot_pixels", label: "hot pixels", on: false},
];

const COLOURS = {body: "#ffc14d", star: "#7fd4ff", window: "#8ee08e", hot: "#ff6ad5"};
const RED = {body: "#ff5a3c", star: "#ff5a3c", window: "#ff5a3c", hot: "#ff5a3c"};
const CASING = "#000", HIDDEN_FROM_SUN = [4, 4], CROSS = 6, STAR_RADIUS = 7, LEAST_RADIUS = 3, ARROW = 5;
/** Further stars have no name beside them, so that names can be read. */
const NAMED_STARS = 40;

/** Draws lines twice, dark and wide below, so that they are seen on any grey. */
class Pen {
  constructor(context, ratio) {
    this.context = context;
    this.ratio = ratio;
    this.words = []; // boxes of those that are drawn
  }
  /** `trace(context)` makes the path. */
  line(colour, trace, {width = 1.2, dash = []} = {}) {
    const {context, ratio} = this;
    context.beginPath();
    trace(context);
    context.setLineDash([]);
    context.globalAlpha = 0.5;
    context.strokeStyle = CASING;
    context.lineWidth = (width + 1.6) * ratio;
    context.stroke();
    context.globalAlpha = 1;
    context.setLineDash(dash.map((length) => length * ratio));
    context.strokeStyle = colour;
    context.lineWidth = width * ratio;
    context.stroke();
  }
  /** Begins at (x, y). Left out where other words stand already. */
  text(colour, words, x, y, size) {
    const {context, ratio} = this;
    context.setLineDash([]);
    context.font = `${size * ratio}px system-ui, sans-serif`;
    const box = {left: x, right: x + context.measureText(words).width, top: y - size * ratio, bottom: y};
    if (this.words.some((w) => box.left < w.right && w.left < box.right && box.top < w.bottom && w.top < box.bottom)) return;
    this.words.push(box);
    context.lineWidth = 2.5 * ratio;
    context.strokeStyle = CASING;
    context.strokeText(words, x, y);
    context.fillStyle = colour;
    context.fillText(words, x, y);
  }
}

/** Parts of a limb that are connected: lists of {at: [x, y] on the canvas, lit}. Between them the limb has null. */
export function limbParts(limb, lit, toCanvas) {
  const parts = [[]];
  limb.forEach((point, i) => {
    if (point) parts.at(-1).push({at: toCanvas(...point), lit: lit?.[i] ?? true});
    else if (parts.at(-1).length) parts.push([]);
  });
  return parts.filter((part) => part.length > 1);
}

/** A smooth curve through the points (Catmull-Rom as cubic Bezier segments), of those segments for which `wanted(from, to)`. */
function traceCurve(context, points, wanted) {
  const last = points.length - 1;
  const closed = points[0].at[0] === points[last].at[0] && points[0].at[1] === points[last].at[1];
  const before = (k) => points[k > 0 ? k - 1 : closed ? last - 1 : 0].at;
  const after = (k) => points[k < last ? k + 1 : closed ? 1 : last].at;
  let drawn = false;
  for (let k = 0; k < last; ++k) {
    const [from, to] = [points[k], points[k + 1]], draws = wanted(from, to);
    if (draws) {
      if (!drawn) context.moveTo(...from.at);
      const control = (at, a, b) => [at[0] + (b[0] - a[0]) / 6, at[1] + (b[1] - a[1]) / 6];
      context.bezierCurveTo(...control(from.at, before(k), to.at), ...control(to.at, after(k + 1), from.at), ...to.at);
    }
    drawn = draws;
  }
}

function drawLimb(pen, colour, body, toCanvas) {
  for (const points of limbParts(body.limb ?? [], body.limb_lit, toCanvas)) {
    const lit = (from, to) => from.lit && to.lit;
    pen.line(colour, (context) => traceCurve(context, points, (from, to) => !lit(from, to)), {dash: HIDDEN_FROM_SUN});
    pen.line(colour, (context) => traceCurve(context, points, lit));
  }
}

function drawCentre(pen, colour, body, toCanvas, radius) {
  const [x, y] = toCanvas(body.x, body.y), reach = CROSS * pen.ratio, aside = Math.min(radius, 200 * pen.ratio) * 0.72 + 4 * pen.ratio;
  pen.line(colour, (context) => {
    context.moveTo(x - reach, y), context.lineTo(x + reach, y);
    context.moveTo(x, y - reach), context.lineTo(x, y + reach);
    if (!(body.limb?.length > 1)) { // too small to have one, or it is not seen
      context.moveTo(x + radius, y);
      context.arc(x, y, radius, 0, 2 * Math.PI);
    }
  });
  pen.text(colour, body.name, x + aside, y - aside, 12);
}

/** An arrow from where the first row sees the body to where the last row does. */
function drawMotion(pen, colour, {start, end}, toCanvas) {
  const [x0, y0] = toCanvas(start.x, start.y), [x1, y1] = toCanvas(end.x, end.y);
  const angle = Math.atan2(y1 - y0, x1 - x0), head = ARROW * pen.ratio;
  pen.line(colour, (context) => {
    context.moveTo(x0, y0), context.lineTo(x1, y1);
    for (const side of [-0.5, 0.5]) {
      context.moveTo(x1, y1);
      context.lineTo(x1 - head * Math.cos(angle + side), y1 - head * Math.sin(angle + side));
    }
  }, {width: 2});
}

function drawStars(pen, colour, stars, toCanvas) {
  const radius = STAR_RADIUS * pen.ratio, places = stars.map((star) => toCanvas(star.x, star.y));
  pen.line(colour, (context) => {
    for (const [x, y] of places) context.moveTo(x + radius, y), context.arc(x, y, radius, 0, 2 * Math.PI);
  }, {width: 0.9});
  stars.slice(0, NAMED_STARS).forEach((star, k) => {
    if (star.name) pen.text(colour, star.name, places[k][0] + radius + 2 * pen.ratio, places[k][1] + 4 * pen.ratio, 10.5);
  });
}

/** The edges of pixels, half a pixel outside of the first and last centre. */
function traceBox(context, x, y, w, h, toCanvas) {
  const [left, top] = toCanvas(x - 0.5, y - 0.5), [right, bottom] = toCanvas(x + w - 0.5, y + h - 0.5);
  context.rect(left, top, right - left, bottom - top);
}

function drawWindows(pen, colour, windows, toCanvas) {
  for (const window of windows) {
    pen.line(colour, (context) => traceBox(context, window.x, window.y, window.w, window.h, toCanvas), {dash: [6, 3]});
    const [x, y] = toCanvas(window.x - 0.5, window.y - 0.5);
    pen.text(colour, window.name, x + 4 * pen.ratio, y + 14 * pen.ratio, 11);
  }
}

function drawHotPixels(pen, colour, pixels, toCanvas, scale) {
  const margin = Math.max(1, 3 * pen.ratio / scale); // a pixel may be smaller than one of the screen
  pen.line(colour, (context) => {
    for (const [x, y] of pixels) traceBox(context, x - margin, y - margin, 1 + 2 * margin, 1 + 2 * margin, toCanvas);
  }, {width: 1});
}

/**
 * Draws the answer `truth` of the call of that name on a canvas. `toCanvas(x, y)` gives [x, y] on the canvas of a point of the
 * image, whose pixels have their centres at integers; it keeps directions. `options`: `layers`, {key: boolean} of overlayLayers;
 * `ratio`, pixels of the canvas to one of CSS (1); `theme`, "red" for a dark laboratory.
 */
export function drawOverlays(context, truth, toCanvas, {layers = {}, ratio = 1, theme = ""} = {}) {
  if (!truth) return;
  const shown = (key) => layers[key] ?? overlayLayers.find((layer) => layer.key === key).on;
  const colours = theme === "red" ? RED : COLOURS, pen = new Pen(context, ratio);
  const [x0] = toCanvas(0, 0), [x1] = toCanvas(1, 0), scale = Math.abs(x1 - x0);
  context.save();
  context.lineJoin = "round";
  if (shown("windows")) drawWindows(pen, colours.window, truth.windows ?? [], toCanvas);
  if (shown("hot_pixels")) drawHotPixels(pen, colours.hot, truth.hot_pixels ?? [], toCanvas, scale);
  for (const body of truth.bodies) {
    if (body.x === null || body.x === undefined) continue;
    if (shown("limb")) drawLimb(pen, colours.body, body, toCanvas);
    if (shown("centres")) drawCentre(pen, colours.body, body, toCanvas, Math.max(LEAST_RADIUS * ratio, (body.radius_px ?? 0) * scale));
    if (shown("motion") && body.motion) drawMotion(pen, colours.body, body.motion, toCanvas);
  }
  if (shown("stars")) drawStars(pen, colours.star, truth.stars ?? [], toCanvas); // their names leave room to those of bodies
  context.restore();
}
