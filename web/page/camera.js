// SPDX-License-Identifier: Apache-2.0
// Screen Camera: features by their SFNC names, with range and unit; acquisition; software trigger.
import {html, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand, useRepeated} from "./api.js";
import {figure, span} from "./format.js";
import {Note, Said} from "./parts.js";
import {rangeOf} from "./live_panels.js";

const PERIOD_MS = 2000;
/** SFNC category by the beginning of the name, where the row does not tell. */
const CATEGORIES = [["Image format", /^(Width|Height|Offset|Pixel|TestPattern)/], ["Exposure and acquisition", /^(Exposure|Acquisition)/],
                    ["Trigger", /^Trigger/], ["Analog", /^(Gain|BlackLevel)/], ["Other", /./]];
const categoryOf = (row) => row.category ?? CATEGORIES.find(([, names]) => names.test(row.name))[0];

/** Words of an enumeration; null: it is none. */
const choicesOf = (row) => (row.allowed ?? "").includes(" | ") ? row.allowed.split(" | ") : null;

function Field({row, value, disabled, onValue, id}) {
  if (row.type === "true or false")
    return html`<input id=${id} type="checkbox" checked=${value} disabled=${disabled} onChange=${(e) => onValue(e.target.checked)} />`;
  const choices = choicesOf(row);
  if (choices)
    return html`<select id=${id} value=${value} disabled=${disabled} onChange=${(e) => onValue(e.target.value)}>${choices.map((c) => html`<option key=${c} value=${c}>${c}</option>`)}</select>`;
  if (typeof row.value === "number") {
    const {min, max} = rangeOf(row);
    return html`<input id=${id} type="number" min=${min} max=${max} step=${row.increment ?? (row.type === "integer" ? 1 : "any")} value=${value} disabled=${disabled}
      onInput=${(e) => onValue(e.target.value === "" ? row.value : Number(e.target.value))} />`;
  }
  return html`<input id=${id} type="text" value=${value} disabled=${disabled} onInput=${(e) => onValue(e.target.value)} />`;
}

/** Why a row cannot change; "": it can. */
function lockOf(row, state, may) {
  if (!may.operate) return "your role only looks";
  if (row.locked) return row.why || (state.acquiring ? "locked while it acquires" : "cannot change now");
  return "";
}

export function CameraScreen({camera, may}) {
  const {value, error, again} = useRepeated(() => askJson(cameraPath(camera.id, "features")), PERIOD_MS, camera.id);
  const [edits, setEdits] = useState({}), [force, setForce] = useState(false);
  const setting = useCommand(), running = useCommand(), trigger = useCommand();
  const rows = value?.features ?? [], state = camera.state;
  const groups = new Map();
  for (const row of rows) groups.set(categoryOf(row), [...(groups.get(categoryOf(row)) ?? []), row]);
  const edited = Object.entries(edits).filter(([name, v]) => rows.some((row) => row.name === name && row.value !== v));

  const set = () => setting.run(async () => {
    const answer = await askJson(cameraPath(camera.id, `features${force ? "?force=true" : ""}`), {method: "PATCH", body: Object.fromEntries(edited)});
    setEdits({});
    again();
    const changed = Object.entries(answer.changed ?? answer);
    return changed.length ? `Changed: ${changed.map(([name, v]) => `${name} = ${figure(v)}`).join(", ")}.` : "Nothing has changed.";
  });
  const acquire = (on) => running.run(async () => {
    await askJson(cameraPath(camera.id, "acquisition"), {method: "POST", body: {running: on}});
    again();
    return on ? "Started." : "Stopped.";
  });
  const fire = () => trigger.run(async () => {
    const told = await askJson(cameraPath(camera.id, "trigger"), {method: "POST", body: {}});
    if (!told.accepted) return "The camera was not ready for it: no frame.";
    return told.frame ? `Frame ${told.frame} ${told.outcome}, ${told.late_rows} late rows, ${span(1e6 * told.seconds)} until its last row had left.` : `Taken: ${told.outcome ?? "frame comes"}.`;
  });

  return html`<div class="screen">
    <section class="panel" aria-labelledby="c-run"><h2 id="c-run">Acquisition</h2>
      <p>${state.acquiring ? "It runs" : "It is stopped"}; trigger ${state.clock.source}, ${state.trigger_ready ? "ready" : "not ready"}; ${
        state.controller ? html`controlled by <strong>${state.controller}</strong>, which alone may change the camera` : "nobody controls the camera over GigE Vision"}. GigE Vision address: <code>${state.address}</code></p>
      ${may.operate ? html`<div class="buttons"><button disabled=${running.busy || state.acquiring} onClick=${() => acquire(true)}>start</button>
        <button disabled=${running.busy || !state.acquiring} onClick=${() => acquire(false)}>stop</button>
        <button disabled=${trigger.busy} onClick=${fire}>software trigger</button></div>
        <${Said} of=${running} /><${Said} of=${trigger} />` : html`<p class="note">Your role only looks: an operator's link can start, stop and trigger.</p>`}</section>
    <section class="panel" aria-labelledby="c-features"><h2 id="c-features">Features</h2>
      ${!value && html`<${Note} error=${error}>Waiting for the daemon ...<//>`}
      ${value && html`<form onSubmit=${(e) => { e.preventDefault(); if (edited.length) set(); }}>
        ${[...groups].map(([category, list]) => html`<table class="grid features" key=${category}><caption>${category}</caption>
          <thead><tr><th scope="col">feature</th><th scope="col">value</th><th scope="col">unit</th><th scope="col">allowed</th><th scope="col">meaning</th></tr></thead>
          <tbody>${list.map((row) => {
            const lock = lockOf(row, state, may), changed = edited.some(([name]) => name === row.name);
            return html`<tr key=${row.name} class=${changed ? "edited" : ""}><th scope="row"><label for=${`f-${row.name}`}>${row.name}</label></th>
              <td><${Field} row=${row} id=${`f-${row.name}`} value=${edits[row.name] ?? row.value} disabled=${lock !== ""} onValue=${(v) => setEdits({...edits, [row.name]: v})} />${
                changed && html` <span class="small">now ${figure(row.value)}</span>`}</td>
              <td>${row.unit ?? ""}</td><td>${choicesOf(row) ? "" : row.allowed ?? ""}${row.increment > 1 ? `, by ${row.increment}` : ""}</td><td>${row.help}${lock && may.operate ? html` <em>${lock}</em>` : ""}</td></tr>`;
          })}</tbody></table>`)}
        <div class="buttons sticky"><button type="submit" disabled=${setting.busy || !edited.length}>${edited.length ? `set ${edited.length} ${edited.length === 1 ? "value" : "values"}` : "set"}</button>
          <button type="button" disabled=${!edited.length} onClick=${() => setEdits({})}>forget</button>
          ${may.administer && state.controller && html`<label><input type="checkbox" checked=${force} onChange=${(e) => setForce(e.target.checked)} /> although ${state.controller} controls it (logged)</label>`}
          <${Said} of=${setting} /></div></form>`}</section>
  </div>`;
}
