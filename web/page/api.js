// SPDX-License-Identifier: Apache-2.0
// Requests to obscura-web: bearer token, JSON, refusals as one line, repeated questions of a visible page.
import {useCallback, useEffect, useRef, useState} from "./vendor/preact-htm.js";

/** Token of the link, kept for this tab; the link itself then loses it. */
function takeToken() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given) {
    sessionStorage.setItem("token", given);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem("token") ?? "";
}
export const token = takeToken();

/** Refusal of a request. `message` is one line for the operator; `field`: what of the request is wrong, if that is known; `status` 0: no
 *  answer at all. */
export class Refused extends Error {
  constructor(status, message, field = "") {
    super(message);
    this.status = status;
    this.field = field;
  }
}

/** Line for a refused request. */
function why(status, detail) {
  if (status === 401 || status === 429)
    return token ? "This token is not known: ask for a new link." : "A token is wanted: use the link that obscura-web prints.";
  if (status === 403) return `Not allowed for your role: ${detail}`;
  if (status === 404 && /paths (are|stand)/.test(detail)) return "This obscura-web does not have that yet: a later version is wanted.";
  if (/^no call "/.test(detail)) return "This daemon does not answer that yet: a later version is wanted.";
  if (status === 503 && !detail) return "This daemon takes no calls: set control.unix_socket in its configuration.";
  return detail || `obscura-web answers ${status}`;
}

/** "#/rules/1/percent" as "rules[1].percent". */
const fieldOf = (pointer) => pointer.replace(/^#\//, "").replace(/\/(\d+)/g, "[$1]").replaceAll("/", ".");

/** A refused token is not tried again: trying on would count as guessing. */
let refused = null;

/** The Response of a good answer; throws Refused. `body`: sent as JSON. */
export async function ask(path, {method = "GET", body} = {}) {
  if (refused) throw refused;
  const headers = {Authorization: `Bearer ${token}`};
  if (body !== undefined) headers["Content-Type"] = "application/json";
  let answer;
  try {
    answer = await fetch(path, {method, headers, body: body === undefined ? undefined : JSON.stringify(body)});
  } catch {
    throw new Refused(0, "obscura-web does not answer.");
  }
  if (answer.ok) return answer;
  let detail = "", field = "";
  try {
    const problem = await answer.json();
    detail = problem.detail || problem.title || "";
    field = fieldOf(problem.errors?.[0]?.pointer ?? "");
  } catch { /* a proxy's page, perhaps */ }
  const error = new Refused(answer.status, why(answer.status, detail), field);
  if (answer.status === 401 || answer.status === 429) refused = error;
  throw error;
}
export const askJson = async (path, options) => {
  const answer = await ask(path, options);
  return answer.status === 204 ? {} : answer.json();
};

export const cameraPath = (id, rest) => `api/v1/cameras/${encodeURIComponent(id)}/${rest}`;

const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const visible = () => document.hidden ? new Promise((done) => document.addEventListener("visibilitychange", done, {once: true})) : null;

/** Asks `work` every `ms` while the page is visible and the component is there: {value, error, again}; 0: until there is an answer. `key`:
 *  what the question depends on; undefined: nothing is asked. After a refusal it asks again after at least five seconds. */
export function useRepeated(work, ms, key) {
  const [state, setState] = useState({value: undefined, error: null, key});
  const latest = useRef(work), wake = useRef(null);
  latest.current = work;
  useEffect(() => {
    if (key === undefined) return undefined;
    let on = true;
    (async () => {
      while (on) {
        await visible();
        let wait = ms;
        try {
          const value = await latest.current();
          if (on) setState({value, error: null, key});
          if (!ms) return;
        } catch (error) {
          if (on) setState((before) => ({value: before.key === key ? before.value : undefined, error, key}));
          if (error.status === 401 || error.status === 429) return;
          wait = Math.max(ms, error.status ? 5000 : 2000);
        }
        await Promise.race([pause(wait), new Promise((done) => { wake.current = done; })]);
      }
    })();
    return () => { on = false; wake.current?.(); };
  }, [key, ms]);
  const again = useCallback(() => wake.current?.(), []);
  return {value: state.key === key ? state.value : undefined, error: state.key === key ? state.error : null, again};
}

/** State of a command that the operator gives: {busy, said, bad, field, run}. `run(work)`: work answers with the line to show. */
export function useCommand() {
  const none = {busy: false, said: "", bad: false, field: ""};
  const [state, setState] = useState(none);
  const run = useCallback(async (work) => {
    setState({...none, busy: true});
    try {
      setState({...none, said: await work() ?? ""});
      return true;
    } catch (error) {
      setState({...none, said: error.message, bad: true, field: error.field ?? ""});
      return false;
    }
  }, []);
  return {...state, run};
}

/** Puts a text onto the clipboard. Pages of plain HTTP have no navigator.clipboard, others may lack the permission. */
export async function copy(text) {
  if (await navigator.clipboard?.writeText(text).then(() => true, () => false)) return;
  const field = document.createElement("textarea");
  field.value = text;
  document.body.append(field);
  field.select();
  const done = document.execCommand("copy");
  field.remove();
  if (!done) throw new Error(`This browser does not let the page copy: mark ${text} by hand.`);
}

/** Lets the browser save `blob` under `name`. */
export function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
