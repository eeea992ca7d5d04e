// SPDX-License-Identifier: Apache-2.0
// Screen Camera: acquisition, software trigger, what the sensor makes of the settings, user sets, features by their SFNC names.
import {html, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand, useRepeated} from "./api.js";
import {FeatureTables, merged} from "./features.js";
import {figure, span} from "./format.js";
import {Confirmed, Facts, Note, Said} from "./parts.js";

const PERIOD_MS = 2000, DEVICE_MS = 20000;

/** What begins a frame: the kind of Line0's source, or the trigger that is chosen instead. */
export function triggerOf({frame_trigger: trigger, clock}) {
  if (!trigger || (trigger.on && trigger.source === "Line0")) return clock.source;
  return trigger.on ? trigger.source : "free run";
}

/** Fires it and tells in a line what became of the frame. */
export async function fireSoftwareTrigger(camera) {
  const told = await askJson(cameraPath(camera.id, "trigger"), {method: "POST", body: {}});
  if (!told.accepted) return "The camera was not ready for it: no frame.";
  return told.frame ? `Frame ${told.frame} ${told.outcome}, ${told.late_rows} late rows, ${span(1e6 * told.seconds)} until its last row had left.` : `Taken: ${told.outcome ?? "frame comes"}.`;
}

/** Why the software trigger would be refused; "": it would not. */
function unfit(state) {
  if (!state.acquiring) return "The acquisition is stopped.";
  const trigger = state.frame_trigger;
  return trigger && triggerOf(state) !== "Software" ? "It needs TriggerMode On and TriggerSource Software (below)." : "";
}

function Acquisition({camera, may, changed}) {
  const running = useCommand(), trigger = useCommand(), state = camera.state;
  const acquire = (on) => running.run(async () => {
    await askJson(cameraPath(camera.id, "acquisition"), {method: "POST", body: {running: on}});
    changed();
    return on ? "Started." : "Stopped.";
  });
  const fire = () => trigger.run(() => fireSoftwareTrigger(camera));
  return html`<section class="panel" aria-labelledby="c-run"><h2 id="c-run">Acquisition</h2>
    <p>${state.acquiring ? "It runs" : "It is stopped"}; trigger ${triggerOf(state)}, ${state.trigger_ready ? "ready" : "not ready"}; ${
      state.controller ? html`controlled by <strong>${state.controller}</strong>, which alone may change the camera` : "no client controls the camera over GigE Vision"}.</p>
    ${may.operate ? html`<div class="buttons"><button disabled=${running.busy || state.acquiring} onClick=${() => acquire(true)}>start</button>
      <button disabled=${running.busy || !state.acquiring} onClick=${() => acquire(false)}>stop</button>
      <button disabled=${trigger.busy || unfit(state) !== ""} onClick=${fire}>software trigger</button><span class="small">${unfit(state)}</span></div>
      <${Said} of=${running} /><${Said} of=${trigger} />` : html`<p class="note">Your role only looks: an operator's link can start, stop and trigger.</p>`}</section>`;
}

/** What the sensor makes of the settings in force. */
function Readout({readout}) {
  if (!readout) return null;
  if (readout.refusal) return html`<section class="panel" aria-labelledby="c-readout"><h2 id="c-readout">What the sensor makes of it</h2><p class="said bad">${readout.refusal}</p></section>`;
  const exposure = (w) => w.exposure_min_us === w.exposure_max_us ? span(w.exposure_min_us) : `${span(w.exposure_min_us)} to ${span(w.exposure_max_us)}`;
  const clamped = (w) => Math.abs(w.exposure_min_us - w.exposure_requested_us) > 0.001 * w.exposure_requested_us;
  return html`<section class="panel" aria-labelledby="c-readout"><h2 id="c-readout">What the sensor makes of it</h2>
    <${Facts} label="Readout" rows=${[["highest frame rate", readout.max_rate_hz ? `${figure(readout.max_rate_hz, 5)} Hz` : "–"], ["shortest time between triggers", span(readout.frame_period_us)],
      ["readout, first to last row", span(readout.readout_us)], ["from row to row", span(readout.row_us)],
      ...readout.windows.map((w, k) => [`window ${k}: ${w.width} x ${w.height} at ${w.x}, ${w.y}${w.reads > 1 ? `, ${w.reads} reads` : ""}`,
        `exposed ${exposure(w)}${clamped(w) ? ` (asked ${span(w.exposure_requested_us)})` : ""}`])]} /></section>`;
}

