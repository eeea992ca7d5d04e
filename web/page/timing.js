// SPDX-License-Identifier: Apache-2.0
// Screen Timing: stages of the latest frames, latency histograms, row lateness, worst frames, missed triggers.
import {html, useRef} from "./vendor/preact-htm.js";
import {askJson, cameraPath, save, useRepeated} from "./api.js";
import {count, span, words} from "./format.js";
import {Facts, Histogram, Note, SpanTable, TimePlot, figuresOf} from "./parts.js";

const PERIOD_MS = 1000, MOST = 600, AT_ONCE = 256, WORST = 10;
const STAGES = [["trigger seen", "seen_ns"], ["pose taken", "pose_ns"], ["rendered", "render_end_ns"], ["detected", "detector_end_ns"], ["first row", "first_ns"], ["last row", "last_ns"]];
const COUNTED = {trigger_to_first_row: "Trigger to first row", trigger_to_last_row: "Trigger to last row", release_lateness: "Release lateness"};
const FLAGS = [[1, "late rows"], [2, "picture of an earlier frame"], [4, "rows missing"], [8, "no pixels"], [16, "exposure or windows clamped"],
               [32, "image lag not known"], [64, "below full quality"], [128, "biased"], [1024, "stalled by the system"]];

/** Difference of instants in us; those that a double cannot hold come as texts. */
const between = (later, earlier) => (typeof later === "string" || typeof earlier === "string" ? Number(BigInt(later) - BigInt(earlier)) : later - earlier) / 1e3;
const reasons = (flags) => FLAGS.filter(([bit]) => flags & bit).map(([, name]) => name).join(", ") || "–";

/** The newest frames of the latest acquisition: {columns, rows}. `last` counts the frames of all acquisitions, since ids begin anew. */
function useTiming(camera) {
  const none = {id: camera.id, last: 0, columns: [], rows: []}, kept = useRef(none);
  const {value, error} = useRepeated(async () => {
    if (kept.current.id !== camera.id) kept.current = none;
    for (let asked = 0; asked < MOST; asked += AT_ONCE) {
      const before = kept.current;
      const answer = await askJson(cameraPath(camera.id, `timing?after=${before.last}&most=${AT_ONCE}`)), last = Number(answer.last);
      // The daemon has begun anew.
      if (last < before.last) { kept.current = none; continue; }
      const acquisition = answer.columns.indexOf("acquisition"), all = [...before.rows, ...answer.rows], newest = all.at(-1)?.[acquisition];
      kept.current = {id: camera.id, last, columns: answer.columns, rows: all.filter((row) => row[acquisition] === newest).slice(-MOST)};
      if (answer.rows.length < AT_ONCE) break;
    }
    return kept.current;
  }, PERIOD_MS, camera.id);
  return {timing: value, error};
}

function csvOf({columns, rows}) {
  return new Blob([`${columns.join(",")}\n`, ...rows.map((row) => `${row.map((v) => v ?? "").join(",")}\n`)], {type: "text/csv"});
}

