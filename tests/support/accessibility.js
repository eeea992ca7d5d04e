// SPDX-License-Identifier: Apache-2.0
// Serious mistakes of a page towards those who do not see it, see little contrast, or have no mouse: rules of WCAG 2.1 AA that need no
// judgement. An expression: the list of [rule, element].
(() => {
  const found = [];
  const told = (rule, element, more = "") => found.push([rule, `${element.outerHTML?.slice(0, 160) ?? element} ${more}`]);
  const all = (selector) => [...document.querySelectorAll(selector)];
  const shown = (e) => e.getClientRects().length > 0 && getComputedStyle(e).visibility !== "hidden" && !e.closest("[aria-hidden=true]");
  const referred = (e, name) => (e.getAttribute(name) ?? "").split(/\s+/).filter(Boolean).map((id) => document.getElementById(id));
  const textOf = (e) => e.cloneNode ? [...e.childNodes].map((n) => n.nodeType === 3 ? n.data : n.nodeType === 1 && n.getAttribute("aria-hidden") !== "true"
    ? n.getAttribute("aria-label") ?? n.getAttribute("alt") ?? textOf(n) : "").join(" ").trim() : "";
  const nameOf = (e) => referred(e, "aria-labelledby").map((r) => r ? textOf(r) : "").join(" ").trim() || (e.getAttribute("aria-label") ?? "").trim() ||
    [...(e.labels ?? [])].map(textOf).join(" ").trim() || (/^(A|BUTTON|SUMMARY)$/.test(e.tagName) ? textOf(e) : "") || (e.getAttribute("title") ?? "").trim();

  if (!document.documentElement.lang) told("the document has a language", document.documentElement);
  if (!document.title.trim()) told("the document has a title", document.documentElement);
  for (const landmark of ["main", "h1", "header", "nav"])
    if (all(landmark).filter(shown).length !== 1) told(`there is one ${landmark}`, document.body, all(landmark).length);
  const ids = new Set();
  for (const e of all("[id]")) ids.has(e.id) ? told("ids are unique", e) : ids.add(e.id);
  for (const name of ["aria-labelledby", "aria-describedby", "aria-controls", "for"])
    for (const e of all(`[${name}]`)) if (referred(e, name).includes(null)) told(`${name} names an element`, e);
  for (const e of all("a[href], button, input:not([type=hidden]), select, textarea, summary, [role=button], [role=img], canvas, svg:not([aria-hidden=true] svg)"))
    if (shown(e) && e.getAttribute("aria-hidden") !== "true" && !nameOf(e)) told("what can be used or seen has a name", e);
  for (const e of all("img")) if (!e.hasAttribute("alt")) told("images have a text", e);
  for (const e of all("[tabindex]")) if (e.tabIndex > 0) told("the order of the tabulator is that of the page", e);
  for (const e of all("[aria-hidden=true]"))
    if ([e, ...e.querySelectorAll("*")].some((x) => x.tabIndex >= 0 && shown(x))) told("what is hidden has no focus", e);
  for (const e of all("button, a[href], summary")) if (e.querySelector("a[href], button, input, select")) told("controls are not within each other", e);
  for (const e of all("table")) if (shown(e) && !e.querySelector("th")) told("tables have headings", e);
  for (const e of all("th")) if (!e.scope) told("headings of tables say of what", e);
  for (const e of all("dl > *")) if (!/^(DT|DD|DIV|TEMPLATE|SCRIPT)$/.test(e.tagName)) told("lists of terms have terms", e);
  for (const e of all("ul > *, ol > *")) if (!/^(LI|TEMPLATE|SCRIPT)$/.test(e.tagName)) told("lists have items", e);
  let level = 0;
  for (const e of all("h1, h2, h3, h4").filter(shown)) {
    if (Number(e.tagName[1]) > level + 1) told("headings skip no level", e);
    level = Number(e.tagName[1]);
  }
  // Chromium lets keys scroll any box; Firefox those without controls in them, too.
  for (const e of all("*"))
    if (shown(e) && e.scrollHeight > e.clientHeight + 2 && /auto|scroll/.test(getComputedStyle(e).overflowY) && e.tabIndex < 0 &&
        !CSS.supports("overflow", "auto")) told("boxes that scroll take the focus", e);

  // Contrast of text: 4.5 to 1, large text 3 to 1.
  const colour = (text) => {
    const numbers = text.match(/-?[\d.]+(?:e-?\d+)?/g)?.map(Number) ?? [0, 0, 0, 0];
    if (text.startsWith("color(srgb")) return [...numbers.slice(0, 3).map((v) => 255 * v), numbers[3] ?? 1];
    return [...numbers.slice(0, 3), numbers[3] ?? 1];
  };
  const over = (front, back) => [0, 1, 2].map((k) => front[k] * front[3] + back[k] * (1 - front[3]));
  const luminance = (c) => c.map((v) => v / 255).map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const behind = (e) => {
    const layers = [];
    for (let at = e; at; at = at.parentElement) {
      const back = colour(getComputedStyle(at).backgroundColor);
      layers.push(back);
      if (back[3] === 1) break;
    }
    return layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255]);
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const seen = new Set();
  while (walker.nextNode()) {
    const e = walker.currentNode.parentElement;
    if (!walker.currentNode.data.trim() || seen.has(e) || !shown(e) || e.closest(":disabled, .stage, noscript, svg title")) continue;
    seen.add(e);
    const style = getComputedStyle(e), back = behind(e);
    const front = over(colour(e.closest("svg") ? style.fill : style.color), back);
    const [light, dark] = [luminance(front), luminance(back)].sort((a, b) => b - a);
    const size = parseFloat(style.fontSize), wanted = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700) ? 3 : 4.5;
    const ratio = (light + 0.05) / (dark + 0.05);
    if (ratio < wanted) told("text can be read", e, `contrast ${ratio.toFixed(2)}, wanted ${wanted}`);
  }
  return found;
})()
