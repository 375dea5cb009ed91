/** What the page shows of a crash: its report, and the choice when it would come again. */

import type { Crash } from "../crash";
import { button } from "./controls";
import { h } from "./dom";

export const CRASHED = "Cagework stopped, and was begun anew";

/** The report's text, to be read and copied. */
export function showReport(crash: Crash): void {
  const close = button("Close", () => dialog.close(), { kind: "primary" });
  const dialog = dialogOf("Report", [], crash, [close]);
  dialog.addEventListener("close", () => dialog.remove());
  dialog.showModal();
}

/** It stopped a second time: nothing is opened until the user has chosen. */
export function askAfterCrash(crash: Crash, startFresh: () => void): void {
  const again = button("Try again", () => location.reload());
  const fresh = button("Start fresh", startFresh, { kind: "primary" });
  const texts = [
    `${crash.during} It was the second time, so nothing is opened again by itself.`,
    "Start fresh begins with a sample. The work stays kept, and opens only when you ask for it.",
  ];
  const dialog = dialogOf("Cagework stopped again", texts, crash, [fresh, again]);
  // Behind it there is no page that could be used.
  dialog.addEventListener("cancel", (event) => event.preventDefault());
  dialog.showModal();
}

function dialogOf(
  title: string,
  texts: readonly string[],
  { report }: Crash,
  buttons: readonly HTMLButtonElement[],
): HTMLDialogElement {
  const element = h(
    "dialog",
    { class: "sheet ways", attrs: { "aria-labelledby": "crash-title" } },
    h("div", { class: "row sheet-head" }, h("h2", { class: "grow", id: "crash-title", text: title })),
    h(
      "div",
      { class: "sheet-body" },
      ...texts.map((text) => h("p", { text })),
      h("pre", { class: "report", text: report, attrs: { tabindex: "0", "aria-label": "Report" } }),
      h("div", { class: "row wrap" }, ...buttons),
    ),
  );
  document.body.append(element);
  return element;
}