function Frames({timing, bounds, camera}) {
  const at = Object.fromEntries(timing.columns.map((name, k) => [name, k]));
  const since = (row, column) => {
    const ns = row[at[column]], edge = row[at.edge_ns];
    return ns && edge ? between(ns, edge) : null;
  };
  const outlets = timing.columns.filter((name) => name.endsWith("_first_byte_ns")).map((name) => [`first byte, ${name.slice(0, -14)}`, name]);
  const x = timing.rows.map((row) => row[0]);
  const stages = [...STAGES, ...outlets].filter(([, column]) => column in at).map(([name, column]) => ({name, us: timing.rows.map((row) => since(row, column))}))
    .filter((line) => line.us.some((us) => us !== null));
  const lateness = "worst_row_ns" in at ? timing.rows.map((row) => row[at.worst_row_ns] / 1e3) : [];
  const worst = [...timing.rows].sort((a, b) => b[at.worst_row_ns] - a[at.worst_row_ns]).slice(0, WORST);
  return html`
    <section class="panel" aria-labelledby="t-stages"><h2 id="t-stages">After the trigger edge, last ${count(timing.rows.length)} frames</h2>
      <${TimePlot} title="Time from the trigger edge to each stage" x=${x} lines=${stages} />
      <${SpanTable} lines=${stages} />
      <div class="buttons"><button onClick=${() => save(csvOf(timing), `timing_${camera.id}.csv`)}>CSV of these frames</button></div></section>
    <section class="panel" aria-labelledby="t-rows"><h2 id="t-rows">Latest row of each frame, after its time</h2>
      <${TimePlot} title="Lateness of the latest row" x=${x} lines=${[{name: "latest row", us: lateness}]} />
      <${SpanTable} lines=${[{name: "latest row", us: lateness}]} />
      <${Histogram} title="Latest row, these frames" figures=${figuresOf(lateness, bounds)} bounds=${bounds} /></section>
    <section class="panel" aria-labelledby="t-worst"><h2 id="t-worst">Worst frames</h2>
      <table class="grid"><thead><tr><th scope="col" class="number">frame</th><th scope="col" class="number">latest row</th><th scope="col" class="number">after its time</th>
        <th scope="col" class="number">late rows</th><th scope="col" class="number">stalled rows</th><th scope="col" class="number">edge to last row</th><th scope="col">what was wrong</th></tr></thead>
      <tbody>${worst.map((row) => html`<tr key=${row[0]}><th scope="row" class="number">${row[0]}</th><td class="number">${row[at.worst_row]}</td>
        <td class="number">${span(row[at.worst_row_ns] / 1e3)}</td><td class="number">${count(row[at.late_rows])}</td><td class="number">${count(row[at.stalled_rows])}</td>
        <td class="number">${span(since(row, "last_ns"))}</td><td>${reasons(row[at.flags])}</td></tr>`)}</tbody></table></section>`;
}

export function Timing({camera, bounds}) {
  const {timing, error} = useTiming(camera);
  const c = camera.state.camera, latency = camera.state.latency_us ?? {};
  const {first_byte: outlets = {}, ...inner} = camera.state.stages_us ?? {};
  const stages = [...Object.entries(inner), ...Object.entries(outlets).map(([kind, f]) => [`first byte, ${kind}`, f])];
  const missed = Object.entries(c.missed_because ?? {});
  return html`<div class="screen">
    <section class="panel" aria-labelledby="t-start"><h2 id="t-start">Since the start</h2><div class="columns">
      <div><h3>Triggers and frames</h3><${Facts} label="Triggers and frames" bad=${["missed triggers", "dropped", "abandoned", "late frames", "late rows", "stalled rows"]} rows=${[
        ["triggers", c.triggers], ["frames complete", c.complete], ["missed triggers", c.missed_triggers], ["ignored, not acquiring", c.ignored], ["dropped", c.dropped],
        ["abandoned", c.abandoned], ["late frames", c.late], ["late rows", c.late_rows], ["stalled rows", c.stalled_rows], ["degraded frames", c.quality?.degraded]]} /></div>
      <div><h3>Missed triggers by reason</h3><${Facts} label="Missed triggers by reason" bad=${missed.map(([reason]) => words(reason))} rows=${missed.map(([reason, n]) => [words(reason), n])} />
        <h3>Clock</h3><${Facts} label="Clock" rows=${[["state", camera.state.clock.state], ["source", camera.state.clock.source], ["trigger ready", camera.state.trigger_ready ? "yes" : "no"]]} /></div>
    </div><div class="columns histograms">
      ${Object.entries(COUNTED).filter(([name]) => latency[name]?.up_to).map(([name, title]) => html`<${Histogram} key=${name} title=${title} figures=${latency[name]} bounds=${bounds} />`)}
      ${stages.filter(([, f]) => f?.up_to).map(([name, f]) => html`<${Histogram} key=${name} title=${name[0].toUpperCase() + words(name).slice(1)} figures=${f} bounds=${bounds} />`)}
    </div></section>
    ${timing ? html`<${Frames} timing=${timing} bounds=${bounds} camera=${camera} />` : html`<section class="panel"><h2>Latest frames</h2><${Note} error=${error}>Waiting for the daemon ...<//></section>`}
  </div>`;
}
