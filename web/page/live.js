// SPDX-License-Identifier: Apache-2.0
// Screen Live: the picture of the camera with its truth, probe, histogram, region of interest; holding, comparing and saving a frame.
import {html, useCallback, useEffect, useRef, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useRepeated} from "./api.js";
import {figure, taiText} from "./format.js";
import {fetchFrame} from "./frames.js";
import {LiveSocket} from "./live_socket.js";
import {Levels, Probe, Profile, Region, electronsOf} from "./live_panels.js";
import {Age, Compare, Layers, Overlays, SaveFrame, Truth, useCompare, useProbe, useRemembered} from "./live_tools.js";
import {overlayLayers} from "./overlays.js";
import {Facts, Note} from "./parts.js";
import {Viewer} from "./viewer.js";

const ZOOM_STEP = 1.25, CLICK_PX = 3, TRUTH_MS = 500, FEATURES_MS = 2000, CONFIGURATION_MS = 60000;

/** Viewer and socket of one camera, on the elements of `stage`. Renders again whenever what they hold changes. */
function useViewer(camera) {
  const [, setTurn] = useState(0);
  const stage = useRef(null), canvas = useRef(null), live = useRef({histogram: null, note: "Waiting for the first picture ..."});
  useEffect(() => {
    const told = live.current = {histogram: null, note: "Waiting for the first picture ..."};
    const changed = () => setTurn((turn) => turn + 1);
    const viewer = told.viewer = new Viewer(canvas.current, {changed, wants: (view) => socket.setView({camera: camera.id, ...view})});
    const socket = told.socket = new LiveSocket({camera: camera.id, ...viewer.view()}, {
      picture: async (picture) => {
        told.note = "";
        if (picture.jpeg) picture.bitmap = await createImageBitmap(new Blob([picture.jpeg], {type: "image/jpeg"})).catch(() => null);
        if (picture.pixels || picture.bitmap) viewer.show(picture);
        requestAnimationFrame(() => socket.ready());
      },
      histogram: (figures) => { told.histogram = figures; changed(); },
      note: (line) => { told.note = line; changed(); },
    });
    const fitCanvas = () => {
      const {clientWidth, clientHeight} = stage.current, ratio = devicePixelRatio || 1; // without the border
      viewer.resize(Math.max(1, Math.round(clientWidth * ratio)), Math.max(1, Math.round(clientHeight * ratio)));
    };
    const observer = new ResizeObserver(fitCanvas);
    observer.observe(stage.current);
    fitCanvas();
    return () => { observer.disconnect(); socket.close(); };
  }, [camera.id]);
  return {stage, canvas, told: live.current};
}

function BodyTable({truth}) {
  if (!truth) return null;
  return html`<details class="panel"><summary>Bodies in frame ${truth.frame}</summary>
    <table class="grid"><thead><tr><th scope="col">body</th><th scope="col" class="number">x</th><th scope="col" class="number">y</th>
      <th scope="col" class="number">radius, px</th><th scope="col" class="number">range, m</th></tr></thead>
    <tbody>${truth.bodies.map((b) => html`<tr key=${b.name}><th scope="row">${b.name}</th><td class="number">${figure(b.x, 7)}</td>
      <td class="number">${figure(b.y, 7)}</td><td class="number">${figure(b.radius_px, 5)}</td><td class="number">${figure(b.range_m, 7)}</td></tr>`)}</tbody></table></details>`;
}

/** Holds the frame on the screen, all of it: [held, setHeld, why not all]. */
function useHold(camera, told) {
  const [held, setHeld] = useState(false), [why, setWhy] = useState("");
  const {viewer, socket} = told;
  useEffect(() => {
    if (!viewer) return undefined;
    let on = true;
    viewer.hold(held);
    socket.hold(held);
    setWhy("");
    if (held && viewer.picture)
      fetchFrame(camera, viewer.picture.id).then((frame) => { if (on) viewer.freeze(frame); }, (error) => { if (on) setWhy(`Only what is shown is held: ${error.message}`); });
    return () => { on = false; };
  }, [viewer, held]);
  return [held, setHeld, why];
}

