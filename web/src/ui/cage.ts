/** Step 2: where the cage comes from, what is wrong with it, and shaping it. */

import type { App } from "../app";
import type { CageOptions, CageState, Check, Problem, RestEdit } from "../contract";
import { RANGES } from "../defaults";
import { count, percent, plural } from "../format";
import type { CageSource } from "../state";
import { sentence } from "../strings";
import { button, facts, head, section, segments, slider, toggle } from "./controls";
import { fill, h } from "./dom";
import { type IconName, icon } from "./icons";

const SOURCES: Record<CageSource, string> = {
  auto: "Follows the limbs of the model, closed and around every vertex; checked before you see it.",
  hull: "A rough hull of two dozen vertices: good for bodies without limbs, and quick to pose.",
  box: "A box around the model, its sides cut into squares: free-form deformation, good for studying.",
  file: "A closed mesh that you modelled around it: .obj, .glb or .gltf.",
};

/** Where the slider of voxels starts: it stands for none in particular. */
const COARSEST = 16;
/** Gaps narrower than so many voxels are closed. */
const GAP_VOXELS = 3;

export function createCagePanel(app: App): HTMLElement {
  const { store } = app;
  const setOptions = (patch: Partial<CageOptions>) =>
    store.set({ cageOptions: { ...store.get().cageOptions, ...patch } });

  const source = segments<CageSource>(
    "How",
    [
      { value: "auto", label: "Automatic" },
      { value: "hull", label: "Hull" },
      { value: "box", label: "Box" },
      { value: "file", label: "File" },
    ],
    (cageSource) => store.set({ cageSource }),
    { hideLabel: true },
  );
  const about = h("p", { class: "hint" });
  const target = slider(
    "Vertices wanted",
    { min: RANGES.vertices[0], max: RANGES.vertices[1], step: 2, format: count },
    (vertices) => setOptions({ vertices }),
  );
  const margin = slider(
    "Room around the model",
    {
      min: 0,
      max: 0.15,
      step: 0.005,
      format: (v) => (v === 0 ? "as tight as it can be" : `${(v * 100).toFixed(1)} % of its size`),
    },
    (value) => setOptions({ margin: value }),
  );
  const gaps = slider(
    "Gaps that stay open",
    {
      min: COARSEST,
      max: RANGES.voxels[1],
      step: 8,
      format: (v) =>
        v === COARSEST
          ? "as the vertices allow"
          : `from ${((GAP_VOXELS / v) * 100).toFixed(1)} % of its size`,
    },
    (voxels) => setOptions({ voxels: voxels === COARSEST ? 0 : voxels }),
  );
  const symmetry = segments<CageOptions["symmetry"]>(
    "Left and right alike",
    [
      { value: "auto", label: "If the model is" },
      { value: "on", label: "Yes" },
      { value: "off", label: "No" },
    ],
    (value) => setOptions({ symmetry: value }),
  );
  const parts = toggle(
    "A cage for each part",
    "For models of separate parts. Off: one cage around all.",
    (on) => setOptions({ per_component: on }),
  );
  const divisions = slider("Squares along each side", { min: 1, max: 8, step: 1 }, (boxDivisions) =>
    store.set({ boxDivisions }),
  );
  const auto = h(
    "div",
    { class: "stack" },
    target.element,
    symmetry.element,
    margin.element,
    gaps.element,
    parts.element,
  );
  const box = h("div", { class: "stack" }, divisions.element);
  const make = button("Make this cage", () => void app.cage.make(), { icon: "cage", kind: "block" });
  const load = button("Open a cage file", () => app.chooseCage(), { icon: "file", kind: "block" });
  const progress = h("progress", { attrs: { max: "1", "aria-label": "Making the cage" } });
  const result = h("div", { class: "stack" });

  const rest = toggle(
    "Reshape the cage",
    `Shape the cage itself; the model stays still and is bound again afterwards. ${app.key("restMode")} in the view.`,
    (on) => app.edit.setEditingRest(on),
  );
  const tools = h("div", { class: "tool-grid" });
  const edits: [RestEdit, string, IconName, string][] = [
    ["split_edge", "Split edge", "split", app.key("split")],
    ["collapse_edge", "Collapse edge", "merge", app.key("collapse")],
    ["extrude_face", "Extrude face", "extrude", app.key("extrude")],
    ["delete_vertex", "Delete and fill", "trash", app.key("remove")],
  ];
  const editButtons = edits.map(([edit, label, name, key]) => {
    const element = button(label, () => app.edit.restEdit(deletion(edit, store.get().element)), {
      icon: name,
      kind: "small",
      title: `${label} (${key})`,
    });
    tools.append(element);
    return { edit, element };
  });
  const editHint = h("p", { class: "hint" });
  const restBox = h("div", { class: "stack" }, rest.element, tools, editHint);

  store.watch(["cageSource"], ({ cageSource }) => {
    source.set(cageSource);
    about.textContent = SOURCES[cageSource];
    auto.hidden = cageSource !== "auto";
    box.hidden = cageSource !== "box";
    make.hidden = cageSource === "file";
    load.hidden = cageSource !== "file";
  });
  store.watch(["cageOptions", "boxDivisions"], ({ cageOptions, boxDivisions }) => {
    target.set(cageOptions.vertices);
    margin.set(cageOptions.margin);
    gaps.set(cageOptions.voxels || COARSEST);
    symmetry.set(cageOptions.symmetry);
    parts.set(cageOptions.per_component);
    divisions.set(boxDivisions);
  });
  store.watch(["cageProgress", "model"], ({ cageProgress, model }) => {
    progress.hidden = cageProgress === null;
    progress.value = cageProgress ?? 0;
    progress.textContent = percent(cageProgress ?? 0);
    make.disabled = cageProgress !== null || !model;
    load.disabled = !model;
  });
  store.watch(["cage", "check", "bindOptions"], ({ cage, check }) => {
    fill(result, cage ? cageCard(cage, check) : empty());
    for (const problem of check?.problems ?? []) result.append(problemCard(problem, app));
    restBox.hidden = cage === null;
  });
  store.watch(["editingRest", "element", "selected"], ({ editingRest, element, selected }) => {
    rest.set(editingRest);
    tools.hidden = !editingRest;
    editHint.hidden = !editingRest;
    for (const { edit, element: one } of editButtons) {
      one.disabled = selected.count < need(edit, element) || !suits(edit, element);
    }
    editHint.textContent = HINTS[element];
  });

  return h(
    "div",
    { class: "stack loose" },
    head(
      "Put a cage around it",
      "A coarse closed mesh. You move its few vertices, the model follows smoothly.",
    ),
    h("div", { class: "stack" }, source.element, about, auto, box, progress, make, load),
    section("The cage", result),
    section("Shape it", restBox),
  );
}

