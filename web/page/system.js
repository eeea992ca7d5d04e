// SPDX-License-Identifier: Apache-2.0
// Screen System: daemon, threads and their heartbeats, advice for real time, log with its catalogue, configuration with its sources, audit.
import {html, useEffect, useRef, useState} from "./vendor/preact-htm.js";
import {ask, askJson, cameraPath, save, useCommand, useRepeated} from "./api.js";
import {count, duration, figure, span} from "./format.js";
import {Confirmed, Facts, Note, Said} from "./parts.js";

const EVENTS_MS = 1000, CONFIGURATION_MS = 30000, AUDIT_MS = 5000, MOST_LINES = 400, SILENT_S = 1;
const LEVELS = ["error", "warning", "notice", "info", "debug"];

const utc = (text) => text.replace("T", " ").replace("Z", "");

/** The log, newest line first. */
function useLog() {
  const kept = useRef({last: 0, lines: []});
  return useRepeated(async () => {
    const {events} = await askJson(`api/v1/events?follow=0&after=${kept.current.last}`);
    if (events.length) kept.current = {last: events.at(-1).id, lines: [...events.reverse(), ...kept.current.lines].slice(0, MOST_LINES)};
    return kept.current.lines;
  }, EVENTS_MS, "log");
}

/** What messages mean, by their ids: those of the journal's catalogue. */
async function readCatalogue() {
  const text = await (await fetch(new URL("messages.txt", import.meta.url))).text();
  const entries = text.split(/^-- /m).slice(1).map((entry) => {
    const [head, ...paragraphs] = entry.trim().split("\n\n");
    return [head.split("\n")[0].trim(), paragraphs.join(" ").replaceAll("\n", " ")];
  });
  return new Map(entries);
}

function LogLevel({camera, level, may}) {
  const command = useCommand();
  if (!level) return null;
  const set = (wanted) => command.run(async () => {
    await askJson(cameraPath(camera.id, "log-level"), {method: "POST", body: {level: wanted}});
    return `The daemon writes ${wanted} and what is worse, until its next reload.`;
  });
  return html`<label>The daemon writes <select id="log-level" value=${level} disabled=${!may.operate || command.busy} onChange=${(e) => set(e.target.value)}>${LEVELS.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}</select></label><${Said} of=${command} />`;
}

function Log({camera, level, pid, may}) {
  const {value, error} = useLog();
  const [worst, setWorst] = useState("debug"), [wanted, setWanted] = useState(""), [open, setOpen] = useState(0), [catalogue, setCatalogue] = useState(null);
  const [all, setAll] = useState(false), others = (value ?? []).some((line) => line.pid !== undefined && line.pid !== pid);
  useEffect(() => { if (open && !catalogue) readCatalogue().then(setCatalogue, () => setCatalogue(new Map())); }, [open]);
  const lines = (value ?? []).filter((line) => (all || !others || line.pid === pid) && LEVELS.indexOf(line.level) <= LEVELS.indexOf(worst) && (!wanted || line.text.toLowerCase().includes(wanted.toLowerCase())));
  const meaning = (line) => catalogue ? catalogue.get(line.message) ?? "The catalogue has nothing on it." : "...";
  return html`<section class="panel" aria-labelledby="y-log"><h2 id="y-log">Log</h2>
    <div class="buttons"><label>Show <select value=${worst} onChange=${(e) => setWorst(e.target.value)}><option value="debug">all</option><option value="notice">notices and worse</option><option value="warning">warnings and errors</option><option value="error">errors</option></select></label>
      <label>with <input type="search" value=${wanted} onInput=${(e) => setWanted(e.target.value)} /></label>
      ${others && html`<label><input type="checkbox" checked=${all} onChange=${(e) => setAll(e.target.checked)} /> of other daemons, too</label>`}<${LogLevel} camera=${camera} level=${level} may=${may} /></div>
    ${!value && html`<${Note} error=${error} />`}
    <div class="scroll" tabindex="0" role="region" aria-label="Lines of the log"><table id="log" class="grid"><thead><tr><th scope="col">time, UTC</th><th scope="col">level</th>${all && html`<th scope="col" class="number">process</th>`}<th scope="col">message</th></tr></thead>
      <tbody>${lines.map((line) => html`<tr key=${line.id} class=${line.level}><td class="number">${utc(line.utc)}</td><td>${line.level}</td>${all && html`<td>${String(line.pid)}</td>`}<td>${line.message
        ? html`<button type="button" class="line-text" aria-expanded=${String(open === line.id)} title="what it means" onClick=${() => setOpen(open === line.id ? 0 : line.id)}>${line.text}</button>` : line.text}${open === line.id && html`<p class="small meaning">${meaning(line)}</p>`}</td></tr>`)}</tbody></table></div></section>`;
}

