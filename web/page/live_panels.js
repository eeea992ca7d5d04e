// SPDX-License-Identifier: Apache-2.0
// Panels beside the live picture: probe with estimated electrons, stretch with histogram, region of interest.
import {html, useEffect, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand} from "./api.js";
import {count, figure} from "./format.js";
import {Facts, Note, Said} from "./parts.js";
import {STRETCHES} from "./stretch.js";

/** Electrons that a digital number stands for, by the linear model: {electrons, formula}; else {why}.
 *  `values`: feature rows by name; `entries`: the daemon's configuration; `number`: of the camera. */
export function electronsOf(dn, values, entries, number) {
  if (dn === undefined || dn === null) return {why: ""};
  const gains = (entries ?? []).filter((entry) => /(^|\.)detector\.gain_dn_per_e$/.test(entry.key));
  const k = Number((gains.length > 1 ? gains[number] : gains[0])?.value);
  if (!(k > 0)) return {why: "the system gain is not known: the daemon does not tell its configuration"};
  if (!values.BlackLevel || !values.Gain) return {why: "BlackLevel and Gain are not known"};
  const black = values.BlackLevel.value, db = values.Gain.value;
  const electrons = (dn - black) / (k * 10 ** (db / 20));
  return {electrons, formula: `(${dn} DN − ${figure(black)} DN) / (${figure(k)} DN/e- · 10^(${figure(db)} dB / 20))`};
}

/** `reference`: the frame that this one is compared with, or null. */
export function Probe({cursor, probed, electrons, reference, children}) {
  const place = cursor ? `${cursor.x}, ${cursor.y}` : "–";
  const what = !probed ? "" : probed.bin > 1 ? `${probed.reduce === "max" ? "largest" : "mean"} of ${probed.bin} x ${probed.bin} from ${probed.x}, ${probed.y}; 1:1 shows the pixel` : "the pixel itself";
  return html`<div class="panel probe-panel"><h2>Probe</h2>
    <table class="facts" aria-label="Probe"><tbody>
      <tr><th scope="row">x, y</th><td class="number">${place}</td></tr>
      <tr><th scope="row">DN</th><td class="number" id="probe-dn">${probed ? count(probed.dn) : "–"}</td></tr>
      ${reference && html`<tr><th scope="row">DN in frame ${reference.frame}</th><td class="number">${probed?.reference === undefined ? "–" : `${count(probed.reference)} (${probed.dn < probed.reference ? "−" : "+"}${count(Math.abs(probed.dn - probed.reference))})`}</td></tr>`}
      <tr><th scope="row">electrons, estimated</th><td class="number" id="probe-electrons">${electrons.electrons === undefined ? "–" : figure(electrons.electrons, 5)}</td></tr>
    </tbody></table>
    <p class="small">${what}${electrons.formula ? html`<br />${electrons.formula}` : electrons.why ? html`<br />${electrons.why}` : ""}</p>${children}</div>`;
}

const WIDTH = 320, HEIGHT = 90, PROFILE_HEIGHT = 54;

/** Digital numbers along the row and the column of the probe, as far as they are shown. */
export function Profile({viewer, cursor}) {
  const p = viewer?.picture;
  if (!p?.pixels || !cursor) return null;
  const column = Math.floor((cursor.x - p.x) / p.bin), line = Math.floor((cursor.y - p.y) / p.bin);
  const row = p.pixels.subarray(line * p.columns, (line + 1) * p.columns), down = Uint16Array.from({length: p.lines}, (_, k) => p.pixels[k * p.columns + column]);
  const plot = (name, values, at) => {
    let low = values[0], high = values[0];
    for (const v of values) { low = Math.min(low, v); high = Math.max(high, v); }
    const x = (k) => (WIDTH * (k + 0.5) / values.length).toFixed(1), y = (v) => (PROFILE_HEIGHT - 3 - (PROFILE_HEIGHT - 6) * (v - low) / Math.max(1, high - low)).toFixed(1);
    let path = "";
    values.forEach((v, k) => { path += `${k ? "L" : "M"}${x(k)} ${y(v)}`; });
    return html`<div><span class="small">${name}: ${count(low)} to ${count(high)} DN</span>
      <svg class="profile" viewBox=${`0 0 ${WIDTH} ${PROFILE_HEIGHT}`} role="img" aria-label=${`${name}: ${low} to ${high} DN`}><path class="here" d=${`M${x(at)} 0V${PROFILE_HEIGHT}`} /><path d=${path} /></svg></div>`;
  };
  return html`<details class="panel"><summary>Profiles through the probe</summary>${plot(`row ${cursor.y}`, row, column)}${plot(`column ${cursor.x}`, down, line)}</details>`;
}

