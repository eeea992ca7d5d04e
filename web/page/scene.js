// SPDX-License-Identifier: Apache-2.0
// Screen Scene: which scene is shown, others that can be, bodies where they are now.
import {html, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand, useRepeated} from "./api.js";
import {figure} from "./format.js";
import {Facts, Note, Said} from "./parts.js";

const SCENES_MS = 5000, TRUTH_MS = 1000;

const place = (v) => Array.isArray(v) ? v.map((n) => figure(n, 7)).join(", ") : null;

function Bodies({truth}) {
  const known = [["x, px", (b) => figure(b.x, 7)], ["y, px", (b) => figure(b.y, 7)], ["radius, px", (b) => figure(b.radius_px, 5)],
                 ["range, m", (b) => figure(b.range_m, 7)], ["phase, deg", (b) => b.phase_deg === undefined ? null : figure(b.phase_deg, 5)],
                 ["position, m", (b) => place(b.position_m)]].filter(([, of]) => truth.bodies.some((b) => of(b) !== null && of(b) !== "–"));
  return html`<table class="grid"><thead><tr><th scope="col">body</th>${known.map(([name]) => html`<th scope="col" class="number">${name}</th>`)}</tr></thead>
    <tbody>${truth.bodies.map((b) => html`<tr key=${b.name}><th scope="row">${b.name}</th>${known.map(([, of]) => html`<td class="number">${of(b) ?? "–"}</td>`)}</tr>`)}</tbody></table>`;
}

export function Scene({camera, may, daemon}) {
  const scenes = useRepeated(() => askJson(cameraPath(camera.id, "scenes")), SCENES_MS, camera.id);
  const truth = useRepeated(() => askJson(cameraPath(camera.id, "truth")), TRUTH_MS, camera.id);
  const [chosen, setChosen] = useState("");
  const command = useCommand();
  const list = scenes.value?.scenes ?? [], wanted = chosen || list[0] || "";
  const show = () => command.run(async () => {
    await askJson(cameraPath(camera.id, "scene"), {method: "PUT", body: {file: wanted}});
    scenes.again();
    return `${wanted} is shown.`;
  });
  const counts = daemon.scenes;
  return html`<div class="screen">
    <section class="panel" aria-labelledby="s-scene"><h2 id="s-scene">Scene</h2>
      ${scenes.value ? html`<${Facts} label="Scene" rows=${[["shown", scenes.value.shown || "that of the configuration"],
          ...(counts ? [["scenes shown since the start", counts.shown], ["refused", counts.refused]] : [])]} />
        ${!may.scene ? html`<p class="note">Your role does not change scenes.</p>` : !list.length ? html`<p class="note">There is no other scene: set control.scenes to a folder of scene files.</p>` : html`
        <form class="buttons" onSubmit=${(e) => { e.preventDefault(); show(); }}><label>Show <select value=${wanted} onChange=${(e) => setChosen(e.target.value)}>${
          list.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}</select></label>
          <button type="submit" disabled=${command.busy}>${command.busy ? "building it ..." : "show"}</button></form>`}
        <${Said} of=${command} />
        <p class="small">It is built while frames of the present scene continue. Bands, aperture and, with TAI scene time, epoch must be the same.</p>`
        : html`<${Note} error=${scenes.error}>Waiting for the daemon ...<//>`}</section>
    <section class="panel" aria-labelledby="s-bodies"><h2 id="s-bodies">Bodies${truth.value ? ` in frame ${truth.value.frame}` : ""}</h2>
      ${truth.value ? truth.value.bodies.length ? html`<${Bodies} truth=${truth.value} />` : html`<p class="note">The scene has no bodies.</p>` : html`<${Note} error=${truth.error}>Waiting for a frame ...<//>`}</section>
  </div>`;
}