function UserSets({rows, may, state, write}) {
  const row = (name) => rows.find((one) => one.name === name), selector = row("UserSetSelector"), byDefault = row("UserSetDefault");
  const command = useCommand(), [chosen, setChosen] = useState("");
  if (!selector) return null;
  const set = chosen || selector.value;
  const apply = (name, said) => command.run(async () => {
    if (set !== selector.value) await write("UserSetSelector", set);
    await write(name, name === "UserSetDefault" ? set : true);
    return said;
  });
  return html`<section class="panel" aria-labelledby="c-sets"><h2 id="c-sets">User sets</h2>
    <p class="small">All settings under one name. At the start of the daemon: <strong>${byDefault?.value ?? "–"}</strong>.</p>
    ${may.operate && html`<div class="buttons"><label>Set <select id="user-set" value=${set} onChange=${(e) => setChosen(e.target.value)}>${selector.entries.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}</select></label>
      <button disabled=${command.busy || state.acquiring} title=${state.acquiring ? "not while it acquires" : ""} onClick=${() => apply("UserSetLoad", `${set} is loaded.`)}>load</button>
      <${Confirmed} label="save" question=${`Overwrite ${set}?`} disabled=${command.busy || set === "Default"} onYes=${() => apply("UserSetSave", `Saved as ${set}.`)} />
      <button disabled=${command.busy || set === byDefault?.value} onClick=${() => apply("UserSetDefault", `${set} holds from the next start on.`)}>use at the start</button></div>
      <${Said} of=${command} />`}</section>`;
}

export function CameraScreen({camera, may}) {
  const path = (rest) => cameraPath(camera.id, rest), state = camera.state;
  const {value, error, again} = useRepeated(() => askJson(path("features")), PERIOD_MS, camera.id);
  const device = useRepeated(() => askJson(path("device")), DEVICE_MS, camera.id);
  const [edits, setEdits] = useState({}), [force, setForce] = useState(false);
  const setting = useCommand();
  const ofDevice = device.value?.features ?? [], rows = merged(value?.features ?? [], ofDevice);
  const edited = rows.filter((row) => edits[row.name] !== undefined && edits[row.name] !== row.value);
  const write = async (name, wanted) => {
    await askJson(path("device"), {method: "POST", body: {[name]: wanted}});
    device.again();
    again();
  };
  const set = () => setting.run(async () => {
    const named = Object.fromEntries(edited.filter((row) => !row.device).map((row) => [row.name, edits[row.name]])), said = [];
    if (Object.keys(named).length) {
      const answer = await askJson(path(`features${force ? "?force=true" : ""}`), {method: "PATCH", body: named});
      said.push(...Object.entries(answer.changed ?? answer).map(([name, v]) => `${name} = ${figure(v)}`));
      setEdits((before) => Object.fromEntries(Object.entries(before).filter(([name]) => !(name in named))));
    }
    // One after the other, as a GigE Vision client would: each is written or refused by itself.
    for (const row of edited.filter((one) => one.device)) {
      await write(row.name, edits[row.name]).catch((refusal) => { refusal.field = row.name; throw refusal; });
      said.push(`${row.name} = ${figure(edits[row.name])}`);
      setEdits(({[row.name]: _, ...rest}) => rest);
    }
    again();
    return said.length ? `Changed: ${said.join(", ")}.` : "Nothing has changed.";
  });
  const runCommand = (row) => setting.run(async () => {
    await write(row.name, true).catch((refusal) => { refusal.field = row.name; throw refusal; });
    return `${row.name} has run.`;
  });
  return html`<div class="screen">
    <${Acquisition} camera=${camera} may=${may} changed=${again} />
    <div class="columns"><${Readout} readout=${value?.readout} /><${UserSets} rows=${ofDevice} may=${may} state=${state} write=${write} /></div>
    <section class="panel" aria-labelledby="c-features"><h2 id="c-features">Features</h2>
      ${!value && html`<${Note} error=${error}>Waiting for the daemon ...<//>`}
      ${value && html`<form onSubmit=${(e) => { e.preventDefault(); if (edited.length) set(); }}>
        <${FeatureTables} rows=${rows} state=${state} may=${may} edits=${edits} onEdit=${(name, v) => setEdits((before) => ({...before, [name]: v}))} onRun=${runCommand} refused=${setting.bad ? setting : {}} />
        ${device.error && html`<p class="small">Features of the GigE Vision side: ${device.error.message}</p>`}
        <div class="buttons sticky"><button type="submit" disabled=${setting.busy || !edited.length}>${edited.length ? `set ${edited.length} ${edited.length === 1 ? "value" : "values"}` : "set"}</button>
          <button type="button" disabled=${!edited.length} onClick=${() => setEdits({})}>forget</button>
          ${may.administer && state.controller && html`<label><input type="checkbox" checked=${force} onChange=${(e) => setForce(e.target.checked)} /> although ${state.controller} controls it (logged)</label>`}
          <${Said} of=${setting} /></div></form>`}</section>
  </div>`;
}
