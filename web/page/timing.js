// SPDX-License-Identifier: Apache-2.0
// Screen Timing: stages of the latest frames, latency histograms, row lateness, worst frames, missed triggers.
import {html, useRef, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, save, useRepeated} from "./api.js";
import {count, duration, span, words} from "./format.js";
import {Facts, Histogram, Note, figuresOf} from "./parts.js";
import {SpanTable, TimePlot} from "./time_plot.js";
import {countsSince, histogramSince, markOf, rowsSince, useMark} from "./timing_marks.js";
import {WorstFrames, between} from "./timing_worst.js";

const PERIOD_MS = 1000, MOST = 600, AT_ONCE = 256;
const STAGES = [["trigger seen", "seen_ns"], ["pose taken", "pose_ns"], ["rendered", "render_end_ns"], ["detected", "detector_end_ns"], ["first row", "first_ns"], ["last row", "last_ns"]];
const COUNTED = {trigger_to_first_row: "Trigger to first row", trigger_to_last_row: "Trigger to last row", release_lateness: "Release lateness"};
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

/** Spans of each frame on a track each: name, columns of its begin and its end. */
const TRACKS = [["seen", "edge_ns", "seen_ns"], ["waits for earlier frames", "seen_ns", "pose_ns"], ["waits for rendering", "pose_ns", "render_begin_ns"],
                ["rendering", "render_begin_ns", "render_end_ns"], ["detector", "render_end_ns", "detector_end_ns"], ["rows due", "due_ns", "last_due_ns"], ["rows", "first_ns", "last_ns"]];

/** The frames as trace events: complete events in us since the first edge. */
export function traceOf({columns, rows}) {
  const at = Object.fromEntries(columns.map((name, k) => [name, k]));
  const tracks = [...TRACKS, ...columns.filter((name) => name.endsWith("_first_byte_ns")).map((name) => [name.slice(0, -14), name, name.replace("first", "last")])]
    .filter(([, from, to]) => from in at && to in at);
  const named = (name, tid, text) => ({name, ph: "M", pid: 1, tid, args: {name: text}});
  const events = [named("process_name", 0, "camera"), ...tracks.map(([name], k) => named("thread_name", k + 1, name))];
  const start = rows[0]?.[at.edge_ns];
  for (const row of rows)
    tracks.forEach(([name, from, to], k) => {
      const begin = row[at[from]], end = row[at[to]];
      if (!begin || !end) return;
      events.push({name, ph: "X", pid: 1, tid: k + 1, ts: between(begin, start), dur: Math.max(0, between(end, begin)),
                   args: {frame: String(row[at.frame_id]), trigger: String(row[at.trigger_id]), late_rows: row[at.late_rows]}});
    });
  return {displayTimeUnit: "ns", traceEvents: events};
}

/** Row lateness of a frame that was chosen in a plot or among the worst ones. */
function RowsOf({camera, frame, choose}) {
  const {value, error} = useRepeated(() => askJson(cameraPath(camera.id, `timing/rows?frame=${frame}`)), 0, frame);
  const us = value?.lateness_us ?? [], left = us.filter((one) => one !== null);
  const latest = left.length ? us.indexOf(left.reduce((a, b) => Math.max(a, b))) : null;
  return html`<section class="panel" aria-labelledby="t-of"><div class="headed"><h2 id="t-of">Rows of frame ${frame}, after their times</h2><button onClick=${() => choose(null)}>close</button></div>
    <${Note} error=${value ? null : error} />
    ${value && html`<${Facts} label="Rows" rows=${[["rows that left", `${count(left.length)} of ${count(us.length)}`], ["a microsecond late, or more", left.filter((one) => one >= 1).length],
      ["a millisecond, or more", left.filter((one) => one >= 1000).length], ["latest row", latest === null ? "none" : `${latest}, ${span(us[latest])}`]]} />
      ${left.some((one) => one > 0) && html`<${TimePlot} title="Lateness of each row" x=${us.map((_, row) => row)} lines=${[{name: "row", us}]} of="row" />`}`}</section>`;
}

function Frames({timing, bounds, camera, marked}) {
  const [chosen, choose] = useState(null);
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
  return html`
    <section class="panel" aria-labelledby="t-stages"><h2 id="t-stages">After the trigger edge, ${marked ? `${count(timing.rows.length)} frames since the mark` : `last ${count(timing.rows.length)} frames`}</h2>
      <${TimePlot} title="Time from the trigger edge to each stage" x=${x} lines=${stages} choose=${choose} />
      <${SpanTable} lines=${stages} />
      <div class="buttons"><button onClick=${() => save(csvOf(timing), `timing_${camera.id}.csv`)}>CSV of these frames</button>
        <button title="JSON for Perfetto or chrome://tracing" onClick=${() => save(new Blob([JSON.stringify(traceOf(timing))], {type: "application/json"}), `trace_${camera.id}.json`)}>trace events</button></div></section>
    <section class="panel" aria-labelledby="t-rows"><h2 id="t-rows">Latest row of each frame, after its time</h2>
      <${TimePlot} title="Lateness of the latest row" x=${x} lines=${[{name: "latest row", us: lateness}]} choose=${choose} />
      <p class="small">A click on a frame, or Enter, shows its rows.</p>
      <${SpanTable} lines=${[{name: "latest row", us: lateness}]} />
      <${Histogram} title="Latest row, these frames" figures=${figuresOf(lateness, bounds)} bounds=${bounds} /></section>
    ${chosen !== null && html`<${RowsOf} camera=${camera} frame=${chosen} choose=${choose} />`}
    <${WorstFrames} timing=${timing} choose=${choose} />`;
}