const HINTS = {
  vertex: "Vertices are selected. To split or collapse, choose edges on the left; to extrude, faces.",
  edge: "Click an edge to split it in the middle or to collapse it into one vertex.",
  face: "Click a face to extrude or delete it. A gap that is left is filled.",
} as const;

function suits(edit: RestEdit, element: "vertex" | "edge" | "face"): boolean {
  if (edit === "split_edge" || edit === "collapse_edge") return element === "edge";
  if (edit === "extrude_face") return element === "face";
  return element !== "edge";
}

function need(edit: RestEdit, element: "vertex" | "edge" | "face"): number {
  if (edit === "extrude_face") return 3;
  if (edit === "delete_vertex") return element === "face" ? 3 : 1;
  return 2;
}

function deletion(edit: RestEdit, element: "vertex" | "edge" | "face"): RestEdit {
  return edit === "delete_vertex" && element === "face" ? "delete_face" : edit;
}

function empty(): HTMLElement {
  return h("p", { class: "empty", text: "No cage yet. Make one: it takes less than a second." });
}

function badgeOf(cage: CageState, check: Check | null): HTMLElement {
  if (!cage.usable) return h("span", { class: "badge bad" }, icon("warning"), "Needs repair");
  if (!check) return h("span", { class: "badge" }, "Checking…");
  return check.problems.some((problem) => problem.code === "model_outside")
    ? h("span", { class: "badge warn" }, icon("warning"), "Vertices outside")
    : h("span", { class: "badge good" }, icon("check"), "Encloses the model");
}

function cageCard(cage: CageState, check: Check | null): HTMLElement {
  return h(
    "div",
    { class: "card stack tight" },
    h(
      "div",
      { class: "row" },
      h("strong", { class: "grow", text: plural(cage.info.vertices, "vertex", "vertices") }),
      badgeOf(cage, check),
    ),
    facts([
      ["Edges", count(cage.info.edges)],
      ["Faces", count(cage.info.faces)],
    ]),
    ...cage.info.notices.map((notice) => h("p", { class: "hint", text: sentence(notice) })),
  );
}

function problemCard(problem: Problem, app: App): HTMLElement {
  const { fix } = problem;
  // Once the grid is as fine as asked for, nothing is left to do.
  const done = fix?.kind === "grid" && app.store.get().bindOptions.grid >= fix.cells;
  return h(
    "div",
    { class: `problem-card ${problem.severity}` },
    icon(problem.severity === "note" ? "info" : "warning"),
    h("p", { class: "grow", text: sentence(problem.message) }),
    fix && !done ? button(fix.label, () => app.cage.mend(fix), { kind: "small" }) : null,
    done ? h("span", { class: "badge good" }, icon("check"), "Fine enough") : null,
  );
}
