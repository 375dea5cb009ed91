/** Messages: short ones go away, problems stay until they are closed or fixed. Both are read aloud. */

import type { Fix, Tell } from "../actions/context";
import type { Explained } from "../strings";
import { button, iconButton } from "./controls";
import { h } from "./dom";
import { icon } from "./icons";

/** Time to read a short message, ms, and more where it has a button. */
const SHOWN_MS = 5000;
const SHOWN_WITH_BUTTON_MS = 12_000;
/** More at a time would hide the model. */
const MOST = 3;

/** What is said again takes the place of what was said. */
function once(list: HTMLElement, toast: HTMLElement): void {
  const said = (one: Element) =>
    Array.from(one.querySelectorAll("strong, p"), (part) => part.textContent).join("\n");
  const text = said(toast);
  for (const other of Array.from(list.children)) if (said(other) === text) other.remove();
}

export function createToasts(): { element: HTMLElement; tell: Tell } {
  const polite = h("div", { class: "toast-list", attrs: { role: "status", "aria-live": "polite" } });
  const alerts = h("div", { class: "toast-list", attrs: { role: "alert" } });
  const element = h("div", { class: "toasts", id: "toasts" }, alerts, polite);

  const fixButton = (fix: Fix | undefined, close: () => void) =>
    fix
      ? button(
          fix.label,
          () => {
            close();
            fix.run();
          },
          { kind: "small" },
        )
      : null;

  const tell: Tell = {
    say(text, fix) {
      const toast = h("div", { class: "toast" });
      const close = () => toast.remove();
      toast.append(icon("info"), h("p", { text }));
      once(polite, toast);
      const fixing = fixButton(fix, close);
      if (fixing) toast.append(fixing);
      toast.append(iconButton("close", "Close message", close, { kind: "small" }));
      polite.append(toast);
      while (polite.childElementCount > MOST) polite.firstElementChild?.remove();
      let timer = setTimeout(close, fix ? SHOWN_WITH_BUTTON_MS : SHOWN_MS);
      // Who reads or is about to click must not lose it.
      toast.addEventListener("pointerenter", () => clearTimeout(timer));
      toast.addEventListener("pointerleave", () => {
        timer = setTimeout(close, SHOWN_MS);
      });
      toast.addEventListener("focusin", () => clearTimeout(timer));
    },
    problem(explained: Explained, fix) {
      const toast = h("div", { class: "toast problem" });
      const close = () => toast.remove();
      toast.append(
        icon("warning"),
        h(
          "div",
          { class: "grow" },
          h("strong", { text: explained.title }),
          h("p", { text: explained.message }),
        ),
        iconButton("close", "Close message", close, { kind: "small" }),
      );
      once(alerts, toast);
      const fixing = fixButton(fix, close);
      if (fixing) toast.append(h("div", { class: "toast-fix" }, fixing));
      alerts.append(toast);
      while (alerts.childElementCount > MOST) alerts.firstElementChild?.remove();
    },
    clear() {
      alerts.replaceChildren();
    },
  };
  return { element, tell };
}
