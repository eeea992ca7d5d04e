// SPDX-License-Identifier: Apache-2.0
// The operator's page: what the daemons of this machine said last, twice a second, and their log.

const PERIOD_MS = 500, MOST_LINES = 400;
/** Upper ends of the histograms' buckets, us. */
let boundsUs = [];
const SVG = "http://www.w3.org/2000/svg";

/** Token of the link, kept for this tab; the link itself then loses it. */
function takeToken() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given) {
    sessionStorage.setItem("token", given);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem("token") ?? "";
}
const token = takeToken();
/** Whether the token was refused: asking on would only count as guessing. */
let refused = false;

const ask = (path, options = {}) => fetch(path, {...options, headers: {Authorization: `Bearer ${token}`}});
const byId = (id) => document.getElementById(id);

/** Element with attributes and children; texts stay texts. */
function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}
function draw(name, attributes, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

function span(us) {
  if (us === undefined || us === null) return "-";
  if (us < 1e3) return `${+us.toPrecision(3)} us`;
  if (us < 1e6) return `${+(us / 1e3).toPrecision(3)} ms`;
  return `${+(us / 1e6).toPrecision(3)} s`;
}
function duration(s) {
  const minutes = Math.floor(s / 60), hours = Math.floor(minutes / 60), days = Math.floor(hours / 24);
  if (days) return `${days} d ${hours % 24} h`;
  if (hours) return `${hours} h ${minutes % 60} min`;
  return minutes ? `${minutes} min ${Math.floor(s % 60)} s` : `${Math.floor(s)} s`;
}

/** Rows of names and numbers; those named in `bad` stand out where they are not 0. */
function table(rows, bad = []) {
  const body = make("tbody");
  for (const [name, value] of rows) {
    const stands = bad.includes(name) && value > 0;
    body.append(make("tr", {}, make("th", {scope: "row"}, name),
                     make("td", {class: `number${stands ? " bad-number" : ""}`}, String(value))));
  }
  return make("table", {}, body);
}

/** Spans of a histogram; its table of quantiles stands beside it. */
function histogram(title, figures) {
  const counts = figures.up_to.map((n, k) => n - (k ? figures.up_to[k - 1] : 0));
  counts.push(figures.count - figures.up_to.at(-1));
  const most = Math.log1p(Math.max(1, ...counts));
  const svg = draw("svg", {viewBox: "0 0 420 92", role: "img",
                           "aria-label": `${title}: median ${span(figures.p50)}, 99 % below ${span(figures.p99)}, largest ${span(figures.max)}`});
  svg.append(draw("line", {x1: 0, y1: 76, x2: 420, y2: 76}));
  counts.forEach((n, k) => {
    const height = 66 * Math.log1p(n) / most;
    const bar = draw("rect", {x: k * 21 + 2, y: 76 - height, width: 17, height});
    bar.append(draw("title", {}, `${n} up to ${k < boundsUs.length ? span(boundsUs[k]) : "more"}`));
    svg.append(bar);
    if (k % 3 === 0 && k < boundsUs.length) svg.append(draw("text", {x: k * 21 + 10, y: 88, "text-anchor": "middle"}, span(boundsUs[k])));
  });
  return make("figure", {}, make("h3", {}, title), svg,
              make("figcaption", {}, `p50 ${span(figures.p50)}, p99 ${span(figures.p99)}, max ${span(figures.max)} (${figures.count}; bars: logarithm)`));
}

function camera(state, number) {
  const c = state.camera, columns = make("div", {class: "columns"});
  columns.append(
    make("div", {}, make("h3", {}, "Camera"), table([
      ["address", state.address], ["controlled by", state.controller || "nobody"], ["acquisition", state.acquiring ? "runs" : "stopped"],
      ["trigger", `${state.clock.source}, clock ${state.clock.state}`], ["trigger ready", state.trigger_ready ? "yes" : "no"],
      ["last frame", state.frame_id]])),
    make("div", {}, make("h3", {}, "Since the start"), table([
      ["triggers", c.triggers], ["frames complete", c.complete], ["missed triggers", c.missed_triggers], ["dropped", c.dropped],
      ["abandoned", c.abandoned], ["late frames", c.late], ["late rows", c.late_rows], ["stalled rows", c.stalled_rows],
      ["degraded frames", c.quality.degraded]],
      ["missed triggers", "dropped", "abandoned", "late frames", "late rows", "stalled rows"])),
    make("div", {}, make("h3", {}, "Missed triggers by reason"),
         table(Object.entries(c.missed_because).map(([reason, n]) => [reason.replace("_", " "), n])),
         make("h3", {}, "Transports"),
         table(Object.entries(state.transports).map(([kind, t]) => [kind, `${t.delivered} delivered, ${t.dropped} dropped`]))));
  for (const [name, title] of [["trigger_to_first_row", "Trigger to first row"], ["trigger_to_last_row", "Trigger to last row"],
                               ["release_lateness", "Release lateness"]])
    if (state.latency_us[name]?.up_to) columns.append(histogram(title, state.latency_us[name]));
  return make("section", {}, make("h2", {}, `Camera ${number}`),
              make("p", {class: `verdict ${state.verdict.health}`}, (state.verdict.health === "bad" ? "NOT GOOD: " : "") + state.verdict.text),
              columns);
}

function daemon(state) {
  const d = state.daemon;
  return make("article", {}, make("p", {}, `obscurad ${d.version}, process ${d.pid}, up ${duration(d.up_s)}, ${Math.round(d.resident_mib)} MiB, ${d.config}`),
              ...state.cameras.map(camera));
}

function say(text, bad) {
  const line = byId("link");
  line.className = bad ? "bad" : "";
  if (line.textContent !== text) line.textContent = text;
}

async function refresh() {
  try {
    const answer = await ask("api/v1/state");
    if (answer.status === 401 || answer.status === 429) {
      say(token ? "This token is not known: ask for a new link." : "A token is wanted: use the link that obscura-web prints.", true);
      refused = true;
      return 0;
    }
    if (!answer.ok) throw new Error((await answer.json()).detail);
    const state = await answer.json();
    if (state.daemons.length === 0) say(`No camera: ${state.error}`, true);
    else if (state.age_s > 3) say(`The cameras have not answered for ${Math.round(state.age_s)} s.`, true);
    else say(`${state.daemons.length} daemon${state.daemons.length > 1 ? "s" : ""} on this machine`, false);
    boundsUs = state.web.latency_bounds_us;
    byId("daemons").replaceChildren(...state.daemons.map(daemon));
  } catch (error) {
    say(`obscura-web does not answer: ${error.message}`, true);
    return 2000;
  }
  return PERIOD_MS;
}

let lastEvent = 0;
function addEvent(event) {
  const rows = byId("log").tBodies[0];
  rows.prepend(make("tr", {class: event.level}, make("td", {}, event.utc.replace("T", " ").replace("Z", "")), make("td", {}, event.level), make("td", {}, event.text)));
  while (rows.rows.length > MOST_LINES) rows.lastElementChild.remove();
  lastEvent = event.id;
  filterLog();
}
function filterLog() {
  const all = byId("level").value === "info";
  for (const row of byId("log").tBodies[0].rows) row.hidden = !all && row.className !== "warning" && row.className !== "error";
}

/** Follows the log by a stream, which is opened again when it ends. A hidden page follows nothing. */
async function follow() {
  const answer = await ask(`api/v1/events?after=${lastEvent}`);
  if (!answer.ok) throw new Error(String(answer.status));
  const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
  for (let text = ""; ;) {
    const {value, done} = await reader.read();
    if (done) return;
    text += value;
    for (let end; (end = text.indexOf("\n\n")) >= 0; text = text.slice(end + 2)) {
      const data = text.slice(0, end).split("\n").find((line) => line.startsWith("data: "));
      if (data) addEvent(JSON.parse(data.slice(6)));
    }
  }
}

const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const visible = () => document.hidden ? new Promise((done) => document.addEventListener("visibilitychange", done, {once: true})) : null;

const theme = byId("theme");
theme.value = localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark");
const dress = () => { document.documentElement.dataset.theme = theme.value; localStorage.setItem("theme", theme.value); };
theme.addEventListener("change", dress);
dress();
byId("level").addEventListener("change", filterLog);

(async () => { while (!refused) { await visible(); await pause(await refresh()); } })();
(async () => { while (!refused) { try { await follow(); } catch { /* the state says why */ } await pause(2000); } })();
