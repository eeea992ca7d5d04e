// SPDX-License-Identifier: Apache-2.0
// Screen Scene: which scene is shown, others that can be, bodies where they are now, steps and poses where a simulator may send them.
import {html, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand, useRepeated} from "./api.js";
import {count, figure} from "./format.js";
import {Facts, Note, Said} from "./parts.js";
import {SceneMap, phaseOf, sunOf} from "./scene_map.js";

const SCENES_MS = 5000, TRUTH_MS = 1000;
const CLOCKS = {nominal: "frame number: frame k at (k - 1) nominal periods", clock: "time since the acquisition started", tai: "TAI of the trigger edge", replay: "recorded times, one for each frame"};

const place = (v) => Array.isArray(v) ? v.map((n) => figure(n, 7)).join(", ") : "–";
const age = (s) => s > 0 ? `, ${figure(s, 3)} s old` : "";

/** Bodies with those that hang on them below, as [row, depth]. */
function treeOf(rows) {
  const names = new Set(rows.map((row) => row.name)), out = [];
  const add = (parent, depth) => { for (const row of rows) if ((names.has(row.parent) ? row.parent : "") === parent && depth < 16) { out.push([row, depth]); add(row.name, depth + 1); } };
  add("", 0);
  return out;
}

/** Where the pose of a body comes from. `row`: of the description; `there`: of the truth. */
function sourceOf(row, there) {
  if (!row) return "–";
  if (row.source !== "simulator") return row.motion;
  return `simulator, ${count(row.poses_received)} poses, newest of ${figure(row.newest_pose_s, 6)} s${age(there?.pose_age_s)}`;
}

function Bodies({truth, tree}) {
  const rows = tree ? treeOf(tree.bodies) : (truth?.bodies ?? []).map((b) => [{name: b.name}, 0]);
  const at = new Map((truth?.bodies ?? []).map((b) => [b.name, b]));
  const numbers = [["size, px", (b) => b.radius_px ? figure(2 * b.radius_px, 4) : "–"], ["x, px", (b) => figure(b.x, 6)], ["y, px", (b) => figure(b.y, 6)], ["range, m", (b) => figure(b.range_m, 7)],
                   ["phase, deg", (b) => truth.sun_position_m ? figure(phaseOf(truth, b), 4) : "–"], ["position, m", (b) => place(b.position_m)]];
  return html`<div class="wide"><table class="grid"><thead><tr><th scope="col">body</th><th scope="col">shape</th>${numbers.map(([name]) => html`<th scope="col" class="number">${name}</th>`)}<th scope="col">pose from</th></tr></thead>
    <tbody>${rows.map(([row, depth]) => {
      const there = at.get(row.name);
      return html`<tr key=${row.name}><th scope="row">${depth > 0 && html`<span aria-hidden="true" class="branch">${" ".repeat(3 * (depth - 1))}└ </span>`}${row.name}${row.parent ? html` <span class="small">on ${row.parent}</span>` : ""}</th><td>${row.shape ?? "–"}</td>
        ${numbers.map(([, of]) => html`<td class="number">${there ? of(there) : "–"}</td>`)}<td>${sourceOf(tree && row, there)}</td></tr>`;
    })}</tbody></table></div>`;
}

function Choice({camera, may, scenes}) {
  const [chosen, setChosen] = useState(""), command = useCommand();
  const list = scenes.value.scenes, wanted = chosen || list[0] || "";
  const show = () => command.run(async () => {
    await askJson(cameraPath(camera.id, "scene"), {method: "PUT", body: {file: wanted}});
    scenes.again();
    return `${wanted} is shown.`;
  });
  if (!may.scene) return html`<p class="note">Your role does not change scenes.</p>`;
  if (!list.length) return html`<p class="note">There is no other scene: set control.scenes to a folder of scene files.</p>`;
  return html`<form class="buttons" onSubmit=${(e) => { e.preventDefault(); show(); }}><label>Show <select value=${wanted} onChange=${(e) => setChosen(e.target.value)}>${
      list.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}</select></label>
      <button type="submit" disabled=${command.busy}>${command.busy ? "building it ..." : "show"}</button></form>
    <${Said} of=${command} />
    <p class="small">It is built while frames of the present scene continue. Bands, aperture and, with TAI scene time, epoch must be the same.</p>`;
}