/** Area under the logarithm of the counts. */
function outline(bins) {
  const most = Math.log1p(Math.max(1, ...bins)), step = WIDTH / bins.length;
  let path = `M0 ${HEIGHT}`;
  bins.forEach((n, k) => {
    const y = (HEIGHT - (HEIGHT - 4) * Math.log1p(n) / most).toFixed(1);
    path += `L${(k * step).toFixed(1)} ${y}L${((k + 1) * step).toFixed(1)} ${y}`;
  });
  return `${path}L${WIDTH} ${HEIGHT}Z`;
}

export function Levels({stretch, setStretch, viewer, histogram}) {
  const bits = viewer?.picture?.bits ?? 12, full = 2 ** bits - 1;
  // The viewer follows a moment later: what was typed before counts at once.
  const endsIn = (chosen) => chosen.kind === "manual" ? chosen : viewer?.ends ?? {black: 0, white: full}, ends = endsIn(stretch);
  const mark = (dn) => WIDTH * Math.min(1, Math.max(0, dn / full));
  const setEnd = (name) => ({target: {value}}) => setStretch((before) => {
    const {black, white} = endsIn(before);
    return {kind: "manual", black: Math.round(black), white: Math.round(white), [name]: Number(value)};
  });
  return html`<div class="panel"><h2>Levels</h2>
    <label class="row">Stretch <select value=${stretch.kind} onChange=${(e) => setStretch(e.target.value === "manual" ? {kind: "manual", black: ends.black, white: ends.white} : {...stretch, kind: e.target.value})}>
      ${Object.entries(STRETCHES).map(([kind, name]) => html`<option key=${kind} value=${kind}>${name}</option>`)}</select></label>
    ${["black", "white"].map((name) => html`<label class="row" key=${name}>${name} <input type="range" min="0" max=${full} value=${ends[name]} onInput=${setEnd(name)} aria-label=${`${name} level, DN`} />
      <input type="number" min="0" max=${full} value=${ends[name]} onChange=${setEnd(name)} aria-label=${`${name} level, DN`} /></label>`)}
    ${histogram ? html`<svg class="dn-histogram" viewBox=${`0 0 ${WIDTH} ${HEIGHT + 14}`} role="img" aria-label=${`Histogram of frame ${histogram.frame}: ${histogram.min} to ${histogram.max} DN, median ${histogram.p50}`}>
        <path class="area" d=${outline(histogram.bins)} /><line x1="0" y1=${HEIGHT} x2=${WIDTH} y2=${HEIGHT} />
        <path class="ends" d=${`M${mark(ends.black)} 0V${HEIGHT}M${mark(ends.white)} 0V${HEIGHT}`} />
        <text x="0" y=${HEIGHT + 11}>0 DN</text><text x=${WIDTH} y=${HEIGHT + 11} text-anchor="end">${full} DN; pixels: logarithm</text></svg>
      <${Facts} label="Digital numbers" bad=${["saturated pixels"]} rows=${[
        ["saturated pixels", histogram.saturated], ["least, most", `${figure(histogram.min)}, ${figure(histogram.max)} DN`],
        ["mean", `${figure(histogram.mean)} DN`], ["median, 99 %", `${figure(histogram.p50)}, ${figure(histogram.p99)} DN`]]} />
      <p class="small">Of all pixels of frame ${histogram.frame}, whatever part is shown.</p>` : html`<p class="note">No histogram yet.</p>`}
  </div>`;
}

