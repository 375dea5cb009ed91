/** What lies over the view while the page waits for a file: how far it is, and the way out. */

import type { App } from "../app";
import { button } from "./controls";
import { h, setText } from "./dom";

export function createBusy({ store }: App): HTMLElement {
  const what = h("p");
  const step = h("p", { class: "hint" });
  const cancel = button("Cancel", () => store.get().cancelBusy?.(), { icon: "stop", kind: "small" });
  const goOn = button("Open it all the same", () => store.get().goOn?.(), { kind: "small primary" });
  const spinner = h("span", { class: "spinner" });
  const element = h("div", { class: "busy" }, spinner, what, step, h("div", { class: "row" }, cancel, goOn));
  store.watch(["busy", "busyStep", "cancelBusy", "goOn"], (state) => {
    element.hidden = state.busy === null;
    setText(what, state.busy ? `${state.busy}…` : "");
    setText(step, state.busyStep);
    cancel.hidden = state.cancelBusy === null;
    goOn.hidden = state.goOn === null;
    spinner.hidden = state.goOn !== null;
  });
  return element;
}
