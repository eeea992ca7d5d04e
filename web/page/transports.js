// SPDX-License-Identifier: Apache-2.0
// Screen Transports: where frames go, whether they arrive, who controls the camera, and its further counters.
import {html} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand} from "./api.js";
import {count, figure, span, words} from "./format.js";
import {Confirmed, Copyable, Facts, Said} from "./parts.js";

const TITLES = {gige: "GigE Vision", v4l2: "V4L2", file: "Files", stimulator: "Optical stimulator", watch: "Frames for programs and this page"};
const BAD = ["dropped", "send errors", "control lost", "no node", "node lost", "busy", "failed", "device errors", "answers throttled", "events lost", "refused packets", "lost"];
/** Told in words above the counters. */
const IN_WORDS = ["stream_to", "controller_silent_s", "packet_bytes", "trouble", "node", "directory", "disk_free_bytes", "display"];

const gib = (bytes) => bytes >= 2 ** 30 ? `${figure(bytes / 2 ** 30, 4)} GiB` : `${figure(bytes / 2 ** 20, 4)} MiB`;
/** Counters in their order; frames without a receiver stand below those that were dropped, which they are among. */
const ordered = ({no_receiver: unheard, ...values}) => Object.entries(values).flatMap(([name, v]) =>
  name === "dropped" && unheard !== undefined ? [[name, v], ["no_receiver", unheard]] : [[name, v]]);
const rowsOf = (values) => ordered(values).filter(([name, v]) => (v === null || typeof v !== "object") && !IN_WORDS.includes(name))
  .map(([name, v]) => [name === "no_receiver" ? "of those, while no client received" : words(name), v === true ? "yes" : v === false ? "no" : name === "bytes" ? gib(v) : v]);

/** What a transport's counters come to, in a line or two: [good, text]. */
function verdictOf(kind, t, state) {
  const share = t.submitted > 0 ? `${count(t.delivered)} of ${count(t.submitted)} frames delivered` : "no frames yet";
  if (t.trouble) return [false, t.trouble];
  // A client that has not opened its stream costs frames, which is its choice.
  const lost = (t.dropped ?? 0) - (t.no_receiver ?? 0);
  if (kind === "stimulator" && t.display === "not found") return [false, "The display is not connected."];
  if (kind === "gige") {
    const sum = t.no_receiver === undefined ? share : `${t.stream_to ? "" : "No client receives. "}${count(t.delivered)} frames delivered${
      t.no_receiver > 0 ? `, ${count(t.no_receiver)} came while no client received` : ""}${lost > 0 ? `, ${count(lost)} dropped` : ""}`;
    const sent = t.packets > 0 && t.resent_packets > 0 ? `; ${figure(100 * t.resent_packets / t.packets, 3)} % of the packets sent again` : "";
    const gone = t.refused_packets > 0 ? `; ${count(t.refused_packets)} packets could not be sent again` : "";
    return [!(t.send_errors > 0 || t.refused_packets > 0 || (t.no_receiver !== undefined && lost > 0)), `${sum}${sent}${gone}.`];
  }
  return [!(t.dropped > 0) || kind === "watch" || t.submitted === 0, `${share}.`];
}

function GigeFacts({t, state}) {
  return html`<${Facts} label="Channels" rows=${[["address", html`<${Copyable} text=${state.address} what="the address" />`], ["controlled by", state.controller || "none"],
    ...(t.controller_silent_s !== undefined ? [["heard", `${figure(t.controller_silent_s, 2)} s ago`]] : []),
    ["stream to", t.stream_to ?? "none now"], ...(t.packet_bytes ? [["packet size", `${count(t.packet_bytes)} bytes`]] : [])]} />`;
}

function Release({camera, may}) {
  const command = useCommand(), {controller} = camera.state;
  if (!controller) return command.said ? html`<${Said} of=${command} />` : null;
  const release = () => command.run(async () => {
    const told = await askJson(cameraPath(camera.id, "release"), {method: "POST", body: {}});
    return told.controller ? `${told.controller} has lost control.` : "No client had control.";
  });
  return may.administer ? html`<div class="buttons"><${Confirmed} label="disconnect" question=${`Take control away from ${controller}? Its acquisition ends.`} disabled=${command.busy} onYes=${release} /><${Said} of=${command} /></div>`
    : html`<p class="small">An admin's link can take control away from it.</p>`;
}

const FACTS = {
  v4l2: (t) => [["node", t.node ?? "–"]],
  file: (t) => [["folder", t.directory ?? "–"], ["free on its disk", t.disk_free_bytes ? gib(t.disk_free_bytes) : "–"]],
  stimulator: (t) => [["display", t.display ?? "–"]],
};

function Transport({kind, t, camera, may}) {
  const [good, line] = verdictOf(kind, t, camera.state), title = TITLES[kind] ?? kind, facts = FACTS[kind]?.(t);
  const groups = Object.entries(t).filter(([, v]) => v !== null && typeof v === "object" && Object.keys(v).length);
  return html`<section class="panel" aria-labelledby=${`p-${kind}`}><h2 id=${`p-${kind}`}>${title}</h2>
    <p class=${good ? "" : "trouble"}><span aria-hidden="true">${good ? "✓" : "✗"} </span>${line}</p>
    ${kind === "gige" && html`<${GigeFacts} t=${t} state=${camera.state} /><${Release} camera=${camera} may=${may} />`}
    ${facts && html`<${Facts} label=${`${title}, place`} rows=${facts} />`}
    <details open=${kind === "gige" || !good}><summary>Counters since the start</summary><${Facts} label=${title} bad=${kind === "watch" ? [] : BAD.filter((name) => name !== "dropped" || t.dropped !== t.no_receiver)} rows=${rowsOf(t)} />
      ${groups.map(([name, group]) => name.endsWith("_us") ? html`<h3>${words(name.slice(0, -3))}</h3><${Facts} label=${words(name)} rows=${Object.entries(group).map(([of, us]) => [of, span(us || null)])} />` : Object.values(group).some((v) => v !== 0) ? html`<h3>${words(name)}</h3><${Facts} label=${words(name)} bad=${BAD} rows=${rowsOf(group).filter(([, v]) => v !== 0)} />`
        : html`<p class="small">${words(name)}: none</p>`)}</details></section>`;
}

export function Transports({camera, may}) {
  const {state} = camera, all = Object.entries(state.transports ?? {});
  return html`<div class="screen">
    ${state.address && state.address !== "none" ? html`<p class="small">The flight computer connects to <code>${state.address}</code>; <code>obscura grab</code> and any GigE Vision client do too.</p>`
      : html`<p class="small">This camera has no GigE Vision (gige.enabled): no client controls it over the network, and frames go where else it says below.</p>`}
    ${all.length === 0 && html`<section class="panel"><p class="note">This camera has no transport: frames go nowhere.</p></section>`}
    <div class="columns">${all.map(([kind, t]) => html`<${Transport} key=${kind} kind=${kind} t=${t} camera=${camera} may=${may} />`)}</div>
  </div>`;
}