const valueText = (value) => typeof value === "string" ? value : JSON.stringify(value);

function Configuration({camera, may}) {
  const {value, error, again} = useRepeated(() => askJson(cameraPath(camera.id, "configuration")), CONFIGURATION_MS, camera.id);
  const [filter, setFilter] = useState(""), [all, setAll] = useState(false), command = useCommand();
  const differs = (e) => e.default !== undefined && e.default !== "" && e.default !== e.value;
  const shown = (value?.entries ?? []).filter((e) => (all || filter || e.source !== "default") && (!filter || e.key.includes(filter)));
  const reload = () => command.run(async () => {
    await askJson(cameraPath(camera.id, "reload"), {method: "POST", body: {}});
    again();
    return "The file is in use as it is now.";
  });
  return html`<section class="panel" aria-labelledby="y-configuration"><h2 id="y-configuration">Configuration</h2>
    ${value ? html`<div class="buttons"><label>Key <input type="search" value=${filter} onInput=${(e) => setFilter(e.target.value.trim())} placeholder="trigger." /></label>
        <label><input type="checkbox" checked=${all} onChange=${(e) => setAll(e.target.checked)} /> defaults too</label>
        ${may.administer && html`<${Confirmed} label="reload the file" question="Take on all of its changes?" disabled=${command.busy} onYes=${reload} />`}<${Said} of=${command} /></div>
      <p class="small">${value.file ? html`<code>${value.file}</code>, ` : ""}${value.entries.filter((e) => e.source !== "default").length} keys set, ${value.entries.filter(differs).length} of them differ from the default (bold). SHA-256 <code>${value.sha256}</code></p>
      <div class="scroll" tabindex="0" role="region" aria-label="Keys of the configuration"><table class="grid"><thead><tr><th scope="col">key</th><th scope="col">value</th><th scope="col">unit</th><th scope="col">default</th><th scope="col">from</th></tr></thead>
        <tbody>${shown.map((e) => html`<tr key=${e.key}><th scope="row">${e.key}</th><td>${differs(e) ? html`<strong>${valueText(e.value)}</strong>` : valueText(e.value)}</td><td>${e.unit ?? ""}</td><td>${e.default === undefined ? "" : valueText(e.default) || "–"}</td><td>${e.source}</td></tr>`)}</tbody></table>
        ${!shown.length && html`<p class="note">No such key${all ? "" : " that is set"}.</p>`}</div>` : html`<${Note} error=${error}>Waiting for the daemon ...<//>`}</section>`;
}

function Audit() {
  const {value, error} = useRepeated(() => askJson("api/v1/audit"), AUDIT_MS, "audit");
  if (error?.status === 403) return null;
  const entries = [...(value?.changes ?? [])].reverse();
  return html`<section class="panel" aria-labelledby="y-audit"><h2 id="y-audit">Changes through this page and its API</h2>
    ${!value ? html`<${Note} error=${error} />` : !entries.length ? html`<p>None since obscura-web started.</p>` : html`<div class="scroll" tabindex="0" role="region" aria-label="Changes"><table class="grid">
      <thead><tr>${["time, UTC", "who", "from", "camera", "what", "before", "after"].map((name) => html`<th scope="col">${name}</th>`)}</tr></thead>
      <tbody>${entries.map((e) => html`<tr key=${e.id}><td>${utc(e.utc)}</td><td>${e.who}</td><td>${e.peer}</td><td>${e.camera}</td>
        <td>${e.what}${e.forced ? ", forced" : ""}</td><td>${valueText(e.before ?? "")}</td><td>${valueText(e.after ?? "")}</td></tr>`)}</tbody></table></div>`}</section>`;
}

/** Share of a core that each thread has taken since the state before, by its place in the list. */
function useShares(daemon) {
  const kept = useRef({up_s: 0, cpu: [], shares: []}), up_s = daemon.daemon.up_s;
  if (up_s !== kept.current.up_s) {
    const {up_s: before, cpu, shares} = kept.current, passed = up_s - before, same = cpu.length === daemon.threads.length && passed > 0;
    // Ticks of 10 ms: a share of less time says little.
    if (!same || passed >= 2 || up_s < before)
      kept.current = {up_s, cpu: daemon.threads.map((t) => t.cpu_s), shares: same ? daemon.threads.map((t, k) => 100 * (t.cpu_s - cpu[k]) / passed) : shares};
  }
  return kept.current.shares;
}