/** Steps of a camera in lockstep. */
function Steps({camera, points}) {
  const [time, setTime] = useState(0), [by, setBy] = useState(0.1), [done, setDone] = useState(null), command = useCommand();
  const go = (to) => command.run(async () => {
    const told = await askJson(cameraPath(camera.id, "step"), {method: "POST", body: {time_s: to}});
    setDone(to);
    setTime(to);
    return `Frame ${told.frame} of ${figure(to, 9)} s: ${told.outcome}, ${told.late_rows} late rows.`;
  });
  const next = points.find((s) => done === null || s > done);
  return html`<h3>Scene time</h3><p class="small">In lockstep the scene stands still between steps, and goes forward only.${done !== null ? ` It is at ${figure(done, 9)} s.` : ""}</p>
    <form class="buttons" onSubmit=${(e) => { e.preventDefault(); go(time); }}>
      <label>by, s <input id="step-by" type="number" min="0.000001" step="any" value=${by} onInput=${(e) => setBy(Number(e.target.value))} /></label>
      <button type="button" disabled=${command.busy || !(by > 0)} onClick=${() => go((done ?? 0) + by)}>step</button>
      <label>to, s <input id="step-to" type="number" min="0" step="any" value=${time} onInput=${(e) => setTime(Number(e.target.value))} /></label>
      <button type="submit" disabled=${command.busy}>go</button>
      ${points.length > 0 && html`<button type="button" disabled=${command.busy || next === undefined} title=${next === undefined ? "there is none after this time" : `${figure(next, 9)} s`} onClick=${() => go(next)}>next trajectory point</button>`}</form><${Said} of=${command} />`;
}

const AXES = ["x", "y", "z"], QUATERNION = ["w", "x", "y", "z"];

/** A pose that is sent as a simulator would. */
function PoseForm({camera, names}) {
  const [pose, setPose] = useState({name: names[0], time_s: 0, position_m: [0, 0, 0], orientation: [1, 0, 0, 0]}), command = useCommand();
  const send = () => command.run(async () => {
    await askJson(cameraPath(camera.id, "pose"), {method: "POST", body: pose});
    return `Taken: ${pose.name} at ${figure(pose.time_s, 9)} s.`;
  });
  const change = (key, k) => (e) => setPose({...pose, [key]: pose[key].map((n, j) => j === k ? Number(e.target.value) : n)});
  const wrong = (key) => command.bad && command.field === key ? "refused-field" : "";
  return html`<details><summary>Send a pose</summary><form onSubmit=${(e) => { e.preventDefault(); send(); }}><div class="form">
      <label>of <select value=${pose.name} onChange=${(e) => setPose({...pose, name: e.target.value})}>${names.map((n) => html`<option key=${n} value=${n}>${n}</option>`)}</select></label>
      <label class=${wrong("time_s")}>scene time, s <input type="number" min="0" step="any" value=${pose.time_s} onInput=${(e) => setPose({...pose, time_s: Number(e.target.value)})} /></label>
      ${AXES.map((axis, k) => html`<label key=${axis} class=${wrong("position_m")}>${axis}, m <input type="number" step="any" value=${pose.position_m[k]} onInput=${change("position_m", k)} aria-label=${`position ${axis}, m`} /></label>`)}
      ${QUATERNION.map((axis, k) => html`<label key=${`q${axis}`} class=${wrong("orientation")}>q${axis} <input type="number" step="any" value=${pose.orientation[k]} onInput=${change("orientation", k)} aria-label=${`orientation ${axis}`} /></label>`)}</div>
    <div class="buttons"><button type="submit" disabled=${command.busy}>send</button><${Said} of=${command} /></div></form></details>`;
}

