// SPDX-License-Identifier: Apache-2.0
// The operator's page: top bar with the verdict, screens, theme. What it shows is asked for twice a second.
import {html, render, useEffect, useLayoutEffect, useRef, useState} from "./vendor/preact-htm.js";
import {askJson, cameraPath, useCommand, useRepeated} from "./api.js";
import {CameraScreen, fireSoftwareTrigger, triggerOf} from "./camera.js";
import {Faults, strikingOf, useFaults} from "./faults.js";
import {figure} from "./format.js";
import {Later} from "./later.js";
import {Live} from "./live.js";
import {nameCellsWhenNarrow} from "./narrow.js";
import {Said} from "./parts.js";
import {Scene} from "./scene.js";
import {System} from "./system.js";
import {Timing} from "./timing.js";
import {Transports} from "./transports.js";

const STATE_MS = 500, ROLE_MS = 60000, STALE_S = 3;
const SCREENS = [["live", "Live", Live], ["timing", "Timing", Timing], ["camera", "Camera", CameraScreen], ["scene", "Scene", Scene],
                 ["faults", "Faults", Faults], ["transports", "Transports", Transports], ["system", "System", System], ["models", "Models", Models]];
/** The editor is large, and loaded when it is opened. */
function Models(given) { return html`<${Later} load=${() => import("./models.js")} name="Models" given=${given} />`; }
const SIGNS = {good: "✓", bad: "✗", idle: "–"};

/** Cameras of all daemons: {id, number, name, state, daemon}. */
function camerasOf(state) {
  return (state?.daemons ?? []).flatMap((daemon) => daemon.cameras.map((camera, number) => ({
    id: camera.id ?? `${daemon.daemon.pid}-${number}`, number, state: camera, daemon,
    name: `camera ${number}${(state.daemons.length > 1 ? ` of ${daemon.daemon.config}` : "")}`})));
}

/** What the role may do; a server that does not tell roles only shows. */
function rightsOf(role) {
  const operate = role === "operator" || role === "admin";
  return {operate, scene: operate, administer: role === "admin"};
}

function useHash() {
  const [hash, setHash] = useState(location.hash.slice(1));
  useLayoutEffect(() => { // a change right after the first screen is there counts
    const changed = () => setHash(location.hash.slice(1));
    addEventListener("hashchange", changed);
    return () => removeEventListener("hashchange", changed);
  }, []);
  return hash;
}

