// SPDX-License-Identifier: Apache-2.0
// Screen Models: texts in SuMoL that scenes use, checked as one types, with parameters and a picture; tried on the next frame.
import {html, useEffect, useRef, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand, useRepeated} from "./api.js";
import {makeEditor} from "./editor.js";
import {figure} from "./format.js";
import {Confirmed, Facts, Note, Said} from "./parts.js";

const LIST_MS = 10000, CHECK_AFTER_MS = 300;
const PLACES = {scene: "beside the scene", folder: "of this appliance", shipped: "shipped"};

/** What is being written outlives the screen, by camera: {file, place, text, before}. */
const drafts = new Map();

const keyOf = (model) => `${model.place}/${model.name}`;

/** Name under which a text can be stored: those beside the scene stay as they are. */
const storedName = (file, place) => place === "scene" ? `my-${file}` : file;

function Choice({list, chosen, open}) {
  const rows = list.models.filter((model) => !model.hidden || keyOf(model) === chosen);
  return html`<label>Model <select id="m-which" value=${chosen} onChange=${(e) => open(rows.find((model) => keyOf(model) === e.target.value))}>
    ${!chosen && html`<option value="">choose ...</option>`}
    ${Object.entries(PLACES).map(([place, words]) => html`<optgroup key=${place} label=${words}>${rows.filter((model) => model.place === place).map((model) => html`
      <option key=${keyOf(model)} value=${keyOf(model)}>${model.name}${model.used ? " (used)" : ""}</option>`)}</optgroup>`)}</select></label>`;
}

function Findings({check, goTo}) {
  const found = check.told?.findings ?? [], more = check.why ?? (check.told?.sound ? check.told.summary : "");
  return html`<div id="m-findings" role="status" aria-label="Findings"><p class="small">${check.busy ? "checking ..." : found.length ? `${found.length} finding${found.length > 1 ? "s" : ""}` : more ? "" : "nothing to check"}${!found.length && more ? `${check.told?.sound ? "sound: " : ""}${more}` : ""}</p>
    ${found.length > 0 && html`<ul class="findings">${found.map((f, k) => html`<li key=${k}><button type="button" class=${`mini ${f.severity}`} onClick=${() => goTo(f)}>${`line ${f.line}, ${f.column}`}</button> ${f.severity === "warning" ? "warning: " : ""}${f.what}</li>`)}</ul>`}</div>`;
}

const range = (p) => p.min === null && p.max === null ? "any" : `${p.min ?? ""} to ${p.max ?? ""}`;

function Parameters({told}) {
  const rows = told?.parameters ?? [];
  if (!rows.length) return html`<p class="note">${told ? "It has no parameters." : "Its parameters stand here once it can be read."}</p>`;
  return html`<div class="wide"><table class="grid" aria-label="Parameters"><thead><tr>${["key", "type", "default", "allowed", "unit", "meaning"].map((name) => html`<th key=${name} scope="col">${name}</th>`)}</tr></thead>
    <tbody>${rows.map((p) => html`<tr key=${p.name}><th scope="row"><code>${p.key}</code></th><td>${p.type}</td><td>${p.type === "texture" ? "image" : [...new Set(p.default)].map((n) => figure(n, 6)).join(", ")}</td>
      <td>${p.type === "texture" ? "" : range(p)}</td><td>${p.unit}</td><td>${p.help}</td></tr>`)}</tbody></table></div>`;
}

/** Picture of the last sound text, drawn on a canvas: the page shows no images of other origins, data and blobs among them. */
function Picture({camera, text, file, sound, forms}) {
  const canvas = useRef(null), [state, setState] = useState({});
  const able = sound && forms.includes(".png");
  useEffect(() => {
    if (!able) return undefined;
    let on = true;
    askJson(cameraPath(camera, "models/plot"), {method: "POST", body: {file, text, form: "png"}}).then(async ({bytes}) => {
      const picture = await createImageBitmap(new Blob([Uint8Array.from(atob(bytes.replace(/\s/g, "")), (c) => c.charCodeAt(0))], {type: "image/png"}));
      if (!on || !canvas.current) return;
      Object.assign(canvas.current, {width: picture.width, height: picture.height});
      canvas.current.getContext("2d").drawImage(picture, 0, 0);
      setState({of: text});
    }).catch((error) => on && setState({why: error.message}));
    return () => { on = false; };
  }, [able, text, file]);
  const told = !able ? (sound ? "There are no pictures of this kind." : "A sound text has a picture.") : state.why;
  return html`<canvas id="m-picture" ref=${canvas} class="picture" role="img" aria-label=${`What ${file} looks like with its default parameters`} hidden=${!state.of}></canvas>
    ${(told || !state.of) && html`<p class="note" role="note">${told || "drawing ..."}</p>`}`;
}

/** Checks `text` some time after it has changed: {told, why, busy}. */
function useCheck(camera, file, text) {
  const [state, setState] = useState({});
  useEffect(() => {
    if (!file) return undefined;
    let on = true;
    setState((before) => ({...before, busy: true}));
    const wait = setTimeout(() => askJson(cameraPath(camera, "models/check"), {method: "POST", body: {file, text}}).then(
      (told) => on && setState({told, of: text}), (error) => on && setState({why: error.message})), CHECK_AFTER_MS);
    return () => { on = false; clearTimeout(wait); };
  }, [camera, file, text]);
  return state;
}

