// SPDX-License-Identifier: Apache-2.0
// Screen Faults: rules that strike the stream on purpose; templates, windows of frames, what has been struck, disarming.
import {html, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand, useRepeated} from "./api.js";
import {count, figure, words} from "./format.js";
import {Note, Said} from "./parts.js";

const PERIOD_MS = 2000, FRAMES = 100;
const TEMPLATES = [
  {title: "1 % of the packets lost, resends bring them", rule: {kind: "lose", percent: 1}},
  {title: "bursts of 50 packets lost for good", rule: {kind: "lose_for_good", percent: 1, burst_packets: 50}},
  {title: "packets out of order", rule: {kind: "reorder", percent: 5}},
  {title: "packets sent twice", rule: {kind: "duplicate", percent: 5}},
  {title: "a bit of 0.1 % of the packets inverted", rule: {kind: "corrupt", percent: 0.1}},
  {title: "every 10th frame skipped", rule: {kind: "skip_frame", every: 10}},
  {title: "leader lost every 10th frame", rule: {kind: "drop_leader", every: 10}},
  {title: "trailer lost every 10th frame", rule: {kind: "drop_trailer", every: 10}},
  {title: "picture frozen", rule: {kind: "freeze_frame"}},
  {title: "time stamps 1 ms off", rule: {kind: "wrong_timestamp", amount: 1000}},
  {title: "commands not answered", rule: {kind: "mute_control"}},
  {title: "heartbeats not heard", rule: {kind: "heartbeat_loss"}},
];
/** Kinds that strike commands: their windows count these, not frames. */
const OF_COMMANDS = ["mute_control", "heartbeat_loss"];
/** Parameters of a rule, where the daemon does not describe them; the keys of [[gige.faults]]. */
const PARAMETERS = [{name: "percent", unit: "%", default: 100, help: "Share of packets, frames or commands that are struck"},
                    {name: "first", default: 1, help: "First frame, or command"}, {name: "last", default: 0, help: "Last one; 0: no end"},
                    {name: "every", default: 1, help: "Only every so many"}, {name: "burst_packets", default: 1, help: "Packets in a row"},
                    {name: "amount", default: 1, help: "delay, wrong_timestamp: us; wrong_block_id: how far off"}];

const ORIGINS = {configuration: "the configuration", call: "an operator", feature: "a GigE Vision client"};

const told = ({struck, origin, ...rule}) => rule;
const isWindowed = (rule) => !OF_COMMANDS.includes(rule.kind) && (rule.last > 0 || rule.first > 1);
/** A rule without what is as by default, and without its window of frames. */
const text = (rule, parameters) => parameters.filter((p) => rule[p.name] !== undefined && rule[p.name] !== p.default && rule[p.name] !== Number(p.default) && p.name !== "seed"
    && !(isWindowed(rule) && (p.name === "first" || p.name === "last")))
  .map((p) => `${words(p.name)} ${figure(rule[p.name])}${p.unit ? ` ${p.unit}` : ""}`).join(", ") || "always";

/** Frames that a rule waits for or has left; `frame`: number of the newest one. */
function windowOf(rule, frame) {
  if (!isWindowed(rule)) return OF_COMMANDS.includes(rule.kind) ? "until disarmed" : "all frames";
  const range = rule.last > 0 ? `frames ${count(rule.first)} to ${count(rule.last)}` : `from frame ${count(rule.first)} on`;
  if (frame === undefined) return range;
  if (frame < rule.first) return `${range}, begins in ${count(rule.first - frame)}`;
  return rule.last > 0 ? `${range}, ${rule.last > frame ? `${count(rule.last - frame)} to come` : "over"}` : range;
}

export function useFaults(camera) {
  // A camera without GigE Vision has none.
  return useRepeated(() => askJson(cameraPath(camera.id, "faults")), PERIOD_MS, camera?.state.transports?.gige ? camera.id : undefined);
}

/** Rules that may still strike. */
export const strikingOf = (faults) => faults.rules.filter((rule) => !(isWindowed(rule) && rule.last > 0 && faults.frame > rule.last));

