// SPDX-License-Identifier: Apache-2.0
// Parts that several screens use: tables of names and numbers, notes, buttons, histograms with their tables.
import {html, useEffect, useRef, useState} from "./vendor/preact-htm.js";
import {copy, useCommand} from "./api.js";
import {count, quantile, span} from "./format.js";

/** Rows [name, value]; those named in `bad` stand out where they are not 0. */
export function Facts({rows, bad = [], label}) {
  return html`<table class="facts" aria-label=${label}><tbody>${rows.map(([name, value]) => html`
    <tr key=${name}><th scope="row">${name}</th><td class=${`number${bad.includes(name) && value > 0 ? " bad-number" : ""}`}>${
      typeof value === "number" ? count(value) : value}</td></tr>`)}</tbody></table>`;
}

/** Why something is not shown, in one line. */
export const Note = ({error, children}) => error || children
  ? html`<p class="note" role="note">${error ? error.message : children}</p>` : null;

/** A text to be copied, with a button that does it. `what` it is, for those who do not see it. */
export function Copyable({text, what}) {
  const command = useCommand();
  return html`<span class="copyable"><code>${text}</code> <button type="button" class="mini" aria-label=${`copy ${what}`} onClick=${() => command.run(async () => { await copy(text); return "copied"; })}>copy</button>${
    command.said && html` <span class=${`small${command.bad ? " trouble" : ""}`} role="status">${command.said}</span>`}</span>`;
}

/** A button that asks once more before it does what cannot be taken back. */
export function Confirmed({label, question, disabled, onYes}) {
  const [asking, setAsking] = useState(false);
  const yes = useRef(null);
  useEffect(() => { if (asking) yes.current?.focus(); }, [asking]);
  return asking ? html`<span class="confirm" role="group" aria-label=${question}>${question} <button type="button" class="danger" ref=${yes} onClick=${() => { setAsking(false); onYes(); }}>yes, ${label}</button>
      <button type="button" onClick=${() => setAsking(false)}>no</button></span>`
    : html`<button type="button" class="danger" disabled=${disabled} onClick=${() => setAsking(true)}>${label} ...</button>`;
}

/** What became of a command; announced to screen readers. */
export const Said = ({of}) => html`<p class=${`said${of.bad ? " bad" : ""}`} role="status">${of.busy ? "..." : of.said}</p>`;

/** Histogram with buckets up to each of `bounds` us, and its figures as text. `figures`: {up_to, count, p50, p99, max} in us; `atMost`: its
 *  quantiles are only known not to be above these, the largest too but for `maxExact`. `sum`, of all, may be missing. */
export function Histogram({title, figures, bounds}) {
  const counts = figures.up_to.map((n, k) => n - (k ? figures.up_to[k - 1] : 0));
  counts.push(figures.count - figures.up_to.at(-1));
  const most = Math.log1p(Math.max(1, ...counts));
  const limit = figures.atMost ? "≤ " : "", largest = figures.maxExact ? "" : limit;
  const mean = figures.count && figures.sum !== undefined ? `mean ${span(figures.sum / figures.count)}, ` : "";
  const told = figures.count ? `${mean}p50 ${limit}${span(figures.p50)}, p99 ${limit}${span(figures.p99)}, max ${largest}${span(figures.max)}; ` : "";
  const upTo = (k) => k < bounds.length ? span(bounds[k]) : `over ${span(bounds.at(-1))}`;
  return html`<figure class="histogram">
    <h3>${title}</h3>
    <svg viewBox="0 0 420 92" role="img" aria-label=${`${title}: ${told.replace("p50", "median") || "median not known, "}${count(figures.count)} frames`}>
      <line x1="0" y1="76" x2="420" y2="76" />
      ${counts.map((n, k) => {
        const height = 66 * Math.log1p(n) / most;
        return html`<rect x=${k * 21 + 2} y=${76 - height} width="17" height=${height}><title>${count(n)} up to ${upTo(k)}</title></rect>
          ${k % 3 === 0 && k < bounds.length && html`<text x=${k ? k * 21 + 10 : 0} y="88" text-anchor=${k ? "middle" : "start"}>${span(bounds[k])}</text>`}`;
      })}
    </svg>
    <figcaption>${told}${count(figures.count)} frames (log)</figcaption>
    <details><summary>Table</summary><table class="facts"><thead><tr><th scope="col">up to</th><th scope="col" class="number">frames</th><th scope="col" class="number">all up to there</th></tr></thead>
      <tbody>${counts.map((n, k) => html`<tr key=${k}><th scope="row">${upTo(k)}</th><td class="number">${count(n)}</td><td class="number">${
        count(figures.up_to[k] ?? figures.count)}${figures.count ? ` (${+(100 * (figures.up_to[k] ?? figures.count) / figures.count).toPrecision(4)} %)` : ""}</td></tr>`)}</tbody></table></details>
  </figure>`;
}

/** Figures as the daemon's of values in us. */
export function figuresOf(values, bounds) {
  const sorted = [...values].sort((a, b) => a - b);
  let at = 0;
  const upTo = bounds.map((bound) => { while (at < sorted.length && sorted[at] <= bound) ++at; return at; });
  return {count: sorted.length, up_to: upTo, p50: quantile(sorted, 0.5), p99: quantile(sorted, 0.99), max: sorted.at(-1)};
}