function Text({words, draft, type, findings, editor}) {
  const host = useRef(null);
  useEffect(() => {
    editor.current = makeEditor(host.current, {text: draft.text, words, label: "Text of the model", changed: type});
    return () => { editor.current.destroy(); editor.current = null; };
  }, [draft.opened]);
  useEffect(() => editor.current?.setFindings(findings), [findings]);
  return html`<div class="editor" id="m-editor" ref=${host}></div>
    <p class="small">The tabulator leaves the editor; Ctrl and ] or [ indent a line. F8: the next finding.</p>`;
}

/** Stores the text and shows it, or goes back. */
function Commands({camera, draft, set, list, may}) {
  const command = useCommand(), [name, setName] = useState(storedName(draft.file, draft.place));
  useEffect(() => setName(storedName(draft.file, draft.place)), [draft.file, draft.place]);
  const put = (file, text, show) => askJson(cameraPath(camera, "models"), {method: "PUT", body: {file, text, show}});
  const remove = (file, show) => askJson(cameraPath(camera, "models/remove"), {method: "POST", body: {file, show}});
  const store = (show) => command.run(async () => {
    const told = await put(name, draft.text, show);
    set({...draft, file: name, place: "folder", before: {file: name, text: told.before ?? null, show}});
    list.again();
    return `${name} is stored${show ? told.used ? ", and shown from the next frame on" : "; the scene that is shown does not name it" : ""}.`;
  });
  const undo = () => command.run(async () => {
    const {file, text, show} = draft.before;
    await (text === null ? remove(file, show) : put(file, text, show));
    set({...draft, text: text ?? draft.text, before: null, opened: text === null ? draft.opened : (draft.opened ?? 0) + 1});
    list.again();
    return text === null ? `${file} is removed again.` : `${file} is as it was before.`;
  });
  const own = list.value.models.some((model) => model.place === "folder" && model.name === name);
  if (!may.scene) return html`<p class="note">Your role does not change models: you may write, and look at findings and picture.</p>`;
  if (!list.value.folder) return html`<p class="note">Nothing can be stored: set models.folder in the configuration.</p>`;
  return html`<form class="buttons" onSubmit=${(e) => { e.preventDefault(); store(true); }}>
      <label>Name <input id="m-name" value=${name} onInput=${(e) => setName(e.target.value)} autocomplete="off" spellcheck=${false} /></label>
      <button type="submit" disabled=${command.busy}>try on the next frame</button>
      <button type="button" disabled=${command.busy} onClick=${() => store(false)}>store</button>
      <button type="button" disabled=${command.busy || !draft.before} onClick=${undo}>undo</button>
      <${Confirmed} label="remove" question=${`Remove ${name}?`} disabled=${command.busy || !own} onYes=${() => command.run(async () => {
        const told = await remove(name, false);
        set({...draft, before: {file: name, text: told.before, show: false}});
        list.again();
        return `${name} is removed.`;
      })} /></form>
    <${Said} of=${command} />`;
}

export function Models({camera, may}) {
  const list = useRepeated(() => askJson(cameraPath(camera.id, "models")), LIST_MS, camera.id);
  const [draft, setDraft] = useState(drafts.get(camera.id) ?? null), opening = useCommand(), editor = useRef(null);
  const latest = useRef(draft);
  const set = (next) => { latest.current = next; drafts.set(camera.id, next); setDraft(next); };
  const open = (model) => model && opening.run(async () => {
    const told = await askJson(cameraPath(camera.id, `models/text?file=${encodeURIComponent(model.name)}&place=${model.place}`));
    set({file: told.file, place: told.place, text: told.text, before: null, opened: (latest.current?.opened ?? 0) + 1});
  });
  const models = list.value?.models;
  useEffect(() => { // the model of the scene, else the first
    if (models && !latest.current) open(models.find((model) => model.used) ?? models[0]);
  }, [!!models]);
  const check = useCheck(camera.id, draft?.file, draft?.text ?? "");
  if (!list.value) return html`<div class="screen"><section class="panel"><${Note} error=${list.error}>asking ...<//></section></div>`;
  const cost = check.told?.cost, plots = check.told?.plots ?? [];
  return html`<div class="screen">
    <section class="panel" aria-labelledby="m-models"><h2 id="m-models">Model</h2>
      <div class="buttons wrap"><${Choice} list=${list.value} chosen=${draft ? keyOf({place: draft.place, name: draft.file}) : ""} open=${open} />
        <span class="small">${list.value.folder ? `stored in ${list.value.folder}` : "no folder for models"}; scene ${list.value.scene || "–"}</span></div>
      <${Said} of=${opening} />
      ${draft && html`<${Commands} camera=${camera.id} draft=${draft} set=${set} list=${list} may=${may} />`}</section>
    ${draft && html`<div class="columns"><section class="panel" aria-labelledby="m-text"><h2 id="m-text">Text of ${draft.file}</h2>
        <${Text} words=${list.value.words} draft=${draft} type=${(text) => set({...latest.current, text})} findings=${check.told?.findings ?? []} editor=${editor} />
        <${Findings} check=${check} goTo=${(f) => editor.current?.goTo(f)} /></section>
      <div class="screen"><section class="panel" aria-labelledby="m-look"><h2 id="m-look">Picture</h2>
          <${Picture} camera=${camera.id} file=${draft.file} text=${check.of ?? ""} sound=${!!check.told?.sound} forms=${plots} /></section>
        <section class="panel" aria-labelledby="m-parameters"><h2 id="m-parameters">Parameters</h2><${Parameters} told=${check.told} />
          ${cost?.operations > 0 && html`<h3>Cost of an evaluation</h3><${Facts} label="Cost" rows=${[["operations", cost.operations], ["time", `${figure(cost.ns, 3)} ns`], ["runs as", cost.native ? "machine code" : `interpreted: ${cost.why_interpreted}`]]} />`}</section></div></div>`}
  </div>`;
}