/** State of the trigger's clock, and of the machine's by PTP where the daemon watches that. */
function Clocks({clock, ready, tai, ptp}) {
  const us = (ns) => ns === undefined || ns === null ? "not known" : span(ns / 1e3);
  return html`<${Facts} label="Clock" rows=${[["state", clock.state], ["source", clock.source], ...(clock.offset_ns === undefined ? [] : [["last pulse, after the expected instant", us(clock.offset_ns)]]),
    ["trigger ready", ready ? "yes" : "no"], ...(tai ? [["TAI by", tai === "list" ? "leap second list" : tai]] : []), ...(ptp ? [["PTP", ptp.locked ? "locked" : "not locked"], ["PTP offset", us(ptp.offset_ns)], ["PTP path delay", us(ptp.path_delay_ns)]] : [["PTP", "not watched"]])]} />`;
}

export function Timing({camera, daemon, bounds}) {
  const {timing, error} = useTiming(camera), {mark, setMark} = useMark(camera);
  const {state} = camera, c = countsSince(state.camera, mark?.camera), up_s = daemon.daemon.up_s;
  const missed = Object.entries(countsSince(state.camera.missed_because, mark && (mark.camera.missed_because ?? {})));
  const latencies = (told) => {
    const {first_byte: outlets = {}, ...inner} = told?.stages_us ?? {};
    return {...Object.fromEntries(Object.keys(COUNTED).map((name) => [name, told?.latency_us?.[name]])), ...inner,
            ...Object.fromEntries(Object.entries(outlets).map(([kind, f]) => [`first byte, ${kind}`, f]))};
  };
  const before = latencies(mark), none = {count: 0, sum: 0, max: 0, up_to: bounds.map(() => 0)};
  const shown = timing && {...timing, rows: rowsSince(timing, mark)};
  const newest = timing?.rows.at(-1)?.[timing.columns.indexOf("acquisition")];
  return html`<div class="screen">
    <section class="panel" aria-labelledby="t-start"><div class="headed"><h2 id="t-start">${mark ? `Since the mark at frame ${mark.frame}, ${duration(up_s - mark.up_s)} ago` : "Since the start"}</h2>
      <div class="buttons"><button title="Counts from now on, on this page; the daemon counts on" onClick=${() => setMark(markOf(camera, newest, up_s))}>${mark ? "mark now instead" : "mark now"}</button>
        ${mark && html`<button onClick=${() => setMark(null)}>remove the mark</button>`}</div></div><div class="columns">
      <div><h3>Triggers and frames</h3><${Facts} label="Triggers and frames" bad=${["missed triggers", "dropped", "sent nowhere", "abandoned", "late frames", "late rows", "stalled rows"]} rows=${[
        ["triggers", c.triggers], ["frames complete", c.complete], ["missed triggers", c.missed_triggers], ["ignored, not acquiring", c.ignored], ["dropped", c.dropped], ["sent nowhere", c.unsent ?? 0],
        ["abandoned", c.abandoned], ["late frames", c.late], ["late rows", c.late_rows], ["stalled rows", c.stalled_rows],
        ["degraded frames", countsSince(state.camera.quality, mark && (mark.camera.quality ?? {})).degraded]]} /></div>
      <div><h3>Missed triggers by reason</h3><${Facts} label="Missed triggers by reason" bad=${missed.map(([reason]) => words(reason))} rows=${missed.map(([reason, n]) => [words(reason), n])} />
        <h3>Clock</h3><${Clocks} clock=${state.clock} ready=${state.trigger_ready} tai=${state.tai} ptp=${daemon.ptp} /></div>
    </div><div class="columns histograms">
      ${Object.entries(latencies(state)).filter(([, f]) => f?.up_to).map(([name, f]) => html`<${Histogram} key=${name} title=${COUNTED[name] ?? name[0].toUpperCase() + words(name).slice(1)}
        figures=${histogramSince(f, mark && (before[name] ?? none), bounds)} bounds=${bounds} />`)}
    </div></section>
    ${shown ? html`<${Frames} timing=${shown} bounds=${bounds} camera=${camera} marked=${!!mark} />` : html`<section class="panel"><h2>Latest frames</h2><${Note} error=${error}>Waiting for the daemon ...<//></section>`}
  </div>`;
}
