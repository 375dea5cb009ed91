/** Where a bind is computed: graphics card or processor, and why not the former. */

import type { App } from "../app";
import type { BindOptions } from "../contract";
import { button, segments } from "./controls";
import { h, setText } from "./dom";

export function createPlace(app: App): HTMLElement[] {
  const { store } = app;
  const backend = segments<BindOptions["backend"]>(
    "Computed on",
    [
      { value: "gpu", label: "Graphics card" },
      { value: "cpu", label: "Processor" },
    ],
    (value) => app.bind.setOptions({ backend: value }),
  );
  const hint = h("p", { class: "hint" });
  const steps = button("How to switch WebGPU on", () => app.showWays(), { kind: "small" });
  store.watch(["adapter", "lack", "bindOptions"], ({ adapter, lack, bindOptions }) => {
    backend.enable("gpu", lack === null);
    backend.set(lack ? "cpu" : bindOptions.backend);
    steps.hidden = lack === null;
    hint.hidden = lack === null && (adapter === "" || bindOptions.backend === "cpu");
    const chosen =
      bindOptions.solver === "cg"
        ? "Conjugate gradients are computed on the processor, also when the graphics card is chosen."
        : `Graphics card: ${adapter}`;
    setText(
      hint,
      lack ? "Graphics cards compute through WebGPU only, which this browser does not offer here." : chosen,
    );
  });
  return [backend.element, hint, h("div", { class: "row" }, steps)];
}
