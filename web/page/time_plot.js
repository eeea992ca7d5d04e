// SPDX-License-Identifier: Apache-2.0
// Line plots of times over frames or rows on a logarithmic scale, by uPlot, with the table of their quantiles.
import {html, useEffect, useRef, useState} from "./vendor/preact-htm.js";
import {count, quantile, span} from "./format.js";

const HEIGHT_PX = 230, JUMP = 10, ZOOM = 2;
/** Dashes of the lines; page.css has their colours. */
const DASHES = [[], [7, 3], [2, 2], [10, 3, 2, 3]];
const dashOf = (k) => DASHES[k % DASHES.length];
const isDecade = (us) => Math.abs(Math.log10(us) - Math.round(Math.log10(us))) < 1e-6;
const known = (us) => us !== null && us !== undefined && !Number.isNaN(us);

let library = null; // loaded with the first plot: other screens do without
const loaded = () => library ??= import("./vendor/uplot.js").then((module) => module.default, (error) => { library = null; throw error; });

/** Decades that hold all of [least, most]. */
const decades = (least, most) => {
  const low = Math.floor(Math.log10(least));
  return [10 ** low, 10 ** Math.max(low + 1, Math.ceil(Math.log10(most)))];
};

/** What the plot draws: uPlot's arrays. Times that a logarithm does not have stand at the lower edge. */
function drawn({x, lines}) {
  const positive = lines.flatMap((line) => line.us).filter((us) => us > 0);
  const [low] = decades(Math.min(...positive), Math.max(...positive));
  return [x, ...lines.map((line) => line.us.map((us) => known(us) ? Math.max(us, low) : null))];
}

/** Whether not all of the data is shown. */
const isZoomed = ({scales: {x}, data: [at]}) => x.min > at[0] || x.max < at.at(-1);

/** A uPlot in `parent`. `of`: what x counts. `told(at)`: the cursor is at the index, or null. `zoomed(on)`: not all is shown. */
function makePlot(uPlot, parent, data, {lines, of, told, zoomed}) {
  const colour = (name) => () => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axis = {stroke: colour("--faint"), font: "12px system-ui, sans-serif", ticks: {show: false}, grid: {stroke: colour("--line"), width: 1}};
  const onDecades = (u, at) => at.map((us) => isDecade(us) ? us : null);
  return new uPlot({
    width: parent.clientWidth, height: HEIGHT_PX, legend: {show: false}, padding: [8, 14, 0, 0],
    cursor: {y: false, sync: {key: of}, drag: {x: true, y: false}, points: {size: 7}},
    scales: {x: {time: false}, y: {distr: 3, range: (u, least, most) => least > 0 ? decades(least, most) : [1, 10]}},
    axes: [{...axis, size: 28, space: 90, incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000], values: (u, at) => at.map(String)},
           {...axis, size: 62, filter: onDecades, grid: {...axis.grid, filter: onDecades}, values: (u, at) => at.map((us) => us === null ? "" : span(us))}],
    series: [{}, ...lines.map((line, k) => ({label: line.name, stroke: colour(`--line-${k}`), width: 1.6, dash: dashOf(k), spanGaps: false, points: {show: false}}))],
    hooks: {
      setCursor: [(u) => told(u.cursor.idx ?? null)],
      setScale: [(u, key) => { if (key === "x" && u.data[0].length) zoomed(isZoomed(u)); }],
    },
  }, data, parent);
}

/** Moves the cursor of a plot to index `at`, as far as that is shown. */
function moveCursor(plot, at) {
  const x = plot.data[0], {min, max} = plot.scales.x;
  const within = Math.min(x.findLastIndex((v) => v <= max), Math.max(x.findIndex((v) => v >= min), at));
  if (within >= 0) plot.setCursor({left: plot.valToPos(x[within], "x"), top: plot.over.clientHeight / 2}, true, true);
}

/** Shows a `factor` of the present range around the cursor; not below ten numbers, not beyond all. */
function zoom(plot, factor) {
  const x = plot.data[0], {min, max} = plot.scales.x, middle = x[plot.cursor.idx ?? -1] ?? (min + max) / 2;
  const width = Math.max(10, (max - min) * factor), from = Math.max(x[0], Math.min(middle - width / 2, x.at(-1) - width));
  show(plot, from, Math.min(x.at(-1), from + width));
}

const plots = new Set(); // on the page
/** Shows a range in all plots with the same cursor. */
const show = (plot, min, max) => { for (const one of plots) if (one.cursor.sync.key === plot.cursor.sync.key) one.setScale("x", {min, max}); };
const whole = (plot) => show(plot, plot.data[0][0], plot.data[0].at(-1));

function onKey(event, plot) {
  const at = plot.cursor.idx ?? plot.data[0].length, step = event.shiftKey ? JUMP : 1;
  const moves = {ArrowLeft: at - step, ArrowRight: at + step, Home: 0, End: plot.data[0].length - 1};
  if (event.key in moves) moveCursor(plot, moves[event.key]);
  else if (event.key === "+") zoom(plot, 1 / ZOOM);
  else if (event.key === "-") zoom(plot, ZOOM);
  else if (event.key === "Escape") whole(plot);
  else return;
  event.preventDefault();
}

/** Lines over whole numbers. `x`: numbers of frames, or `of` something else, in increasing order; `lines`: [{name, us: [number or null]}]. The
 *  mouse shows the figures of a number and zooms, as the arrow keys, + and - do; plots of the same have one cursor. `choose(x)`: Enter or a click. */