export function Faults({camera, may, faults}) {
  const {value, error, again} = faults;
  const command = useCommand();
  const [draft, setDraft] = useState({kind: "lose", percent: 1}), [limited, setLimited] = useState(false), [frames, setFrames] = useState(FRAMES);
  const rules = value?.rules ?? [], kinds = value?.kinds ?? [], frame = value?.frame;
  const parameters = value?.parameters?.filter((p) => p.name !== "kind") ?? PARAMETERS;
  const put = (wanted, line) => command.run(async () => {
    await askJson(cameraPath(camera.id, "faults"), {method: "PUT", body: {rules: wanted}});
    again();
    return line;
  });
  /** The rule within the next frames, if that is wished and the rule counts frames. */
  const within = (rule) => limited && frame !== undefined && !OF_COMMANDS.includes(rule.kind) ? {...rule, first: frame + 1, last: frame + Math.max(1, Math.round(frames))} : rule;
  const arm = (rule) => {
    const wanted = within(rule);
    return put([...rules.map(told), wanted], `Armed: ${words(rule.kind)}${wanted.last ? ` in frames ${count(wanted.first)} to ${count(wanted.last)}` : ""}.`);
  };
  // "rules[2].percent": of the rule that was to be armed.
  const refused = command.bad && command.field.startsWith(`rules[${rules.length}].`) ? command.field.split(".").at(-1) : "";
  if (!value) return html`<div class="screen"><section class="panel"><h2>Faults</h2>${camera.state.transports?.gige ? html`<${Note} error=${error}>Waiting for the daemon ...<//>` : html`<${Note}>Faults strike the GigE Vision stream, which this camera does not have: set gige.enabled.<//>`}</section></div>`;
  return html`<div class="screen">
    <section class="panel" aria-labelledby="x-rules"><h2 id="x-rules">Armed</h2>
      ${rules.length ? html`<table class="grid"><thead><tr><th scope="col">fault</th><th scope="col">when</th><th scope="col">frames</th><th scope="col">seed</th><th scope="col">armed by</th><th scope="col" class="number">struck</th><td></td></tr></thead>
        <tbody>${rules.map((rule, k) => html`<tr key=${k}><th scope="row">${words(rule.kind)}</th><td>${text(rule, parameters)}</td><td>${windowOf(rule, frame)}</td><td>${rule.seed || "of the daemon"}</td><td>${ORIGINS[rule.origin] ?? rule.origin ?? "–"}</td><td class="number">${count(rule.struck ?? 0)}</td>
          <td class="number">${may.operate && html`<button disabled=${command.busy} onClick=${() => put(rules.filter((_, j) => j !== k).map(told), "Disarmed.")} aria-label=${`disarm ${words(rule.kind)}`}>disarm</button>`}</td></tr>`)}</tbody></table>`
        : html`<p>No fault is armed.</p>`}
      ${frame !== undefined && html`<p class="small">Newest frame of the stream: ${frame ? count(frame) : "none yet"}. Frames are counted from the opening of the stream on; the same seed strikes the same packets in every run.</p>`}
      ${may.operate && html`<div class="buttons"><button class="danger" disabled=${command.busy || !rules.length} onClick=${() => put([], "All disarmed.")}>disarm all</button></div>`}
      <${Said} of=${command} /></section>
    ${may.operate ? html`<section class="panel" aria-labelledby="x-templates"><h2 id="x-templates">Arm</h2>
        <fieldset class="buttons wrap"><legend>Holds</legend>
          <label><input type="radio" name="holds" checked=${!limited} onChange=${() => setLimited(false)} /> until it is disarmed</label>
          <label><input type="radio" name="holds" checked=${limited} disabled=${frame === undefined} onChange=${() => setLimited(true)} /> for the next</label>
          <label><input id="fault-frames" type="number" min="1" step="1" value=${frames} disabled=${!limited} onInput=${(e) => setFrames(Number(e.target.value))} aria-label="number of frames" /> frames</label></fieldset>
        <h3>Templates</h3>
        <div class="buttons wrap">${TEMPLATES.filter((t) => !kinds.length || kinds.some((k) => k.name === t.rule.kind)).map((t) => html`<button key=${t.title} disabled=${command.busy} onClick=${() => arm(t.rule)}>${t.title}</button>`)}</div>
        <h3>A rule of your own</h3>
        <form onSubmit=${(e) => { e.preventDefault(); arm(draft); }}><div class="form">
          <label>fault <select value=${draft.kind} onChange=${(e) => setDraft({kind: e.target.value})}>${kinds.map((k) => html`<option key=${k.name} value=${k.name}>${words(k.name)}</option>`)}</select></label>
          ${parameters.filter((p) => !limited || OF_COMMANDS.includes(draft.kind) || (p.name !== "first" && p.name !== "last")).map((p) => html`<label key=${p.name} title=${p.help} class=${refused === p.name ? "refused-field" : ""}>${p.name === "percent" ? "share" : words(p.name)}${p.unit ? `, ${p.unit}` : ""}
            <input type="number" step="any" value=${draft[p.name] ?? Number(p.default ?? 0)} onInput=${(e) => setDraft({...draft, [p.name]: e.target.value === "" ? undefined : Number(e.target.value)})} /></label>`)}</div>
          ${refused && html`<p class="refused">${command.said}</p>`}
          <p class="small">${kinds.find((k) => k.name === draft.kind)?.help ?? ""}</p>
          <div class="buttons"><button type="submit" disabled=${command.busy || !kinds.length}>arm</button></div></form>
        <details><summary>What the fields mean</summary><table class="grid"><tbody>${parameters.filter((p) => p.help).map((p) => html`<tr key=${p.name}><th scope="row">${p.name === "percent" ? "share" : words(p.name)}</th><td>${p.help}</td></tr>`)}</tbody></table></details></section>`
      : html`<section class="panel"><p class="note">Your role only looks: an operator's link can arm and disarm.</p></section>`}
  </div>`;
}
