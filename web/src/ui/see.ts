/** The See panel: colours, wireframes, the grid, and harmonic beside mean value. */

import type { App } from "../app";
import type { SceneOptions } from "../contract";
import { percent } from "../format";
import { AXES } from "../strings";
import { button, iconButton, section, segments, slider, toggle } from "./controls";
import { h, setText } from "./dom";

const COLOURS: Record<SceneOptions["colour"], string> = {
  material: "The model's own materials and textures.",
  clay: "One even colour: the shape is easier to judge.",
  weight: "How much each point follows the vertex selected last. Select another one to see its share.",
  error: "Distance from where the model should be at rest, logarithmic. Our method leaves almost none.",
};

export function createSeePanel(app: App): HTMLElement {
  const { store, view } = app;
  const colour = segments<SceneOptions["colour"]>(
    "Colour",
    [
      { value: "material", label: "Material" },
      { value: "clay", label: "Clay" },
      { value: "weight", label: "Weight" },
      { value: "error", label: "Error" },
    ],
    (value) => view.scene({ colour: value }),
  );
  const about = h("p", { class: "hint" });
  const compare = toggle(
    "Harmonic beside mean value",
    "Left harmonic, right mean value coordinates, same pose.",
    (on) => void view.compare(on),
  );
  const show: [
    keyof SceneOptions & ("model" | "cage" | "base_wireframe" | "floor" | "problems"),
    string,
    string,
  ][] = [
    ["model", "Model", ""],
    ["cage", "Cage and handles", ""],
    ["base_wireframe", "Model at rest, as wires", "The paper's way to show what moved."],
    ["floor", "Floor", ""],
    ["problems", "Marks of the cage's faults", ""],
  ];
  const switches = show.map(([key, label, sentence]) => ({
    key,
    control: toggle(label, sentence, (on) => view.scene({ [key]: on })),
  }));
  const slice = segments<SceneOptions["slice"]>(
    "Slice through the grid",
    [
      { value: "off", label: "Off" },
      { value: "kinds", label: "Cells" },
      { value: "value", label: "Coordinate" },
    ],
    (kind) => view.slice({}, kind),
  );
  const axis = segments<"0" | "1" | "2">(
    "Across",
    AXES.map((label, i) => ({ value: String(i) as "0" | "1" | "2", label })),
    (value) => view.slice({ axis: Number(value) as 0 | 1 | 2 }),
  );
  const position = slider("Where", { min: 0, max: 1, step: 0.005, format: percent }, (value) =>
    view.slice({ position: value }),
  );
  const sliceNote = h("p", { class: "hint" });
  const sliceBox = h("div", { class: "stack" }, axis.element, position.element, sliceNote);
  const ortho = button("Parallel projection", () => view.ortho(), {
    kind: "small",
    title: `Perspective or parallel (${app.key("ortho")})`,
  });

  const element = h(
    "aside",
    { class: "see", id: "see", attrs: { "aria-label": "See" } },
    h(
      "div",
      { class: "row see-head" },
      h("h2", { class: "grow", text: "See" }),
      iconButton("close", "Close the See panel", () => store.set({ seeOpen: false }), {
        kind: "small",
        shortcut: app.key("see"),
      }),
    ),
    h(
      "div",
      { class: "see-body stack loose" },
      h("div", { class: "stack" }, colour.element, about, compare.element),
      section("Grid", slice.element, sliceBox),
      section("Show", h("div", { class: "stack tight" }, ...switches.map(({ control }) => control.element))),
      section(
        "From where",
        h(
          "div",
          { class: "row even" },
          button("Front", () => view.axis(2, false), { kind: "small", title: app.key("viewFront") }),
          button("Right", () => view.axis(0, false), { kind: "small", title: app.key("viewRight") }),
          button("Top", () => view.axis(1, false), { kind: "small", title: app.key("viewTop") }),
        ),
        ortho,
      ),
    ),
  );

  store.watch(["seeOpen"], ({ seeOpen }) => {
    element.hidden = !seeOpen;
  });
  store.watch(["scene", "selected", "bound"], ({ scene, selected, bound }) => {
    colour.set(scene.colour);
    for (const value of ["weight", "error"] as const) colour.enable(value, bound);
    setText(
      about,
      scene.colour === "weight" && selected.last < 0
        ? "Select a handle of the cage to see its weights."
        : COLOURS[scene.colour],
    );
    compare.set(scene.compare);
    for (const { key, control } of switches) control.set(scene[key]);
    slice.set(scene.slice);
    sliceBox.hidden = scene.slice === "off";
    setText(
      sliceNote,
      scene.slice === "value"
        ? selected.last < 0
          ? "Select a handle of the cage to see its coordinate."
          : `Coordinate of cage vertex ${selected.last}: 1 there, 0 at the others, as smooth as can be between.`
        : "Cells inside, on and outside the cage.",
    );
  });
  store.watch(["slice"], ({ slice: now }) => {
    axis.set(String(now.axis) as "0" | "1" | "2");
    position.set(now.position);
    sliceBox.toggleAttribute("data-busy", now.busy);
  });
  store.watch(["ortho"], ({ ortho: parallel }) => {
    ortho.setAttribute("aria-pressed", String(parallel));
  });
  return element;
}