export function TimePlot({title, x, lines, of = "frame", choose}) {
  const place = useRef(null), plot = useRef(null), latest = useRef(null), none = lines.every((line) => !line.us.some((us) => us > 0));
  const [cursor, setCursor] = useState(null), [zoomed, setZoomed] = useState(false), [hidden, setHidden] = useState([]), [error, setError] = useState("");
  latest.current = {x, lines, choose};
  const names = lines.map((line) => line.name).join("\n"), empty = x.length < 2 || none;
  useEffect(() => {
    if (empty) return undefined;
    let on = true, observer = null, theme = null;
    loaded().then((uPlot) => {
      if (!on || !place.current) return; // no longer shown
      const parent = place.current, made = plot.current = makePlot(uPlot, parent, drawn(latest.current), {of, lines: latest.current.lines, told: setCursor, zoomed: setZoomed});
      made.ctx.canvas.setAttribute("aria-hidden", "true"); // its parent tells the figures
      plots.add(made);
      observer = new ResizeObserver(() => made.setSize({width: parent.clientWidth, height: HEIGHT_PX}));
      observer.observe(parent);
      theme = new MutationObserver(() => made.redraw(false, true));
      theme.observe(document.documentElement, {attributeFilter: ["data-theme"]});
      let down = 0;
      made.over.addEventListener("mousedown", (event) => { down = event.clientX; });
      made.over.addEventListener("click", (event) => { if (Math.abs(event.clientX - down) < 3 && made.cursor.idx !== null) latest.current.choose?.(latest.current.x[made.cursor.idx]); });
    }, () => setError("The plot could not be loaded; the table has its figures."));
    return () => { on = false; observer?.disconnect(); theme?.disconnect(); plots.delete(plot.current); plot.current?.destroy(); plot.current = null; };
  }, [names, empty]);
  useEffect(() => {
    const made = plot.current;
    if (!made) return;
    // What was zoomed to stays, as long as it is there. The plot knows it before this component does.
    const keep = isZoomed(made) && made.scales.x.min >= x[0] && made.scales.x.max <= x.at(-1);
    // Keys have chosen a number, the mouse a place.
    const chosen = document.activeElement === place.current && made.cursor.idx !== null ? made.data[0][made.cursor.idx] : null;
    made.setData(drawn({x, lines}), !keep);
    if (keep) made.redraw();
    if (chosen !== null) moveCursor(made, x.indexOf(chosen));
    lines.forEach((line, k) => { if (made.series[k + 1].show === hidden.includes(line.name)) made.setSeries(k + 1, {show: !hidden.includes(line.name)}); });
  }, [x, lines, hidden]);
  if (empty) return html`<p class="note">No ${of}s yet.</p>`;
  const at = cursor !== null && cursor < x.length ? cursor : null;
  const all = `${of}s ${x[0]} to ${x.at(-1)}`, one = at === null ? all : `${of} ${x[at]}`;
  const figures = at === null ? "" : lines.map((line) => `${line.name} ${span(line.us[at])}`).join(", ");
  return html`<figure class="timeplot">
    <div class="plot" ref=${place} tabindex="0" role="slider" aria-label=${`${title}; arrow keys show a ${of}, + and - zoom`} aria-valuemin=${x[0]} aria-valuemax=${x.at(-1)} aria-valuenow=${x[at ?? x.length - 1]}
      aria-valuetext=${at === null ? all : `${one}: ${figures}`}
      onKeyDown=${(event) => { if (event.key === "Enter" && at !== null) choose?.(x[at]); else if (plot.current) onKey(event, plot.current); }}></div>
    ${error && html`<p class="note" role="note">${error}</p>`}
    <figcaption class="legend"><span class="at">${one}</span>
      ${lines.map((line, k) => html`<button type="button" key=${line.name} class="mini" aria-pressed=${String(!hidden.includes(line.name))} title="shows or hides the line"
        onClick=${() => setHidden(hidden.includes(line.name) ? hidden.filter((name) => name !== line.name) : [...hidden, line.name])}><svg class="key" viewBox="0 0 24 8" aria-hidden="true"><path class=${`line line-${k}`} stroke-dasharray=${dashOf(k).join(" ")} d="M0 4L24 4" /></svg>${line.name}${
        at !== null && html` <b>${span(line.us[at])}</b>`}</button>`)}
      ${zoomed && html`<button type="button" onClick=${() => plot.current && whole(plot.current)}>all ${of}s</button>`}</figcaption>
  </figure>`;
}

/** Quantiles of each line of a TimePlot. */
export function SpanTable({lines}) {
  const shown = lines.map((line) => ({name: line.name, sorted: line.us.filter(known).sort((a, b) => a - b)}));
  return html`<table class="grid"><thead><tr><th scope="col">stage</th>${["frames", "p50", "p90", "p99", "max"].map((t) =>
    html`<th scope="col" class="number">${t}</th>`)}</tr></thead>
    <tbody>${shown.map(({name, sorted}) => html`<tr key=${name}><th scope="row">${name}</th><td class="number">${count(sorted.length)}</td>
      ${[0.5, 0.9, 0.99, 1].map((share) => html`<td class="number">${span(quantile(sorted, share))}</td>`)}</tr>`)}</tbody></table>`;
}