function Threads({daemon}) {
  const shares = useShares(daemon);
  const number = (title) => html`<th scope="col" class="number">${title}</th>`;
  return html`<section class="panel" aria-labelledby="y-threads"><h2 id="y-threads">Threads</h2><div class="wide"><table class="grid"><thead><tr><th scope="col">thread</th><th scope="col">policy</th>${number("priority")}${number("nice")}
      <th scope="col">may run on</th>${number("ran on")}${number("CPU, s")}${number("% of a core")}</tr></thead>
    <tbody>${daemon.threads.map((t, k) => html`<tr key=${k}><th scope="row">${t.name}</th><td>${t.policy}</td><td class="number">${t.priority}</td><td class="number">${t.nice}</td><td>${t.cores ?? "–"}</td>
      <td class="number">${t.processor ?? "–"}</td><td class="number">${figure(t.cpu_s, 4)}</td><td class="number">${shares[k] >= 0 ? shares[k].toFixed(1) : "–"}</td></tr>`)}</tbody></table></div>
    ${daemon.heartbeats?.length > 0 && html`<h3>Last beat of supervised threads</h3><div class="beats">${daemon.heartbeats.map((b, k) => {
      const quiet = !b.silent && b.age_s > SILENT_S;
      return html`<span key=${k} class=${quiet ? "trouble" : ""}>${b.name}: ${b.silent ? "waits" : `${span(1e6 * b.age_s)} ago`}${quiet ? " ✗" : ""}</span>`;
    })}</div>`}</section>`;
}

function Daemon({camera, daemon, web, may}) {
  const d = daemon.daemon, command = useCommand(), test = useCommand();
  const measure = () => test.run(async () => {
    const {p99_us: p99, rows} = await askJson("api/v1/self-test");
    return `An ordinary thread is ${span(p99)} late at most in 99 of 100 rows, ${span(Math.max(...rows.map((row) => row.max_us)))} at worst. The daemon's may be better.`;
  });
  const bundle = () => command.run(async () => {
    const answer = await ask(`api/v1/support-bundle?camera=${encodeURIComponent(camera.id)}`);
    const name = /filename="([^"]+)"/.exec(answer.headers.get("Content-Disposition") ?? "")?.[1] ?? "obscura-support.tar.zst";
    const blob = await answer.blob();
    save(blob, name);
    return `Saved ${name}, ${count(blob.size)} bytes. Look into it before you send it.`;
  });
  return html`<section class="panel" aria-labelledby="y-daemon"><h2 id="y-daemon">Daemon</h2><${Facts} label="Daemon" bad=${["log messages lost"]} rows=${[
      ["obscurad", d.version], ["process", String(d.pid)], ["up", duration(d.up_s)], ["resident", `${Math.round(d.resident_mib)} MiB`],
      ...(d.locked_mib !== undefined ? [["memory lock", d.locked_mib > 0 ? `on, ${Math.round(d.locked_mib)} MiB of address space` : "none: it can be paged out"]] : []), ["configuration", d.config],
      ["calls", d.control === undefined ? "–" : d.control || "not taken: set control.unix_socket"], ["log messages lost", d.log_lost], ["obscura-web", web?.version ?? "–"]]} />
    <div class="buttons">${may.administer ? html`<button disabled=${command.busy} onClick=${bundle}>${command.busy ? "collecting ..." : "download support bundle"}</button><${Said} of=${command} />`
      : html`<span class="small">Support bundle: an admin's link, or <code>obscura support-bundle</code>.</span>`}</div>
    ${may.operate && html`<div class="buttons"><button disabled=${test.busy} onClick=${measure}>measure this machine</button><${Said} of=${test} /></div>`}
    ${d.advice && html`<h3>For rows on time</h3>${d.advice.length ? html`<ul class="advice">${d.advice.map((line) => html`<li key=${line}>${line}</li>`)}</ul><p class="small"><code>obscura timing --self-test</code> measures what this machine can promise.</p>` : html`<p>✓ Nothing to advise.</p>`}`}</section>`;
}

export function System({camera, daemon, web, may}) {
  return html`<div class="screen">
    <div class="columns unequal"><${Daemon} camera=${camera} daemon=${daemon} web=${web} may=${may} /><${Threads} daemon=${daemon} /></div>
    <${Log} camera=${camera} level=${daemon.daemon.log_level} pid=${daemon.daemon.pid} may=${may} /><${Configuration} camera=${camera} may=${may} /><${Audit} />
  </div>`;
}
