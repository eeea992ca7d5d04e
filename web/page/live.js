// SPDX-License-Identifier: Apache-2.0
// Screen Live: the picture of the camera, probe, histogram, bodies, region of interest, saving a frame.
import {html, useCallback, useEffect, useRef, useState} from "./vendor/preact-htm.js";
import {ask, askJson, cameraPath, save, useCommand, useRepeated} from "./api.js";
import {figure, taiText} from "./format.js";
import {LiveSocket} from "./live_socket.js";
import {Levels, Probe, Profile, Region, electronsOf} from "./live_panels.js";
import {Facts, Note, Said} from "./parts.js";
import {Viewer} from "./viewer.js";

const ZOOM_STEP = 1.25, TRUTH_MS = 500, FEATURES_MS = 2000, CONFIGURATION_MS = 60000;

/** Viewer and socket of one camera, on the elements of `stage`. Renders again whenever what they hold changes. */
function useViewer(camera) {
  const [, setTurn] = useState(0);
  const stage = useRef(null), canvas = useRef(null), live = useRef({histogram: null, note: "Waiting for the first picture ..."});
  useEffect(() => {
    const told = live.current = {histogram: null, note: "Waiting for the first picture ..."};
    const changed = () => setTurn((turn) => turn + 1);
    const viewer = told.viewer = new Viewer(canvas.current, {changed, wants: (view) => socket.setView({camera: camera.id, ...view})});
    const socket = told.socket = new LiveSocket({camera: camera.id, ...viewer.view()}, {
      picture: (picture) => {
        told.note = "";
        viewer.show(picture);
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

/** Centres and limbs of the bodies, over the picture. */
function Bodies({viewer, truth, ratio}) {
  if (!viewer?.picture || !truth) return null;
  return html`<svg class="overlay" aria-hidden="true">${truth.bodies.filter((body) => body.x !== null && body.x !== undefined).map((body) => {
    const at = viewer.toScreen(body.x + 0.5, body.y + 0.5), x = at.x / ratio, y = at.y / ratio;
    const radius = Math.max(3, body.radius_px * viewer.scale / ratio);
    return html`<g key=${body.name}><circle cx=${x} cy=${y} r=${radius} /><path d=${`M${x - 6} ${y}h12M${x} ${y - 6}v12`} />
      <text x=${x + Math.min(radius, 200) * 0.72 + 4} y=${y - Math.min(radius, 200) * 0.72 - 4}>${body.name}</text></g>`;
  })}${(truth.stars ?? []).map((star, k) => {
    const at = viewer.toScreen(star.x + 0.5, star.y + 0.5), x = at.x / ratio, y = at.y / ratio;
    return html`<g key=${k} class="star"><circle cx=${x} cy=${y} r="7" /><text x=${x + 9} y=${y + 4}>${star.name ?? ""}</text></g>`;
  })}</svg>`;
}

function BodyTable({truth}) {
  if (!truth) return null;
  return html`<details class="panel"><summary>Bodies in frame ${truth.frame}</summary>
    <table class="grid"><thead><tr><th scope="col">body</th><th scope="col" class="number">x</th><th scope="col" class="number">y</th>
      <th scope="col" class="number">radius, px</th><th scope="col" class="number">range, m</th></tr></thead>
    <tbody>${truth.bodies.map((b) => html`<tr key=${b.name}><th scope="row">${b.name}</th><td class="number">${figure(b.x, 7)}</td>
      <td class="number">${figure(b.y, 7)}</td><td class="number">${figure(b.radius_px, 5)}</td><td class="number">${figure(b.range_m, 7)}</td></tr>`)}</tbody></table></details>`;
}

function SaveFrame({camera, told}) {
  const command = useCommand();
  const saveAs = (suffix) => command.run(async () => {
    const answer = await ask(cameraPath(camera.id, `frames/latest.${suffix}`));
    const frame = answer.headers.get("X-Obscura-Frame") ?? "latest";
    save(await answer.blob(), `frame_${frame}.${suffix}`);
    return `Saved frame ${frame}.`;
  });
  const saveShown = () => command.run(async () => {
    const blob = await new Promise((done) => told.viewer.source.toBlob(done));
    save(blob, `shown_${told.viewer.picture.frame}.png`);
    return `Saved frame ${told.viewer.picture.frame} as it is shown.`;
  });
  return html`<div class="panel"><h2>Save</h2><div class="buttons">
      <button onClick=${() => saveAs("fits")} title="The newest frame as it left the detector, with its truth">newest, FITS</button>
      <button onClick=${() => saveAs("png")} title="The newest frame, 16 bits">newest, PNG</button>
      <button disabled=${!told.viewer?.picture} onClick=${saveShown} title="The picture above, stretched to 8 bits">this, as shown</button>
    </div><${Said} of=${command} /></div>`;
}

export function Live({camera, may}) {
  const {stage, canvas, told} = useViewer(camera);
  const {viewer, socket} = told, picture = viewer?.picture;
  const [stretch, setStretch] = useState({kind: "auto", black: 0, white: 4095});
  const [held, setHeld] = useState(false), [overlay, setOverlay] = useState(true), [reduce, setReduce] = useState("max");
  const [cursor, setCursor] = useState(null), [drawing, setDrawing] = useState(false), [region, setRegion] = useState(null);
  const features = useRepeated(() => askJson(cameraPath(camera.id, "features")), FEATURES_MS, camera.id);
  const configuration = useRepeated(() => askJson(cameraPath(camera.id, "configuration")), CONFIGURATION_MS, camera.id);
  const truth = useRepeated(() => askJson(cameraPath(camera.id, "truth")), TRUTH_MS, overlay && !held ? camera.id : undefined);
  const kept = useRef(null);
  if (truth.value || !held) kept.current = overlay ? truth.value : null;
  const ratio = devicePixelRatio || 1;

  useEffect(() => { viewer?.setStretch(stretch); }, [viewer, stretch]);
  useEffect(() => { viewer?.setReduce(reduce); }, [viewer, reduce]);
  useEffect(() => { socket?.hold(held); }, [socket, held]);

  const at = (event) => {
    const box = canvas.current.getBoundingClientRect();
    return viewer.toImage((event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio);
  };
  const drag = useRef(null);
  const onDown = (event) => {
    if (!picture || event.button !== 0) return;
    canvas.current.setPointerCapture(event.pointerId);
    drag.current = {from: at(event), x: event.clientX, y: event.clientY};
  };
  const onMove = (event) => {
    if (!picture) return;
    const here = at(event), start = drag.current;
    setCursor({x: Math.floor(here.x), y: Math.floor(here.y)});
    if (!start) return;
    if (drawing) {
      setRegion({x: Math.min(start.from.x, here.x), y: Math.min(start.from.y, here.y),
                 width: Math.abs(here.x - start.from.x), height: Math.abs(here.y - start.from.y)});
    } else {
      viewer.pan((event.clientX - start.x) * ratio, (event.clientY - start.y) * ratio);
      drag.current = {...start, x: event.clientX, y: event.clientY};
    }
  };
  const onUp = () => {
    if (drag.current && drawing && region) setDrawing(false);
    drag.current = null;
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
  return html`<div class="live">
    <div class="stage-side">
      <div class="toolbar" role="toolbar" aria-label="Picture">
        <button onClick=${() => viewer?.fit()} aria-pressed=${String(!!viewer?.fitted)}>fit</button>
        <button onClick=${() => viewer?.zoom(1)} aria-pressed=${String(!viewer?.fitted && viewer?.scale === 1)}>1:1</button>
        <button onClick=${() => viewer?.zoom(viewer.scale / ZOOM_STEP)} aria-label="zoom out">−</button>
        <button onClick=${() => viewer?.zoom(viewer.scale * ZOOM_STEP)} aria-label="zoom in">+</button>
        <span class="scale">${picture ? `${figure(100 * viewer.scale, 3)} %` : ""}</span>
        <button aria-pressed=${String(held)} onClick=${() => setHeld(!held)}>hold</button>
        <button aria-pressed=${String(overlay && !truth.error)} disabled=${!!truth.error} title=${truth.error?.message ?? "centres and limbs of the bodies"} onClick=${() => setOverlay(!overlay)}>bodies</button>
        <button aria-pressed=${String(drawing)} disabled=${!picture} onClick=${() => setDrawing(!drawing)}>draw region</button>
        <label>binned <select value=${reduce} onChange=${(e) => setReduce(e.target.value)}><option value="max">by maximum</option><option value="mean">by mean</option></select></label>
      </div>
      <div class=${`stage${drawing ? " drawing" : ""}`} ref=${stage}>
        <canvas ref=${canvas} tabindex="0" role="img" onPointerDown=${onDown} onPointerMove=${onMove} onPointerUp=${onUp} onKeyDown=${onKey}
          aria-label="Picture of the camera. Arrow keys move the probe, plus and minus zoom, f fits, o is one to one, space holds, b shows bodies, r draws a region."></canvas>
        ${overlay && html`<${Bodies} viewer=${viewer} truth=${kept.current} ratio=${ratio} />`}
        ${(box || probed) && html`<svg class="overlay" aria-hidden="true">
          ${box && html`<rect class="region" x=${box.x / ratio} y=${box.y / ratio} width=${box.width / ratio} height=${box.height / ratio} />`}
          ${probed && (() => {
            const p = viewer.toScreen(probed.x, probed.y), size = Math.max(5, probed.bin * viewer.scale) / ratio;
            return html`<rect class="probe" x=${p.x / ratio} y=${p.y / ratio} width=${size} height=${size} />`;
          })()}</svg>`}
        ${told.note && html`<p class="stage-note" role="status">${!picture && !camera.state.acquiring ? "The acquisition is stopped: no frames." : told.note}</p>`}
        ${held && html`<p class="stage-badge">held: frame ${String(picture?.frame ?? "")}</p>`}
      </div>
      ${picture?.rateLowered && html`<${Note}>Fewer pictures than asked for: the server's share for all viewers is used up.<//>`}
      ${picture?.viewLowered && html`<${Note}>Coarser than asked for: the server's share for all viewers is used up.<//>`}
    </div>
    <div class="side">
      <div class="panel"><h2>Frame</h2>${picture ? html`<${Facts} label="Frame" rows=${[
        ["frame", String(picture.frame)], ["trigger", String(picture.trigger)], ["edge", taiText(picture.edgeTaiNs)],
        ["image", `${picture.imageWidth} x ${picture.imageHeight}, ${picture.bits} bit`],
        ["rows so far", `${picture.rows} of ${picture.imageHeight}`],
        ["shown as", picture.bin > 1 ? `${picture.reduce === "max" ? "largest" : "mean"} of ${picture.bin} x ${picture.bin}` : "single pixels"],
        ["skipped here", picture.skipped]]} />` : html`<p class="note">None yet.</p>`}</div>
      <${Probe} cursor=${cursor} probed=${probed} electrons=${electrons} />
      <${Profile} viewer=${viewer} cursor=${probed ? cursor : null} />
      <${SaveFrame} camera=${camera} told=${told} />
      <${Levels} stretch=${stretch} setStretch=${setStretch} viewer=${viewer} histogram=${told.histogram} />
      <${Region} camera=${camera} values=${values} error=${features.error} may=${may} region=${region} setRegion=${setRegion} image=${viewer?.image} changed=${features.again} />
      <${BodyTable} truth=${overlay ? kept.current : null} />
    </div>
  </div>`;
}