function Theme() {
  const [theme, setTheme] = useState(localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark"));
  useEffect(() => { document.documentElement.dataset.theme = theme; }, [theme]);
  const choose = (name) => { localStorage.setItem("theme", name); setTheme(name); };
  return html`<label class="theme">Theme <select id="theme" value=${theme} onChange=${(e) => choose(e.target.value)}>
    <option value="dark">dark</option><option value="light">light</option><option value="red">red</option></select></label>`;
}

/** Faults that the configuration or the operator has armed, where the daemon counts their strikes. */
const armedOf = (camera, faults) => faults.value ? strikingOf(faults.value).length : Object.keys(camera.state.transports?.gige?.fault_strikes ?? {}).filter((name) => name.startsWith("rule_")).length;

function Item({name, children, bad}) {
  return html`<div class=${`item${bad ? " bad-item" : ""}`}><dt>${name}</dt><dd>${children}</dd></div>`;
}

/** `trigger`: the command of its button, whose answer stands beside the screens' names: the bar keeps its height. */
function Bar({camera, cameras, choose, role, may, faults, trouble, trigger}) {
  const change = useCommand();
  const acquire = (running) => change.run(() => askJson(cameraPath(camera.id, "acquisition"), {method: "POST", body: {running}}).then(() => ""));
  const s = camera?.state, armed = camera ? armedOf(camera, faults) : 0, recent = s?.recent;
  const rate = recent?.seconds > 0 ? `${figure(recent.complete / recent.seconds, 3)} Hz` : "–";
  return html`<header class="bar"><div class="first"><h1>Obscura</h1>
      ${cameras.length > 1 && html`<label>Camera <select id="which" value=${camera?.id} onChange=${(e) => choose(e.target.value)}>${
        cameras.map((one) => html`<option key=${one.id} value=${one.id}>${one.name}</option>`)}</select></label>`}
      <p id="verdict" role="status" title=${s?.verdict.health === "bad" ? "Timing tells more (key 2)" : undefined} class=${`verdict ${trouble ? "bad" : s?.verdict.health ?? "idle"}`}>${
        trouble ? html`<span aria-hidden="true">${SIGNS.bad} </span>${trouble}` : html`<span aria-hidden="true">${SIGNS[s?.verdict.health] ?? "–"} </span>${s ? (s.verdict.health === "bad" ? "NOT GOOD: " : "") + s.verdict.text : "asking ..."}`}</p>
      <${Theme} /></div>
    ${s && html`<dl class="items"><${Item} name="frame">${String(s.frame_id)}<//><${Item} name="rate">${rate}<//>
      <${Item} name="trigger">${triggerOf(s)}${may.operate && s.acquiring && triggerOf(s) === "Software" && html` <button class="mini" disabled=${trigger.busy} onClick=${() => trigger.run(() => fireSoftwareTrigger(camera))} aria-label="fire the software trigger">fire</button>`}<//>
      <${Item} name="clock">${s.clock.state}<//><${Item} name="acquisition">${s.acquiring ? "runs" : "stopped"}${may.operate && html` <button class="mini" disabled=${change.busy} title=${change.said} onClick=${() => acquire(!s.acquiring)} aria-label=${`${s.acquiring ? "stop" : "start"} the acquisition`}>${s.acquiring ? "stop" : "start"}</button>`}<//>
      <${Item} name="controlled by">${s.controller || "none"}<//>
      <${Item} name="faults" bad=${armed > 0}>${armed ? `${armed} ARMED` : "none"}<//><${Item} name="your role">${role ?? "viewer"}<//></dl>`}
    ${change.bad && html`<${Said} of=${change} />`}</header>`;
}

/** What to do where no daemon answers. */
function NoCamera({why}) {
  return html`<section class="panel" aria-labelledby="n-why"><h2 id="n-why">No daemon answers on this machine</h2><p>${why}</p>
    <p>Why it has ended, or does not start: <code>systemctl status obscurad</code> and <code>journalctl -u obscurad</code>. A mistake in its configuration is a line with file and place: <code>obscura check /etc/obscura/obscurad.toml</code>.
      A daemon of your own: <code>obscurad --config FILE</code>.</p>
    <p>This page looks on, and shows the camera as soon as it is there.</p></section>`;
}

function App() {
  const state = useRepeated(() => askJson("api/v1/state"), STATE_MS, "state");
  const me = useRepeated(() => askJson("api/v1/me"), ROLE_MS, state.value ? "me" : undefined);
  const [chosen, setChosen] = useState("");
  const cameras = camerasOf(state.value), camera = cameras.find((one) => one.id === chosen) ?? cameras[0];
  const faults = useFaults(camera);
  const hash = useHash(), trigger = useCommand();
  const [name, , Screen] = SCREENS.find(([one]) => one === hash) ?? SCREENS[0];
  const may = rightsOf(me.value?.role);
  const fresh = async () => camerasOf(await askJson("api/v1/state")).find((one) => one.id === camera.id) ?? camera;
  useLayoutEffect(() => { // keys work as soon as the screen is there
    const onKey = (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
      const number = Number(event.key);
      if (number >= 1 && number <= SCREENS.length) location.hash = SCREENS[number - 1][0];
    };
    addEventListener("keydown", onKey);
    return () => removeEventListener("keydown", onKey);
  }, []);
  const age = state.value?.age_s, cameraSeen = useRef(false);
  if (cameras.length) cameraSeen.current = true;
  const starting = (state.value?.daemons ?? []).map((daemon) => daemon.daemon.starting?.text).find(Boolean);
  const trouble = state.error ? state.error.message
    : starting && !cameras.length ? starting
    : state.value && !cameras.length ? (cameraSeen.current ? "The camera has gone: obscurad does not answer any more." : "No camera: obscurad does not answer.")
    : age > STALE_S ? `The cameras have not answered for ${Math.round(age)} s.` : "";
  return html`<${Bar} camera=${camera} cameras=${cameras} choose=${setChosen} role=${me.value?.role} may=${may} faults=${faults} trouble=${trouble} trigger=${trigger} />
    <nav aria-label="Screens">${SCREENS.map(([key, title], k) => html`<a key=${key} href=${`#${key}`} aria-current=${key === name ? "page" : undefined} title=${`key ${k + 1}`}>${title}</a>`)}
      <span class=${`nav-said small${trigger.bad ? " trouble" : ""}`} role="status">${trigger.said}</span></nav>
    <main id="main">${camera && !state.error && html`<${Screen} key=${camera.id} camera=${camera} fresh=${fresh} daemon=${camera.daemon} may=${may} faults=${faults} web=${state.value.web} bounds=${state.value.web.latency_bounds_us} />`}
      ${state.value && !state.error && !camera && !starting && html`<${NoCamera} why=${state.value.error} />`}
      ${state.error?.status === 0 && html`<section class="panel"><p>The page goes on by itself once obscura-web answers again: <code>systemctl status obscura-web</code>, or start it as before. A link whose token was made for one run asks for the new link.</p></section>`}</main>`;
}

render(html`<${App} />`, document.getElementById("app"));
nameCellsWhenNarrow();
