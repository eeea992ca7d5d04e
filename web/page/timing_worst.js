// SPDX-License-Identifier: Apache-2.0
// The frames that were latest, with the stage that made them late, as `obscura timing` tells it.
import {html} from "./vendor/preact-htm.js";
import {count, span} from "./format.js";

const WORST = 10;
const FLAGS = [[1, "late rows"], [2, "picture of an earlier frame"], [4, "rows missing"], [8, "no pixels"], [16, "exposure or windows clamped"],
               [32, "image lag not known"], [64, "below full quality"], [128, "biased"], [1024, "stalled by the system"]];
const STAGES = [["the edge was seen late", "edge_ns", "seen_ns"], ["wait for earlier frames", "seen_ns", "pose_ns"], ["wait for rendering", "pose_ns", "render_begin_ns"],
                ["rendering", "render_begin_ns", "render_end_ns"], ["the detector", "render_end_ns", "detector_end_ns"]];

/** Difference of instants in us; those that a double cannot hold come as texts. */
export const between = (later, earlier) => (typeof later === "string" || typeof earlier === "string" ? Number(BigInt(later) - BigInt(earlier)) : later - earlier) / 1e3;
const reasons = (flags) => FLAGS.filter(([bit]) => flags & bit).map(([, name]) => name).join(", ") || "–";

/** How late a frame's last row left, us. `of(name)`: value of a column. */
function latenessOf(of) {
  if (!of("late_rows") && !of("stalled_rows")) return 0;
  return of("last_ns") ? Math.max(0, between(of("last_ns"), of("last_due_ns"))) : of("worst_row_ns") / 1e3;
}

/** What made a frame late: the longest of its stages. */
function causeOf(of) {
  if (!of("late_rows") && !of("stalled_rows")) return "in time";
  if (!of("late_rows")) return `${count(of("stalled_rows"))} rows were ready in time; the system did not run the thread that releases them`;
  if (!of("last_ns") || !of("detector_end_ns")) return `given up with ${count(of("late_rows"))} of ${count(of("rows"))} rows late`;
  const stages = STAGES.map(([name, from, to]) => [name, between(of(to), of(from))]);
  stages.push(["the release", Math.max(0, Math.min(between(of("last_ns"), of("detector_end_ns")), between(of("last_ns"), of("last_due_ns"))))]);
  const [name, us] = stages.reduce((most, stage) => stage[1] > most[1] ? stage : most);
  return `${name}, ${span(us)}`;
}

/** The worst frames first: {of, late_us}. */
export function worstOf({columns, rows}) {
  const at = Object.fromEntries(columns.map((name, k) => [name, k]));
  return rows.map((row) => {
    const of = (name) => row[at[name]];
    return {of, late_us: latenessOf(of)};
  }).sort((a, b) => b.late_us - a.late_us || b.of("worst_row_ns") - a.of("worst_row_ns")).slice(0, WORST);
}

/** `choose(frame)`: shows its rows. */
export function WorstFrames({timing, choose}) {
  const worst = worstOf(timing);
  return html`<section class="panel wide" aria-labelledby="t-worst"><h2 id="t-worst">Worst frames</h2>
    ${worst.length ? html`<table class="grid"><thead><tr><th scope="col" class="number">frame</th><th scope="col" class="number">late by</th><th scope="col" class="number">late rows</th>
      <th scope="col" class="number">stalled rows</th><th scope="col" class="number">latest row</th><th scope="col" class="number">after its time</th><th scope="col" class="number">edge to last row</th>
      <th scope="col">made late by</th><th scope="col">flags</th></tr></thead>
    <tbody>${worst.map(({of, late_us}) => html`<tr key=${of("frame_id")}><th scope="row" class="number"><button class="mini" title="shows its rows" onClick=${() => choose(of("frame_id"))}>${of("frame_id")}</button></th><td class="number">${span(late_us)}</td>
      <td class="number">${count(of("late_rows"))}</td><td class="number">${count(of("stalled_rows"))}</td><td class="number">${of("worst_row")}</td><td class="number">${span(of("worst_row_ns") / 1e3)}</td>
      <td class="number">${span(of("last_ns") ? between(of("last_ns"), of("edge_ns")) : null)}</td><td>${causeOf(of)}</td><td>${reasons(of("flags"))}</td></tr>`)}</tbody></table>`
    : html`<p class="note">No frames yet.</p>`}</section>`;
}
