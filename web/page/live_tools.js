// SPDX-License-Identifier: Apache-2.0
// Panels of the live picture that act on a frame: truth of a pixel, saving the very frame that is shown, comparing it with another.
import {html, useCallback, useEffect, useLayoutEffect, useRef, useState} from "./vendor/preact-htm.js";
import {ask, askJson, cameraPath, save, useCommand} from "./api.js";
import {count, figure, span} from "./format.js";
import {fetchFrame} from "./frames.js";
import {ageOf} from "./live_socket.js";
import {drawOverlays, overlayLayers} from "./overlays.js";
import {Facts, Said} from "./parts.js";

const AGE_MS = 500, BLINK_MS = 700;

/** State that the browser keeps under `name`; one of an earlier page that is none is forgotten. */
export function useRemembered(name, initial) {
  const [value, setValue] = useState(() => {
    try {
      return {...initial, ...JSON.parse(localStorage.getItem(name) ?? "{}")};
    } catch {
      return initial;
    }
  });
  const change = useCallback((next) => setValue((before) => {
    const after = {...before, ...next};
    localStorage.setItem(name, JSON.stringify(after));
    return after;
  }), [name]);
  return [value, change];
}

/** How old the picture is, from the server's stamps. */
export function Age({picture}) {
  const [, setTurn] = useState(0);
  useEffect(() => {
    const timer = setInterval(() => setTurn((turn) => turn + 1), AGE_MS);
    return () => clearInterval(timer);
  }, []);
  const age = ageOf(picture);
  return html`<span id="age">${age === null ? "not known" : span(age * 1e6)}</span>`;
}

/** The truth of a frame over its picture, on a canvas of its own. `shown`: which turn of drawing this is for. */
export function Overlays({viewer, truth, layers, ratio, theme}) {
  const canvas = useRef(null);
  useLayoutEffect(() => {
    const {width, height} = viewer.canvas;
    if (canvas.current.width !== width) canvas.current.width = width;
    if (canvas.current.height !== height) canvas.current.height = height;
    const context = canvas.current.getContext("2d");
    context.clearRect(0, 0, width, height);
    const toCanvas = (x, y) => {
      const at = viewer.toScreen(x + 0.5, y + 0.5);
      return [at.x, at.y];
    };
    drawOverlays(context, truth, toCanvas, {layers, ratio, theme});
  });
  return html`<canvas class="overlay" ref=${canvas} aria-hidden="true"></canvas>`;
}

/** Switches of the overlays. */
export function Layers({layers, setLayers, all, setAll, error}) {
  return html`<div class="toolbar layers" role="group" aria-label="Overlays">
    <button aria-pressed=${String(all && !error)} disabled=${!!error} title=${error?.message ?? "key b"} onClick=${() => setAll(!all)}>overlays</button>
    ${overlayLayers.map(({key, label}) => html`<label key=${key}><input type="checkbox" name=${`layer-${key}`} checked=${layers[key]} disabled=${!all || !!error}
      onChange=${(e) => setLayers({[key]: e.target.checked})} />${label}</label>`)}
    ${error && html`<span class="small why" title=${error.message}>${error.message}</span>`}</div>`;
}

/** What the scene says of a pixel: asked for with a click, one pixel at a time. */
export function useProbe(camera) {
  const [state, setState] = useState(null), turn = useRef(0);
  const probe = useCallback(async (x, y, frame) => {
    const own = ++turn.current;
    setState({x, y, busy: true});
    try {
      const answer = await askJson(cameraPath(camera.id, `probe?x=${x}&y=${y}&frame=${frame}`));
      if (own === turn.current) setState({x, y, answer});
    } catch (error) {
      if (own === turn.current) setState({x, y, error});
    }
  }, [camera.id]);
  return [state, probe];
}

const degrees = (value) => `${figure(value, 6)}°`;

/** Rows of an answer of `probe`, without what the pixel does not have. */
function truthRows(a) {
  const rows = [["pixel, frame", `${a.x}, ${a.y}; ${a.frame}`], ["DN", a.dn]];
  const add = (name, value, text = figure(value, 6)) => { if (value !== null && value !== undefined) rows.push([name, text]); };
  add("electrons, exact", a.electrons?.exact);
  add("electrons, estimated", a.electrons?.estimated, figure(a.electrons?.estimated, 5));
  add("irradiance", a.irradiance_w_m2, `${figure(a.irradiance_w_m2, 5)} W/m²`);
  for (const band of a.bands ?? []) rows.push([`· ${band.name ?? `${figure(band.wavelength_nm)} nm`}`, `${figure(band.irradiance_w_m2, 5)} W/m²`]);
  add("body", a.body, a.body);
  add("range", a.range_m, `${figure(a.range_m, 8)} m`);
  add("latitude, longitude", a.latitude_deg, `${degrees(a.latitude_deg)}, ${degrees(a.longitude_deg)}`);
  add("incidence", a.incidence_deg, degrees(a.incidence_deg));
  add("emission", a.emission_deg, degrees(a.emission_deg));
  add("phase", a.phase_deg, degrees(a.phase_deg));
  add("samples", a.samples, count(a.samples));
  return rows;
}

