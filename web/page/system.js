// SPDX-License-Identifier: Apache-2.0
// Screen System: daemon, threads, configuration with its sources, log, audit.
import {html, useRef, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useRepeated} from "./api.js";
import {duration, figure} from "./format.js";
import {Facts, Note} from "./parts.js";

const EVENTS_MS = 1000, CONFIGURATION_MS = 30000, AUDIT_MS = 5000, MOST_LINES = 400;

/** The log, newest line first. */
function useLog() {
  const kept = useRef({last: 0, lines: []});
  return useRepeated(async () => {
    const {events} = await askJson(`api/v1/events?follow=0&after=${kept.current.last}`);
    if (events.length) kept.current = {last: events.at(-1).id, lines: [...events.reverse(), ...kept.current.lines].slice(0, MOST_LINES)};
    return kept.current.lines;
  }, EVENTS_MS, "log");
}

function Log() {
  const {value, error} = useLog();
  const [level, setLevel] = useState("info");
  const lines = (value ?? []).filter((line) => level === "info" || line.level === "warning" || line.level === "error");
  return html`<section class="panel" aria-labelledby="y-log"><h2 id="y-log">Log</h2>
    <label>Show <select value=${level} onChange=${(e) => setLevel(e.target.value)}><option value="info">all</option><option value="warning">warnings and errors</option></select></label>
    ${!value && html`<${Note} error=${error} />`}
    <div class="scroll" tabindex="0" role="region" aria-label="Lines of the log"><table id="log" class="grid"><thead><tr><th scope="col">time, UTC</th><th scope="col">level</th><th scope="col">message</th></tr></thead>
      <tbody>${lines.map((line) => html`<tr key=${line.id} class=${line.level}><td class="number">${line.utc.replace("T", " ").replace("Z", "")}</td><td>${line.level}</td><td>${line.text}</td></tr>`)}</tbody></table></div></section>`;
}

const valueText = (value) => typeof value === "string" ? value : JSON.stringify(value);

function Configuration({camera}) {
  const {value, error} = useRepeated(() => askJson(cameraPath(camera.id, "configuration")), CONFIGURATION_MS, camera.id);
  const [filter, setFilter] = useState(""), [all, setAll] = useState(false);
  const shown = (value?.entries ?? []).filter((e) => (all || e.source !== "default") && (!filter || e.key.includes(filter)));
  return html`<section class="panel" aria-labelledby="y-configuration"><h2 id="y-configuration">Configuration</h2>
    ${value ? html`<div class="buttons"><label>Key <input type="search" value=${filter} onInput=${(e) => setFilter(e.target.value.trim())} placeholder="trigger." /></label>
        <label><input type="checkbox" checked=${all} onChange=${(e) => setAll(e.target.checked)} /> defaults too</label></div>
      <p class="small">SHA-256 <code>${value.sha256}</code></p>
      <div class="scroll" tabindex="0" role="region" aria-label="Keys of the configuration"><table class="grid"><thead><tr><th scope="col">key</th><th scope="col">value</th><th scope="col">unit</th><th scope="col">from</th></tr></thead>
        <tbody>${shown.map((e) => html`<tr key=${e.key}><th scope="row">${e.key}</th><td>${valueText(e.value)}</td><td>${e.unit ?? ""}</td><td>${e.source}</td></tr>`)}</tbody></table>
        ${!shown.length && html`<p class="note">No such key${all ? "" : " that is set"}.</p>`}</div>` : html`<${Note} error=${error}>Waiting for the daemon ...<//>`}</section>`;
}

function Audit() {
  const {value, error} = useRepeated(() => askJson("api/v1/audit"), AUDIT_MS, "audit");
  if (error?.status === 403) return null;
  const entries = [...(value?.changes ?? [])].reverse();
  return html`<section class="panel" aria-labelledby="y-audit"><h2 id="y-audit">Changes through this page and its API</h2>
    ${!value ? html`<${Note} error=${error} />` : !entries.length ? html`<p>None since obscura-web started.</p>` : html`<div class="scroll" tabindex="0" role="region" aria-label="Changes"><table class="grid">
      <thead><tr>${["time, UTC", "who", "from", "camera", "what", "before", "after"].map((name) => html`<th scope="col">${name}</th>`)}</tr></thead>
      <tbody>${entries.map((e) => html`<tr key=${e.id}><td>${e.utc.replace("T", " ").replace("Z", "")}</td><td>${e.who}</td><td>${e.peer}</td><td>${e.camera}</td>
        <td>${e.what}${e.forced ? ", forced" : ""}</td><td>${valueText(e.before ?? "")}</td><td>${valueText(e.after ?? "")}</td></tr>`)}</tbody></table></div>`}</section>`;
}

export function System({camera, daemon, web}) {
  const d = daemon.daemon;
  return html`<div class="screen">
    <div class="columns"><section class="panel" aria-labelledby="y-daemon"><h2 id="y-daemon">Daemon</h2><${Facts} label="Daemon" bad=${["log messages lost"]} rows=${[
      ["obscurad", d.version], ["process", String(d.pid)], ["up", duration(d.up_s)], ["resident", `${Math.round(d.resident_mib)} MiB`], ["configuration", d.config],
      ["calls", d.control === undefined ? "–" : d.control || "not taken: set control.unix_socket"], ["log messages lost", d.log_lost], ["obscura-web", web?.version ?? "–"]]} /></section>
    <section class="panel" aria-labelledby="y-threads"><h2 id="y-threads">Threads</h2><table class="grid"><thead><tr><th scope="col">thread</th><th scope="col">policy</th><th scope="col" class="number">priority</th>
      <th scope="col" class="number">nice</th><th scope="col" class="number">processor time, s</th></tr></thead>
      <tbody>${daemon.threads.map((t, k) => html`<tr key=${k}><th scope="row">${t.name}</th><td>${t.policy}</td><td class="number">${t.priority}</td><td class="number">${t.nice}</td><td class="number">${figure(t.cpu_s, 4)}</td></tr>`)}</tbody></table></section></div>
    <${Log} /><${Configuration} camera=${camera} /><${Audit} />
  </div>`;
}
