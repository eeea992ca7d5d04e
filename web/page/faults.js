// SPDX-License-Identifier: Apache-2.0
// Screen Faults: rules that strike the stream on purpose; templates, arming, disarming.
import {html, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand, useRepeated} from "./api.js";
import {count, figure, words} from "./format.js";
import {Note, Said} from "./parts.js";

const PERIOD_MS = 2000;
const TEMPLATES = [
  {title: "1 % of the packets lost, resends bring them", rule: {kind: "lose", percent: 1}},
  {title: "bursts of 50 packets lost for good", rule: {kind: "lose_for_good", percent: 1, burst_packets: 50}},
  {title: "every 10th frame skipped", rule: {kind: "skip_frame", every: 10}},
  {title: "picture frozen", rule: {kind: "freeze_frame"}},
  {title: "time stamps 1 ms off", rule: {kind: "wrong_timestamp", amount: 1000}},
  {title: "commands not answered", rule: {kind: "mute_control"}},
];
/** Parameters of a rule, where the daemon does not describe them; the keys of [[gige.faults]]. */
const PARAMETERS = [{name: "percent", unit: "%", default: 100, help: "Share of packets, frames or commands that are struck"},
                    {name: "first", default: 1, help: "First frame, or command"}, {name: "last", default: 0, help: "Last one; 0: no end"},
                    {name: "every", default: 1, help: "Only every so many"}, {name: "burst_packets", default: 1, help: "Packets in a row"},
                    {name: "amount", default: 1, help: "delay, wrong_timestamp: us; wrong_block_id: how far off"}];

const ORIGINS = {configuration: "the configuration", call: "an operator", feature: "a GigE Vision client"};

const told = ({struck, origin, ...rule}) => rule;
/** A rule without what is as by default. */
const text = (rule, parameters) => parameters.filter((p) => rule[p.name] !== undefined && rule[p.name] !== p.default && rule[p.name] !== Number(p.default))
  .map((p) => `${words(p.name)} ${figure(rule[p.name])}${p.unit ? ` ${p.unit}` : ""}`).join(", ") || "always";

export function useFaults(camera) {
  return useRepeated(() => askJson(cameraPath(camera.id, "faults")), PERIOD_MS, camera?.id);
}

export function Faults({camera, may, faults}) {
  const {value, error, again} = faults;
  const command = useCommand();
  const [draft, setDraft] = useState({kind: "lose", percent: 1});
  const rules = value?.rules ?? [], kinds = value?.kinds ?? [];
  const parameters = value?.parameters?.filter((p) => p.name !== "kind") ?? PARAMETERS;
  const put = (wanted, line) => command.run(async () => {
    await askJson(cameraPath(camera.id, "faults"), {method: "PUT", body: {rules: wanted}});
    again();
    return line;
  });
  const arm = (rule) => put([...rules.map(told), rule], `Armed: ${words(rule.kind)}.`);
  if (!value) return html`<div class="screen"><section class="panel"><h2>Faults</h2><${Note} error=${error}>Waiting for the daemon ...<//></section></div>`;
  return html`<div class="screen">
    <section class="panel" aria-labelledby="x-rules"><h2 id="x-rules">Armed</h2>
      ${rules.length ? html`<table class="grid"><thead><tr><th scope="col">fault</th><th scope="col">when</th><th scope="col">armed by</th><th scope="col" class="number">struck</th><td></td></tr></thead>
        <tbody>${rules.map((rule, k) => html`<tr key=${k}><th scope="row">${words(rule.kind)}</th><td>${text(rule, parameters)}</td><td>${ORIGINS[rule.origin] ?? rule.origin ?? "–"}</td><td class="number">${count(rule.struck ?? 0)}</td>
          <td>${may.operate && html`<button disabled=${command.busy} onClick=${() => put(rules.filter((_, j) => j !== k).map(told), "Disarmed.")} aria-label=${`disarm ${words(rule.kind)}`}>disarm</button>`}</td></tr>`)}</tbody></table>`
        : html`<p>No fault is armed.</p>`}
      ${may.operate && html`<div class="buttons"><button class="danger" disabled=${command.busy || !rules.length} onClick=${() => put([], "All disarmed.")}>disarm all</button></div>`}
      <${Said} of=${command} /></section>
    ${may.operate ? html`<section class="panel" aria-labelledby="x-templates"><h2 id="x-templates">Templates</h2>
        <div class="buttons wrap">${TEMPLATES.filter((t) => !kinds.length || kinds.some((k) => k.name === t.rule.kind)).map((t) => html`<button key=${t.title} disabled=${command.busy} onClick=${() => arm(t.rule)}>${t.title}</button>`)}</div></section>
      <section class="panel" aria-labelledby="x-own"><h2 id="x-own">A rule of your own</h2>
        <form onSubmit=${(e) => { e.preventDefault(); arm(draft); }}><div class="form">
          <label>fault <select value=${draft.kind} onChange=${(e) => setDraft({kind: e.target.value})}>${kinds.map((k) => html`<option key=${k.name} value=${k.name}>${words(k.name)}</option>`)}</select></label>
          ${parameters.map((p) => html`<label key=${p.name} title=${p.help}>${words(p.name)}${p.unit ? `, ${p.unit}` : ""}
            <input type="number" step="any" value=${draft[p.name] ?? Number(p.default ?? 0)} onInput=${(e) => setDraft({...draft, [p.name]: e.target.value === "" ? undefined : Number(e.target.value)})} /></label>`)}</div>
          <p class="small">${kinds.find((k) => k.name === draft.kind)?.help ?? ""}</p>
          <div class="buttons"><button type="submit" disabled=${command.busy || !kinds.length}>arm</button></div></form></section>`
      : html`<section class="panel"><p class="note">Your role only looks: an operator's link can arm and disarm.</p></section>`}
  </div>`;
}