export function Scene({camera, may, daemon}) {
  const path = (rest) => cameraPath(camera.id, rest);
  const scenes = useRepeated(() => askJson(path("scenes")), SCENES_MS, camera.id);
  const truth = useRepeated(() => askJson(path("truth")), TRUTH_MS, camera.id);
  const described = useRepeated(() => askJson(path("scene")), SCENES_MS, camera.id);
  const tree = described.value, counts = daemon.scenes, there = truth.value, lockstep = camera.state.clock.state === "lockstep";
  const sun = there?.sun_position_m && there.camera_orientation ? sunOf(there) : null;
  return html`<div class="screen">
    <div class="columns"><section class="panel" aria-labelledby="s-scene"><h2 id="s-scene">Scene</h2>
      ${scenes.value ? html`<${Facts} label="Scene" rows=${[["shown", scenes.value.shown || "that of the configuration"],
          ...(tree ? [["follows", lockstep ? "steps of a simulator" : CLOCKS[tree.scene_time] ?? tree.scene_time],
                      ["camera", `${figure(tree.camera.field_of_view_deg[0], 4)} x ${figure(tree.camera.field_of_view_deg[1], 4)} deg, f ${figure(1e3 * tree.camera.focal_length_m, 4)} mm, ${tree.camera.projection}`],
                      ["camera's pose", `${sourceOf(tree.camera, {pose_age_s: there?.camera_pose_age_s})}${tree.camera.parent ? `, on ${tree.camera.parent}` : ""}`]] : []),
          ...(sun ? [["Sun", `${figure(sun.off, 4)} deg off the boresight, ${figure(sun.distance_m / 149597870700, 4)} au`]] : []),
          ...(counts ? [["scenes shown since the start", counts.shown], ["refused", counts.refused]] : [])]} />
        <${Choice} camera=${camera} may=${may} scenes=${scenes} />` : html`<${Note} error=${scenes.error}>Waiting for the daemon ...<//>`}</section>
    <section class="panel" aria-labelledby="s-time"><h2 id="s-time">Simulator</h2>
      ${!tree ? html`<${Note} error=${described.error}>Waiting for the daemon ...<//>` : tree.simulator ? html`<${Facts} label="Simulator" bad=${["lines refused"]} rows=${[["listens at", tree.simulator.listen],
          ["connections", tree.simulator.connections], ["poses taken", tree.simulator.poses], ["steps", tree.simulator.steps], ["lines refused", tree.simulator.refused]]} />
        ${may.operate && html`${lockstep ? html`<${Steps} camera=${camera} points=${tree.trajectory_s ?? []} />` : html`<p class="small">Steps need trigger.source = "lockstep".</p>`}
          <${PoseForm} camera=${camera} names=${["camera", ...tree.bodies.map((b) => b.name), ...tree.lamps.map((l) => l.name)]} />`}`
        : html`<p class="note">No program can move this scene or step it: simulator.enabled is off. It goes on with each frame; stopping the acquisition holds it.</p>`}</section></div>
    <section class="panel" aria-labelledby="s-map"><h2 id="s-map">Map${there ? ` at frame ${there.frame}` : ""}</h2>
      ${there?.camera_orientation && there.bodies.length ? html`<${SceneMap} truth=${there} lens=${tree?.camera} />` : html`<${Note} error=${camera.state.acquiring ? truth.error : null}>${there ? "The scene has no bodies, or their poses are not told." : camera.state.acquiring ? "Waiting for a frame ..." : "The acquisition is stopped: no frame tells where things are."}<//>`}</section>
    <section class="panel" aria-labelledby="s-bodies"><h2 id="s-bodies">Bodies${there ? ` in frame ${there.frame}` : ""}</h2>
      ${there || tree ? tree?.bodies.length || there?.bodies.length ? html`<${Bodies} truth=${there} tree=${tree} />
        ${tree?.lamps.length > 0 && html`<p>Lamps: ${tree.lamps.map((l) => `${l.name} (${sourceOf(l)}${l.parent ? `, on ${l.parent}` : ""})`).join(", ")}.</p>`}` : html`<p class="note">The scene has no bodies.</p>` : html`<${Note} error=${truth.error}>Waiting for a frame ...<//>`}</section>
  </div>`;
}
