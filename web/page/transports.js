// SPDX-License-Identifier: Apache-2.0
// Screen Transports: what each transport of the camera has delivered, and its further counters.
import {html} from "./vendor/preact-htm.js";
import {words} from "./format.js";
import {Facts} from "./parts.js";

const TITLES = {gige: "GigE Vision", v4l2: "V4L2", file: "Files", stimulator: "Optical stimulator", watch: "Frames for programs and this page"};
const BAD = ["dropped", "errors", "send errors", "control lost", "no node", "lost"];

const rowsOf = (values) => Object.entries(values).filter(([, v]) => v === null || typeof v !== "object")
  .map(([name, v]) => [words(name), v === true ? "yes" : v === false ? "no" : v]);

export function Transports({camera}) {
  const {state} = camera, all = Object.entries(state.transports ?? {});
  return html`<div class="screen"><section class="panel" aria-labelledby="p-address"><h2 id="p-address">Address</h2>
      <${Facts} label="Address" rows=${[["GigE Vision", state.address], ["controlled by", state.controller || "nobody"]]} />
      <p class="small">The flight computer connects to this address; <code>obscura grab</code> and any GigE Vision client do too.</p></section>
    ${all.length === 0 && html`<section class="panel"><p class="note">This camera has no transport: frames go nowhere.</p></section>`}
    <div class="columns">${all.map(([kind, values]) => html`<section class="panel" key=${kind} aria-labelledby=${`p-${kind}`}><h2 id=${`p-${kind}`}>${TITLES[kind] ?? kind}</h2>
      <${Facts} label=${TITLES[kind] ?? kind} bad=${kind === "watch" ? [] : BAD} rows=${rowsOf(values)} />
      ${Object.entries(values).filter(([, v]) => v !== null && typeof v === "object" && Object.keys(v).length).map(([name, group]) => html`<h3>${words(name)}</h3><${Facts} label=${words(name)} bad=${BAD} rows=${rowsOf(group)} />`)}</section>`)}</div>
  </div>`;
}
