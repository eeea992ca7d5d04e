// SPDX-License-Identifier: Apache-2.0
// Features of a camera as tables by their SFNC categories: fields to edit them, why they cannot be edited, what was refused.
import {html, useState} from "./vendor/preact-htm.js";
import {figure} from "./format.js";
import {rangeOf} from "./live_panels.js";

/** SFNC category, where the row tells it. */
const categoryOf = (row) => row.category ?? "Other";
/** Words of a category's name: "AcquisitionControl" reads "Acquisition control". */
const titleOf = (category) => category.replace(/([a-z])([A-Z][a-z])/g, (_, a, b) => `${a} ${b.toLowerCase()}`);
const LEVELS = ["Beginner", "Expert", "Guru"];
/** Visibility of SFNC; that of the items of selectors (further regions, triggers, counters, chunks) is never a beginner's: the first item's
 *  settings stand there by their plain names. */
const levelOf = (row) => row.name.includes("[") && row.visibility === "Beginner" ? "Expert" : row.visibility ?? "Beginner";

/** Words of an enumeration; null: it is none. */
const choicesOf = (row) => row.entries ?? ((row.allowed ?? "").includes(" | ") ? row.allowed.split(" | ") : null);

/** What a row may be, as text. */
function allowedOf(row) {
  if (choicesOf(row)) return "";
  const range = row.allowed?.replace(row.unit ? new RegExp(` ${row.unit}$`) : /$^/, "") ?? (row.min !== undefined && row.max !== undefined ? `${figure(row.min)} to ${figure(row.max)}` : "");
  return `${range}${row.increment > 0 && row.increment !== 1 ? `, by ${figure(row.increment)}` : ""}`;
}

function Field({row, value, disabled, onValue, id}) {
  if (typeof row.value === "boolean")
    return html`<input id=${id} type="checkbox" checked=${value} disabled=${disabled} onChange=${(e) => onValue(e.target.checked)} />`;
  const choices = choicesOf(row);
  if (choices)
    return html`<select id=${id} value=${value} disabled=${disabled} onChange=${(e) => onValue(e.target.value)}>${choices.map((c) => html`<option key=${c} value=${c}>${c}</option>`)}</select>`;
  if (typeof row.value === "number") {
    const {min, max} = rangeOf(row);
    return html`<input id=${id} type="number" min=${min} max=${max} step=${row.increment || (row.type === "integer" ? 1 : "any")} value=${value} disabled=${disabled}
      onInput=${(e) => onValue(e.target.value === "" ? row.value : Number(e.target.value))} />`;
  }
  return html`<input id=${id} type="text" value=${value} disabled=${disabled} onInput=${(e) => onValue(e.target.value)} />`;
}

/** Why a row cannot change; "": it can. */
export function lockOf(row, state, may) {
  if (row.writable === false) return "read only";
  if (!may.operate) return "your role only looks";
  if (row.locked) return row.why || (state.acquiring ? "not while it acquires" : "cannot change now");
  return "";
}

/** One list of the settings that the daemon sets by name and of those that only its GigE Vision side has; of the same one the first. */
export function merged(settings, device) {
  const known = new Set(settings.map((row) => row.name)), ofKnown = new Set();
  return [...settings, ...device.filter(({name}) => {
    const base = name.replace(/\[.*/, "");
    if (known.has(name)) return false;
    // A setting is that of the selector's first item.
    if (base === name || !known.has(base) || ofKnown.has(base)) return true;
    ofKnown.add(base);
    return false;
  }).map((row) => ({...row, device: true}))];
}

/** The name, which may break before the item of its selector. */
function nameOf({name}) {
  const at = name.indexOf("[");
  return at < 0 ? name : html`${name.slice(0, at)}<wbr />${name.slice(at)}`;
}

function Row({row, state, may, edit, onEdit, onRun, refused}) {
  const lock = lockOf(row, state, may), id = `f-${row.name}`;
  const value = row.type === "command" ? html`<button type="button" id=${id} disabled=${lock !== ""} onClick=${() => onRun(row)} aria-label=${`run ${row.name}`}>run</button>`
    : row.writable === false ? html`<span class="value">${row.value === "" ? "–" : typeof row.value === "boolean" ? row.value ? "yes" : "no" : figure(row.value)}</span>`
    : html`<${Field} row=${row} id=${id} value=${edit ?? row.value} disabled=${lock !== ""} onValue=${(v) => onEdit(row.name, v)} />${edit !== undefined && html` <span class="small">now ${figure(row.value)}</span>`}`;
  return html`<tr class=${edit !== undefined ? "edited" : ""} data-feature=${row.name}><th scope="row">${row.writable === false ? nameOf(row) : html`<label for=${id}>${nameOf(row)}</label>`}</th>
    <td>${value}</td><td>${row.unit ?? ""}</td><td>${allowedOf(row)}</td>
    <td>${lock ? (row.help ?? "").replace(/; not during acquisition$/, "") : row.help ?? ""}${lock && may.operate && row.writable !== false ? html` <em>${lock}</em>` : ""}${refused && html` <span class="refused" role="alert">${refused}</span>`}</td></tr>`;
}

/** Tables of the rows, category by category. `edits`: new values by name; `refused`: {field, said} of what was refused. */
export function FeatureTables({rows, state, may, edits, onEdit, onRun, refused}) {
  const [filter, setFilter] = useState(""), [level, setLevel] = useState("Beginner");
  const wanted = filter.toLowerCase(), at = LEVELS.indexOf(level);
  const shown = rows.filter((row) => (wanted ? row.name.toLowerCase().includes(wanted) || categoryOf(row).toLowerCase().includes(wanted) || (row.help ?? "").toLowerCase().includes(wanted)
    : LEVELS.indexOf(levelOf(row)) <= at));
  const groups = new Map();
  for (const row of shown) groups.set(categoryOf(row), [...(groups.get(categoryOf(row)) ?? []), row]);
  return html`<div class="buttons"><label>Find <input type="search" value=${filter} onInput=${(e) => setFilter(e.target.value.trim())} placeholder="name, category, meaning" /></label>
      <label>Level <select id="level" value=${level} onChange=${(e) => setLevel(e.target.value)}>${LEVELS.map((l) => html`<option key=${l} value=${l}>${l}</option>`)}</select></label>
      <span class="small">${shown.length} of ${rows.length} features</span></div>
    ${[...groups].map(([category, list]) => html`<details key=${category} open=${wanted !== "" || list.some((row) => !row.device)} class="category"><summary>${titleOf(category)} <span class="small">${list.length}</span></summary>
      <table class="grid features"><thead><tr><th scope="col">feature</th><th scope="col">value</th><th scope="col">unit</th><th scope="col">allowed</th><th scope="col">meaning</th></tr></thead>
        <tbody>${list.map((row) => html`<${Row} key=${row.name} row=${row} state=${state} may=${may} edit=${edits[row.name]} onEdit=${onEdit} onRun=${onRun} refused=${refused.field === row.name ? refused.said : ""} />`)}</tbody></table></details>`)}
    ${!shown.length && html`<p class="note">No such feature.</p>`}`;
}
