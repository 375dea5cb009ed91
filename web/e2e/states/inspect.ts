/** Finds visible text that is not in the catalogue of the pseudo-locale, and text that is cut off. */

import { SHAPE_FORMATS } from "../../src/defaults";

/** Names that no language changes: product, formats and units. */
const NAMES = [
  "Cagework",
  ...["glb", ...SHAPE_FORMATS].map((format) => format.toUpperCase()),
  "byte",
  "ms",
  "kB",
  "MB",
  "GB",
];
const ATTRIBUTES = ["aria-label", "aria-valuetext", "title", "placeholder", "alt", "data-tip"];

/** How far glyphs may reach beyond their box, CSS pixels: sideways (`MAX_REACH_ASIDE`), and above or below (`MAX_REACH_ABOVE`). */
const MAX_REACH_ASIDE = 1.5;
const MAX_REACH_ABOVE = 4;

/** Whether a text has two unaccented letters in a row, outside `NAMES`. The pseudo-locale accents all letters. */
const isPlain = (text: string) =>
  /[a-z]{2}/i.test(NAMES.reduce((rest, name) => rest.replaceAll(name, ""), text));
/** Whether an element is marked as English: messages from Rust are not translated. */
const isEnglish = (element: Element) => element.closest("[lang=en]") !== null;
const isShown = (element: Element) => element.checkVisibility({ visibilityProperty: true });

/** Inspects the page: adds its texts to `seen`, and returns a message for each fault. */
export function inspect(seen: Set<string>): string[] {
  for (const fold of document.querySelectorAll("details")) fold.open = true;
  const faults: string[] = [];
  const check = (text: string, what: string) => {
    seen.add(text);
    if (isPlain(text)) faults.push(`${what} is not in the catalogue: ${text}`);
  };
  for (const element of document.body.querySelectorAll("*")) {
    if (!isShown(element) || isEnglish(element)) continue;
    for (const name of ATTRIBUTES) {
      const text = element.getAttribute(name);
      if (text) check(text, name);
    }
  }
  const nodes = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = nodes.nextNode(); node; node = nodes.nextNode()) {
    const parent = node.parentElement;
    const text = node.textContent?.trim() ?? "";
    if (text === "" || !parent || !isShown(parent) || isEnglish(parent)) continue;
    check(text, "text");
    if (!parent.closest(".visually-hidden")) faults.push(...cutOff(node, parent, text));
  }
  const floating = [...document.querySelectorAll("#stage .floating, #stage .bottom-line > *")].filter(
    isShown,
  );
  for (const [k, one] of floating.entries())
    for (const other of floating.slice(k + 1))
      if (overlap(one.getBoundingClientRect(), other.getBoundingClientRect()))
        faults.push(`${one.className} overlaps ${other.className}`);
  return faults;
}

const overlap = (a: DOMRect, b: DOMRect) =>
  a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;

/**
 * Returns a message if text extends outside the box of an enclosing element or outside the window, otherwise an empty
 * list. In an element that scrolls, text may extend above and below the visible part.
 */
function cutOff(node: Node, parent: Element, text: string): string[] {
  const range = document.createRange();
  range.selectNodeContents(node);
  const { left, right, top, bottom, width } = range.getBoundingClientRect();
  if (width === 0) return [];
  let scrolls = false;
  for (let box: Element | null = parent; box; box = box.parentElement) {
    const { display, overflowY, position } = getComputedStyle(box);
    if (display === "contents" || display === "inline") continue;
    const isRoot = box === document.documentElement || position === "fixed";
    for (const around of [
      ...(box === document.documentElement ? [] : [box.getBoundingClientRect()]),
      ...(isRoot ? [new DOMRect(0, 0, innerWidth, innerHeight)] : []),
    ]) {
      const over = [around.left - MAX_REACH_ASIDE - left, right - around.right - MAX_REACH_ASIDE];
      if (!scrolls && overflowY !== "auto" && overflowY !== "scroll")
        over.push(around.top - MAX_REACH_ABOVE - top, bottom - around.bottom - MAX_REACH_ABOVE);
      const by = Math.max(...over);
      if (by > 0)
        return [`cut off by ${Math.ceil(by)} pixels at ${box.tagName} ${box.className || box.id}: ${text}`];
    }
    scrolls ||= overflowY === "auto" || overflowY === "scroll";
    if (isRoot) break;
  }
  return [];
}
