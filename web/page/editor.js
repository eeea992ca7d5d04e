// SPDX-License-Identifier: Apache-2.0
// Editor of a model's text: colours of the language, findings at their lines. Its parts lie in a shadow root, whose style sheets the security
// policy of the page allows.
import * as cm from "./vendor/codemirror.js";

/** Colours of SuMoL. `words`: of model.list. */
function languageOf(words) {
  const kinds = new Map();
  for (const [name, kind] of [["keywords", "keyword"], ["functions", "builtin"], ["constants", "atom"]])
    for (const word of words?.[name] ?? []) kinds.set(word, /^(scalar|vec\d|texture|void)$/.test(word) ? "type" : kind);
  return cm.StreamLanguage.define({
    name: "sumol",
    startState: () => ({comment: false}),
    token(stream, state) {
      if (state.comment || stream.match("/*")) {
        state.comment = !stream.match(/^.*?\*\//);
        if (state.comment) stream.skipToEnd();
        return "comment";
      }
      if (stream.eatSpace()) return null;
      if (stream.match("//!")) { stream.skipToEnd(); return "meta"; }
      if (stream.match("//")) { stream.skipToEnd(); return "comment"; }
      if (stream.match(/^(0[xX][0-9a-fA-F]+|(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)/)) return "number";
      const word = stream.match(/^[A-Za-z_]\w*/);
      if (word) return kinds.get(word[0]) ?? null;
      stream.next();
      return null;
    },
    indent: (state, after, context) => {
      const line = context.lineAt(context.pos, -1), opens = (line.text.match(/[{(]/g) ?? []).length - (line.text.match(/[})]/g) ?? []).length;
      return Math.max(0, line.text.search(/\S|$/) + (opens > 0 ? 4 : 0) - (/^\s*[})]/.test(after) ? 4 : 0));
    },
    languageData: {commentTokens: {line: "//", block: {open: "/*", close: "*/"}}},
  });
}

const colours = cm.HighlightStyle.define([
  {tag: cm.tags.keyword, color: "var(--bar)", fontWeight: "600"}, {tag: cm.tags.typeName, color: "var(--line-5)"},
  {tag: cm.tags.standard(cm.tags.variableName), color: "var(--line-4)"}, {tag: cm.tags.atom, color: "var(--mark)"}, {tag: cm.tags.number, color: "var(--mark)"},
  {tag: cm.tags.comment, color: "var(--faint)"}, {tag: cm.tags.meta, color: "var(--good)"}]);

const looks = cm.EditorView.theme({
  "&": {color: "var(--text)", backgroundColor: "var(--deep)", fontSize: "13px", maxHeight: "65vh"},
  ".cm-scroller": {fontFamily: "ui-monospace, monospace", overflow: "auto"},
  ".cm-content": {caretColor: "var(--text)"}, ".cm-cursor": {borderLeftColor: "var(--text)"},
  ".cm-gutters": {backgroundColor: "var(--panel)", color: "var(--faint)", border: "none"},
  ".cm-activeLine, .cm-activeLineGutter": {backgroundColor: "color-mix(in srgb, var(--line) 25%, transparent)"},
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": {background: "color-mix(in srgb, var(--bar) 40%, transparent) !important"},
  ".cm-tooltip": {backgroundColor: "var(--panel)", color: "var(--text)", border: "1px solid var(--line)"},
  ".cm-diagnostic-error": {borderLeftColor: "var(--bad)"}, ".cm-diagnostic-warning": {borderLeftColor: "var(--mark)"},
  ".cm-lintRange-error": {backgroundImage: "none", textDecoration: "underline wavy var(--bad)"},
  ".cm-lintRange-warning": {backgroundImage: "none", textDecoration: "underline wavy var(--mark)"},
  ".cm-lint-marker": {content: "none", width: "0.8em", height: "0.8em", borderRadius: "50%"},
  ".cm-lint-marker-error": {backgroundColor: "var(--bad)"}, ".cm-lint-marker-warning": {backgroundColor: "var(--mark)"}});

/** Offset of a place; columns count bytes of UTF-8. */
function offsetOf(doc, {line, column}) {
  const at = doc.line(Math.min(Math.max(line, 1), doc.lines));
  let bytes = 1, offset = 0;
  for (const letter of at.text) {
    if (bytes >= column) break;
    bytes += new TextEncoder().encode(letter).length;
    offset += letter.length;
  }
  return at.from + offset;
}

/** Replaces a selection by what is typed. Left to the browser, it keeps the look of the text by inline styles, which the policy forbids. */
const replacing = cm.EditorView.domEventHandlers({beforeinput: (event, view) => {
  if (event.inputType !== "insertText" || event.data === null || view.composing || view.state.selection.ranges.every((range) => range.empty)) return false;
  event.preventDefault();
  view.dispatch(view.state.replaceSelection(event.data), {userEvent: "input.type", scrollIntoView: true});
  return true;
}});

/** An editor in `host`: {text, setText, setFindings, goTo, destroy}. `changed` is called with each text that is typed. */
export function makeEditor(host, {text, words, label, changed}) {
  const root = host.shadowRoot ?? host.attachShadow({mode: "open"});
  const state = (doc) => cm.EditorState.create({doc, extensions: [
    cm.lineNumbers(), cm.lintGutter(), cm.highlightSpecialChars(), cm.history(), cm.drawSelection(), cm.indentOnInput(), cm.bracketMatching(), cm.highlightActiveLine(),
    cm.highlightActiveLineGutter(), cm.EditorState.tabSize.of(4), cm.indentUnit.of("    "), languageOf(words), replacing, cm.syntaxHighlighting(colours), looks,
    cm.keymap.of([...cm.defaultKeymap, ...cm.historyKeymap, ...cm.lintKeymap]), // the tabulator goes on to the next control
    cm.EditorView.contentAttributes.of({"aria-label": label, spellcheck: "false"}),
    cm.EditorView.updateListener.of((update) => { if (update.docChanged) changed(update.state.doc.toString()); })]});
  const view = new cm.EditorView({state: state(text), parent: root, root});
  const keys = (event) => event.stopPropagation(); // digits are no screens
  host.addEventListener("keydown", keys);
  return {
    text: () => view.state.doc.toString(),
    setText: (next) => view.setState(state(next)),
    setFindings: (findings) => view.dispatch(cm.setDiagnostics(view.state, findings.map((f) => {
      const from = offsetOf(view.state.doc, f), word = /^\w+/.exec(view.state.doc.sliceString(from, from + 64));
      return {from, to: Math.min(view.state.doc.length, from + (word?.[0].length ?? 1)), severity: f.severity, message: f.what};
    }))),
    goTo: (place) => {
      const at = offsetOf(view.state.doc, place);
      view.dispatch({selection: {anchor: at}, effects: cm.EditorView.scrollIntoView(at, {y: "center"})});
      view.focus();
    },
    destroy: () => { host.removeEventListener("keydown", keys); view.destroy(); },
  };
}
