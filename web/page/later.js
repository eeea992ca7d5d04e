// SPDX-License-Identifier: Apache-2.0
// A screen that is loaded when it is opened.
import {html, useEffect, useState} from "./vendor/preact-htm.js";

/** The component `name` of the module that `load` answers with. */
export function Later({load, name, given}) {
  const [state, setState] = useState({});
  useEffect(() => { load().then((loaded) => setState({Screen: loaded[name]}), () => setState({why: "obscura-web does not answer: open the screen again."})); }, []);
  return state.Screen ? html`<${state.Screen} ...${given} />` : html`<p class="note" role="note">${state.why ?? "loading ..."}</p>`;
}