/** Which of two frames is on the screen. */
function badgeOf({mode, reference, other}, picture) {
  if (mode === "off") return null;
  return html`<span class="badge">${mode === "difference" ? `${picture.frame} − ${reference.frame}` : `frame ${other ? reference.frame : picture.frame}`}</span>`;
}

export function Live({camera, fresh, may}) {
  const {stage, canvas, told} = useViewer(camera);
  const {viewer, socket} = told, picture = viewer?.picture;
  const [stretch, setStretch] = useState({kind: "auto", black: 0, white: 4095});
  const [held, setHeld, notHeld] = useHold(camera, told);
  const [overlay, setOverlay] = useState(true), [reduce, setReduce] = useState("max");
  const [layers, setLayers] = useRemembered("layers", Object.fromEntries(overlayLayers.map(({key, on}) => [key, on])));
  const comparing = useCompare(camera, told), [pixel, probe] = useProbe(camera);
  const [cursor, setCursor] = useState(null), [drawing, setDrawing] = useState(false), [region, setRegion] = useState(null);
  const features = useRepeated(() => askJson(cameraPath(camera.id, "features")), FEATURES_MS, camera.id);
  const configuration = useRepeated(() => askJson(cameraPath(camera.id, "configuration")), CONFIGURATION_MS, camera.id);
  const truth = useRepeated(() => askJson(cameraPath(camera.id, "truth")), TRUTH_MS, overlay && !held ? camera.id : undefined);
  const kept = useRef(null), [, heldTruth] = useState(null);
  // That of the frame that is held, which the newest one need not be.
  useEffect(() => {
    if (!held || !overlay || !picture || String(kept.current?.frame) === String(picture.frame)) return undefined;
    let on = true;
    askJson(cameraPath(camera.id, `truth?frame=${picture.frame}`)).then((answer) => { if (on) heldTruth(kept.current = answer); }, () => {}); // the badge then says of which frame they are
    return () => { on = false; };
  }, [held, overlay]);
  if (truth.value || !held) kept.current = overlay ? truth.value : null;
  const ratio = devicePixelRatio || 1;

  useEffect(() => { viewer?.setStretch(stretch); }, [viewer, stretch]);
  useEffect(() => { viewer?.setReduce(reduce); }, [viewer, reduce]);
  const numbers = !!cursor || stretch.kind !== "auto" || comparing.compare.mode !== "off";
  useEffect(() => { viewer?.setNumbers(numbers); }, [viewer, numbers]);

  const at = (event) => {
    const box = canvas.current.getBoundingClientRect();
    return viewer.toImage((event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio);
  };
  const drag = useRef(null);
  const onDown = (event) => {
    if (!picture || event.button !== 0) return;
    canvas.current.setPointerCapture(event.pointerId);
    drag.current = {from: at(event), x: event.clientX, y: event.clientY, x0: event.clientX, y0: event.clientY};
  };
  const onMove = (event) => {
    if (!picture) return;
    const here = at(event), start = drag.current;
    const x = Math.floor(here.x), y = Math.floor(here.y), {width, height} = viewer.image;
    setCursor(x >= 0 && y >= 0 && x < width && y < height ? {x, y} : null);
    if (!start) return;
    if (drawing) {
      setRegion({x: Math.min(start.from.x, here.x), y: Math.min(start.from.y, here.y),
                 width: Math.abs(here.x - start.from.x), height: Math.abs(here.y - start.from.y)});
    } else {
      viewer.pan((event.clientX - start.x) * ratio, (event.clientY - start.y) * ratio);
      drag.current = {...start, x: event.clientX, y: event.clientY};
    }
  };
  const onUp = (event) => {
    const start = drag.current;
    drag.current = null;
    if (start && drawing && region) setDrawing(false);
    else if (start && !drawing && Math.hypot(event.clientX - start.x0, event.clientY - start.y0) < CLICK_PX) ask(Math.floor(start.from.x), Math.floor(start.from.y));
  };
  /** What the scene says of that pixel of the frame that is shown. */
  const ask = (x, y) => {
    const {width, height} = viewer.image;
    if (x >= 0 && y >= 0 && x < width && y < height) probe(x, y, viewer.picture.frame);
  };
  // A wheel listener that keeps the page from scrolling is not passive, which attributes cannot say.
  useEffect(() => {
    const element = canvas.current;
    const onWheel = (event) => {
      if (!viewer?.picture) return;
      event.preventDefault();
      const here = at(event);
      viewer.zoom(viewer.scale * ZOOM_STEP ** -Math.sign(event.deltaY), here.x, here.y);
    };
    element.addEventListener("wheel", onWheel, {passive: false});
    return () => element.removeEventListener("wheel", onWheel);
  }, [viewer]);
  const move = useCallback((dx, dy) => setCursor((now) => {
    const {width, height} = viewer.image;
    const from = now ?? {x: Math.floor(width / 2), y: Math.floor(height / 2)};
    return {x: Math.min(width - 1, Math.max(0, from.x + dx)), y: Math.min(height - 1, Math.max(0, from.y + dy))};
  }), [viewer]);
  const onKey = (event) => {
    if (!picture || event.ctrlKey || event.altKey || event.metaKey) return;
    const step = event.shiftKey ? 10 : 1;
    const actions = {
      ArrowLeft: () => move(-step, 0), ArrowRight: () => move(step, 0), ArrowUp: () => move(0, -step), ArrowDown: () => move(0, step),
      "+": () => viewer.zoom(viewer.scale * ZOOM_STEP), "-": () => viewer.zoom(viewer.scale / ZOOM_STEP),
      f: () => viewer.fit(), o: () => viewer.zoom(1), " ": () => setHeld(!held), r: () => setDrawing(!drawing), b: () => setOverlay(!overlay),
      c: () => comparing.change({other: !comparing.compare.other}), Enter: () => { if (cursor) ask(cursor.x, cursor.y); },
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  };

  const probed = picture && cursor ? viewer.probe(cursor.x, cursor.y) : null;
  const values = Object.fromEntries((features.value?.features ?? []).map((row) => [row.name, row]));
  const electrons = electronsOf(probed?.dn, values, configuration.value?.entries, camera.number);
  const box = region && viewer && {...viewer.toScreen(region.x, region.y), width: region.width * viewer.scale, height: region.height * viewer.scale};
  const late = held && overlay && picture && kept.current && String(kept.current.frame) !== String(picture.frame);
  return html`<div class="live">
    <div class="stage-side">
      <div class="toolbar" role="toolbar" aria-label="Picture">
        <button onClick=${() => viewer?.fit()} aria-pressed=${String(!!viewer?.fitted)}>fit</button>
        <button onClick=${() => viewer?.zoom(1)} aria-pressed=${String(!viewer?.fitted && viewer?.scale === 1)}>1:1</button>
        <button onClick=${() => viewer?.zoom(viewer.scale / ZOOM_STEP)} aria-label="zoom out">−</button>
        <button onClick=${() => viewer?.zoom(viewer.scale * ZOOM_STEP)} aria-label="zoom in">+</button>
        <span class="scale">${picture ? `${figure(100 * viewer.scale, 3)} %` : ""}</span>
        <button aria-pressed=${String(held)} disabled=${!picture} onClick=${() => setHeld(!held)} title="space">hold</button>
        <button aria-pressed=${String(drawing)} disabled=${!picture} onClick=${() => setDrawing(!drawing)}>draw region</button>
        <label>binned <select value=${reduce} onChange=${(e) => setReduce(e.target.value)}><option value="max">by maximum</option><option value="mean">by mean</option></select></label>
      </div>
      <${Layers} layers=${layers} setLayers=${setLayers} all=${overlay} setAll=${setOverlay} error=${truth.error} />
      <div class=${`stage${drawing ? " drawing" : ""}`} ref=${stage}>
        <canvas ref=${canvas} tabindex="0" role="img" onPointerDown=${onDown} onPointerMove=${onMove} onPointerUp=${onUp} onKeyDown=${onKey}
          aria-label="Picture of the camera. Arrow keys move the probe, plus and minus zoom, f fits, o is one to one, Enter asks for the truth of the pixel, space holds, b shows overlays, c turns a comparison over, r draws a region."></canvas>
        ${picture && overlay && kept.current && html`<${Overlays} viewer=${viewer} truth=${kept.current} layers=${layers} ratio=${ratio} theme=${document.documentElement.dataset.theme} />`}
        ${(box || probed || (picture && pixel)) && html`<svg class="overlay" aria-hidden="true">
          ${box && html`<rect class="region" x=${box.x / ratio} y=${box.y / ratio} width=${box.width / ratio} height=${box.height / ratio} />`}
          ${probed && (() => {
            const p = viewer.toScreen(probed.x, probed.y), size = Math.max(5, probed.bin * viewer.scale) / ratio;
            return html`<rect class="probe" x=${p.x / ratio} y=${p.y / ratio} width=${size} height=${size} />`;
          })()}
          ${picture && pixel && (() => {
            const p = viewer.toScreen(pixel.x + 0.5, pixel.y + 0.5), x = p.x / ratio, y = p.y / ratio;
            return html`<path class="asked" d=${`M${x - 12} ${y}h8M${x + 4} ${y}h8M${x} ${y - 12}v8M${x} ${y + 4}v8`} />`;
          })()}</svg>`}
        ${told.note && html`<p class="stage-note" role="status">${!picture && !camera.state.acquiring ? "The acquisition is stopped: no frames." : told.note}</p>`}
        <p class="stage-badges">${held && html`<span class="badge">held: frame ${String(picture?.frame ?? "")}</span>`}
          ${comparing.compare.reference && picture && badgeOf(comparing.compare, picture)}
          ${late && html`<span class="badge plain">overlays: frame ${String(kept.current.frame)}</span>`}</p>
      </div>
      ${notHeld && html`<${Note}>${notHeld}<//>`}
      ${picture?.rateLowered && html`<${Note}>Fewer pictures than asked for: the server's share for all viewers is used up.<//>`}
      ${picture?.bitmap && html`<${Note}>A JPEG, without digital numbers: the server's share for all viewers is used up. Point at the picture, zoom to 1:1 or hold it for numbers.<//>`}
      ${picture?.viewLowered && html`<${Note}>Coarser than asked for: the server's share for all viewers is used up.<//>`}
    </div>
    <div class="side">
      <div class="panel"><h2>Frame</h2>${picture ? html`<${Facts} label="Frame" rows=${[
        ["frame", String(picture.frame)], ["age", html`<${Age} picture=${picture} />`], ["trigger", String(picture.trigger)], ["edge", taiText(picture.edgeTaiNs, camera.state.tai)],
        ["image", `${picture.imageWidth} x ${picture.imageHeight}, ${picture.bits} bit`],
        ["rows so far", `${picture.rows} of ${picture.imageHeight}`],
        ["shown as", picture.bin > 1 ? `${picture.reduce === "max" ? "largest" : "mean"} of ${picture.bin} x ${picture.bin}` : "single pixels"],
        ["skipped here", picture.skipped]]} />` : html`<p class="note">None yet.</p>`}<${SaveFrame} camera=${camera} told=${told} /></div>
      <${Probe} cursor=${cursor} probed=${probed} electrons=${electrons} reference=${comparing.compare.reference}><${Truth} probed=${pixel} /><//>
      <${Profile} viewer=${viewer} cursor=${probed ? cursor : null} />
      <${Levels} stretch=${stretch} setStretch=${setStretch} viewer=${viewer} histogram=${told.histogram} />
      <${Compare} of=${comparing} viewer=${viewer} />
      <${Region} camera=${camera} fresh=${fresh} values=${values} error=${features.error} may=${may} region=${region} setRegion=${setRegion} image=${viewer?.image} changed=${features.again} />
      <${BodyTable} truth=${overlay ? kept.current : null} />
    </div>
  </div>`;
}