const NAMES = {x: "OffsetX", y: "OffsetY", width: "Width", height: "Height"};

/** Ends of a feature's range, from its row: {min, max, step}. */
export function rangeOf(row) {
  const found = /^(-?[\d.e+-]+) to (-?[\d.e+-]+)/.exec(row?.allowed ?? "");
  return {min: row?.min ?? (found ? Number(found[1]) : undefined), max: row?.max ?? (found ? Number(found[2]) : undefined), step: row?.increment ?? 1};
}

/** A region drawn on the image as values of the features: on the sensor, in whole increments. */
export function featuresOf(region, values) {
  const down = (value, step) => Math.floor(value / step) * step;
  const out = {};
  for (const [side, size] of [["x", "width"], ["y", "height"]]) {
    const offset = rangeOf(values[NAMES[side]]), extent = rangeOf(values[NAMES[size]]);
    const from = (values[NAMES[side]]?.value ?? 0) + region[side], end = from + region[size];
    const at = Math.max(0, down(from, offset.step));
    const most = (extent.max ?? Infinity) - at;
    const wanted = Math.ceil((end - at) / extent.step) * extent.step;
    out[NAMES[size]] = Math.max(extent.min ?? extent.step, Math.min(down(most, extent.step), wanted));
    out[NAMES[side]] = Math.min(at, down(Math.max(0, (extent.max ?? Infinity) - out[NAMES[size]]), offset.step));
  }
  return out;
}

/** Region of interest: numbers of the one drawn, or typed; setting them stops the acquisition for a moment. `fresh()`: the camera as it is
 *  now, which `camera` need not be right after a command. */
export function Region({camera, fresh, values, error, may, region, setRegion, image, changed}) {
  const command = useCommand();
  const [typed, setTyped] = useState(null);
  useEffect(() => { if (region && values.Width) setTyped(featuresOf(region, values)); }, [region]);
  const now = values.Width ? {Width: values.Width.value, Height: values.Height.value, OffsetX: values.OffsetX.value, OffsetY: values.OffsetY.value} : null;
  const shown = typed ?? now;
  const set = (wanted) => command.run(async () => {
    const running = (await fresh()).state.acquiring;
    const acquisition = (on) => askJson(cameraPath(camera.id, "acquisition"), {method: "POST", body: {running: on}});
    if (running) await acquisition(false);
    try {
      await askJson(cameraPath(camera.id, "features"), {method: "PATCH", body: wanted});
    } finally {
      if (running) await acquisition(true);
    }
    setTyped(null);
    setRegion(null);
    changed();
    return `Set: ${wanted.Width} x ${wanted.Height} at ${wanted.OffsetX}, ${wanted.OffsetY}.`;
  });
  const whole = now && {Width: rangeOf(values.Width).max, Height: rangeOf(values.Height).max, OffsetX: 0, OffsetY: 0};
  return html`<div class="panel"><h2>Region of interest</h2>
    ${error && !shown && html`<${Note} error=${error} />`}
    ${shown && html`<form onSubmit=${(e) => { e.preventDefault(); set(shown); }}>
      <div class="quad">${Object.values(NAMES).map((name) => html`<label key=${name}>${name} <input type="number" name=${name} min="0" max=${rangeOf(values[name]).max} step=${rangeOf(values[name]).step}
        value=${shown[name]} disabled=${!may.operate} onInput=${(e) => setTyped({...shown, [name]: Number(e.target.value)})} /></label>`)}</div>
      <p class="small">${image?.width ? `Now ${now.Width} x ${now.Height} at ${now.OffsetX}, ${now.OffsetY}.` : ""} Draw it on the picture, or type.</p>
      ${may.operate && html`<div class="buttons"><button type="submit" disabled=${command.busy || !typed}>${camera.state.acquiring ? "stop, set, start" : "set"}</button>
        <button type="button" disabled=${!typed && !region} onClick=${() => { setTyped(null); setRegion(null); }}>forget</button>
        <button type="button" disabled=${command.busy} onClick=${() => set(whole)}>whole sensor</button></div>`}
      <${Said} of=${command} /></form>`}
  </div>`;
}
