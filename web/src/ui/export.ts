/** Step 5: files to take along, each with a sentence on what it is good for. */

import type { ExportKind } from "../actions/exports";
import type { App } from "../app";
import { plural } from "../format";
import { type AppState, fittingPoses } from "../state";
import { PRIVACY } from "../strings";
import { head, segments } from "./controls";
import { h, setText } from "./dom";
import { type IconName, icon } from "./icons";

interface Item {
  kind: ExportKind;
  icon: IconName;
  title: string;
  sentence: string;
  /** Why it is not possible now, or null. */
  missing: (state: AppState) => string | null;
}

const needsBind = (state: AppState) => (state.bound ? null : "Bind the model first.");
const needsCage = (state: AppState) => (state.cage ? null : "Make a cage first.");

const ITEMS: readonly Item[] = [
  {
    kind: "glb",
    icon: "model",
    title: "Posed model",
    sentence: "GLB as you see it. Materials, textures and parts are those of your file.",
    missing: needsBind,
  },
  {
    kind: "poses",
    icon: "layers",
    title: "Poses as morph targets",
    sentence: "GLB with one morph target a pose and an animation through them. Exact in every blend.",
    missing: (state) =>
      needsBind(state) ??
      (fittingPoses(state).length === 0 ? "Save a pose first, in the step before." : null),
  },
  {
    kind: "cage",
    icon: "cage",
    title: "Cage",
    sentence: "OBJ of the cage in this pose, for any modelling program.",
    missing: needsCage,
  },
  {
    kind: "weights",
    icon: "table",
    title: "Weights",
    sentence: "NPZ, which scipy.sparse.load_npz reads: one row a vertex of your file.",
    missing: needsBind,
  },
  {
    kind: "picture",
    icon: "image",
    title: "Picture",
    sentence: "PNG of the view.",
    missing: (state) => (state.model ? null : "Open a model first."),
  },
  {
    kind: "project",
    icon: "save",
    title: "Project",
    sentence: "Model, cage, poses and settings in one GLB that Cagework opens again.",
    missing: needsCage,
  },
];

export function createExportPanel(app: App): HTMLElement {
  const list = h("ul", { class: "stack" });
  for (const item of ITEMS) {
    const why = h("span", { class: "hint" });
    const label = h("button", {
      class: "export-card",
      attrs: { type: "button" },
      data: { kind: item.kind },
      on: { click: () => void app.exports.save(item.kind) },
    });
    label.append(
      h("span", { class: "tile" }, icon(item.icon)),
      h("span", { class: "grow" }, h("strong", { text: item.title }), why),
      icon("download"),
    );
    const entry = h("li", {}, label);
    if (item.kind === "picture") {
      const size = segments<"1" | "2" | "4">(
        "Size of the picture",
        [
          { value: "1", label: "As shown" },
          { value: "2", label: "Twice" },
          { value: "4", label: "Four times" },
        ],
        (value) => app.exports.pictureSize(Number(value)),
      );
      size.set("2");
      entry.append(h("div", { class: "export-option" }, size.element));
    }
    list.append(entry);
    app.store.watch(["model", "cage", "bound", "poses"], (state) => {
      const reason = item.missing(state);
      label.disabled = reason !== null;
      const n = item.kind === "poses" ? fittingPoses(state).length : 0;
      setText(why, reason ?? (n > 0 ? `${plural(n, "pose")}. ${item.sentence}` : item.sentence));
    });
  }
  return h(
    "div",
    { class: "stack loose" },
    head("Take it along", "Files for Blender, Unity, Unreal, three.js, Python, and for this page."),
    list,
    h("p", { class: "privacy" }, icon("lock"), h("span", { text: PRIVACY })),
  );
}