export function Truth({probed}) {
  if (!probed) return html`<p class="small">Click a pixel, or press Enter, for what the scene says of it.</p>`;
  const {x, y, busy, error, answer} = probed;
  if (error) return html`<p class="note" role="note">${x}, ${y}: ${error.message}</p>`;
  if (busy) return html`<p class="small">${x}, ${y}: rendered again ...</p>`;
  return html`<h3>What the scene says of a pixel</h3><${Facts} label="Truth of the pixel" rows=${truthRows(answer)} />
    ${answer.formula && html`<p class="small">${answer.formula}</p>`}`;
}

const FORMATS = [["fits", "FITS", "as it left the detector, with its truth"], ["png", "PNG", "16 bits, digital numbers as they are"],
                 ["raw", "raw", "16 bits, little-endian, row by row"], ["jpg", "JPEG", "8 bits, with the contrast of previews, not for measurement"]];

/** Saves the frame on the screen, by its id. */
export function SaveFrame({camera, told}) {
  const command = useCommand(), picture = told.viewer?.picture;
  const name = () => `frame_${String(picture.frame).padStart(6, "0")}`;
  // Meanwhile it stays on this screen for the server, and so is kept.
  const saveAs = (suffix) => command.run(() => told.socket.during(async () => {
    const answer = await ask(cameraPath(camera.id, `frames/${picture.id}.${suffix}`));
    save(await answer.blob(), `${name()}.${suffix}`);
    return `Saved frame ${picture.frame}.`;
  }));
  const saveShown = () => command.run(async () => {
    const blob = await new Promise((done) => told.viewer.source.toBlob(done));
    save(blob, `${name()}_shown.png`);
    return `Saved frame ${picture.frame} as it is shown.`;
  });
  return html`<div class="buttons saves" role="group" aria-label="Save this frame"><span class="small">save</span>
      ${FORMATS.map(([suffix, label, title]) => html`<button key=${suffix} disabled=${!picture || command.busy} title=${title} onClick=${() => saveAs(suffix)}>${label}</button>`)}
      <button disabled=${!picture} onClick=${saveShown} title="The picture above, stretched to 8 bits">as shown</button>
    </div><${Said} of=${command} />`;
}

/** Keeps a frame to compare others with: {mode, reference, other}, and what changes it. */
export function useCompare(camera, told) {
  const [compare, setCompare] = useState({mode: "off", reference: null, other: false});
  const command = useCommand(), change = useCallback((next) => setCompare((before) => ({...before, ...next})), []);
  useEffect(() => { setCompare({mode: "off", reference: null, other: false}); }, [camera.id]);
  useEffect(() => { told.viewer?.setCompare(compare); }, [told.viewer, compare]);
  useEffect(() => {
    // Who wants less motion turns it over by hand.
    if (compare.mode !== "blink" || matchMedia("(prefers-reduced-motion: reduce)").matches) return undefined;
    const timer = setInterval(() => setCompare((before) => ({...before, other: !before.other})), BLINK_MS);
    return () => clearInterval(timer);
  }, [compare.mode]);
  const keep = () => command.run(() => told.socket.during(async () => {
    const reference = told.viewer.frozen ?? await fetchFrame(camera, told.viewer.picture.id);
    setCompare((before) => ({mode: before.mode === "off" ? "blink" : before.mode, reference, other: false}));
    return "";
  }));
  return {compare, change, keep, command};
}

const MODES = {off: "not now", blink: "by turns", difference: "difference"};

export function Compare({of, viewer}) {
  const {compare: {mode, reference, other}, change, keep, command} = of, picture = viewer?.picture;
  const fits = !reference || !picture || viewer.reference(), d = viewer?.difference;
  return html`<div class="panel"><h2>Compare</h2>
    <div class="buttons wrap"><button disabled=${!picture || command.busy} onClick=${keep}>${reference ? "take this one instead" : "keep this frame to compare with"}</button>
      ${reference && html`<button onClick=${() => change({mode: "off", reference: null, other: false})}>forget</button>`}</div>
    ${reference && html`<label class="row">with frame ${reference.frame} <select name="compare" value=${mode} onChange=${(e) => change({mode: e.target.value, other: false})}>
      ${Object.entries(MODES).map(([key, label]) => html`<option key=${key} value=${key}>${label}</option>`)}</select>
      ${mode === "blink" && html`<button aria-pressed=${String(other)} title="key c" onClick=${() => change({other: !other})}>the other</button>`}</label>`}
    ${!fits && html`<p class="note" role="note">It has another size than this one.</p>`}
    ${fits && d && html`<${Facts} label="Difference" rows=${[["differing pixels", d.differing], ["least, most", `${figure(d.least)}, ${figure(d.most)} DN`], ["mean", `${figure(d.mean, 4)} DN`]]} />
      <p class="small">This frame minus ${reference.frame}, of what is shown${picture.bin > 1 ? `, binned ${picture.bin} x ${picture.bin}` : ""}; middle grey: equal.</p>`}
    <${Said} of=${command} /></div>`;
}
