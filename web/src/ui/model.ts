/** Step 1: what is open, how to open something else, and samples. */

import type { App } from "../app";
import type { ModelInfo, UpAxis } from "../contract";
import { count, scientific } from "../format";
import { PRIVACY, SAMPLES, sentence } from "../strings";
import { button, facts, head, section, segments } from "./controls";
import { fill, h, keyed, setText } from "./dom";
import { icon } from "./icons";

export function createModelPanel(app: App): HTMLElement {
  const card = h("div");
  const up = segments<UpAxis>(
    "Up in the file",
    [
      { value: "y", label: "Y", title: "As glTF prescribes" },
      { value: "z", label: "Z", title: "Turn a model that lies on its back" },
    ],
    (axis) => void app.files.turn(axis),
  );
  const gallery = h("ul", { class: "gallery" });
  const showKept = button("", () => app.store.set({ worksOpen: true }), { icon: "save", kind: "small" });
  const kept = h("div", { class: "row" }, showKept);
  app.store.watch(["works"], ({ works }) => {
    kept.hidden = works.length === 0;
    setText(showKept.lastElementChild ?? showKept, `Kept in this browser (${works.length})`);
  });
  const element = h(
    "div",
    { class: "stack loose" },
    head(
      "Choose a model",
      "A cage is a lattice that fits the shape of a model. What you see is already bound to its own: drag a round handle. Or drop a file anywhere on this page.",
    ),
    h(
      "div",
      { class: "dropzone" },
      icon("upload"),
      h(
        "div",
        { class: "grow" },
        h("strong", { text: "Drop a model here" }),
        h("p", { class: "hint", text: ".glb, .gltf with its files, or .obj; a folder works too" }),
      ),
      h(
        "div",
        { class: "row wrap" },
        button("Open a file", () => app.chooseModel(), { icon: "file", kind: "small" }),
        button("Open a folder", () => app.chooseFolder(), { icon: "open", kind: "small" }),
      ),
    ),
    kept,
    section("Samples", gallery),
    card,
    up.element,
    h("p", { class: "privacy" }, icon("lock"), h("span", { text: PRIVACY })),
    h(
      "p",
      { class: "hint" },
      h("a", { attrs: { href: "./licences.txt", target: "_blank" }, text: "Licences" }),
    ),
  );

  app.store.watch(["model", "sample", "samples"], ({ model, sample, samples }) => {
    const sentenceOf = samples.find(({ id }) => id === sample)?.sentence;
    fill(card, model ? modelCard(model, sentenceOf) : null);
    up.element.hidden = !model;
    if (model) up.set(model.up);
  });

  const showSamples = keyed(gallery, () =>
    app.store.get().samples.map(({ id, label }) => {
      const about = SAMPLES[id];
      const picture = h("img", {
        attrs: { src: `./samples/${id}.webp`, alt: "", width: "72", height: "72", loading: "lazy" },
      });
      const frame = h("span", { class: "thumb" }, icon(about?.icon ?? "model"), picture);
      picture.addEventListener("error", () => picture.remove());
      return h(
        "li",
        {},
        h(
          "button",
          {
            class: "sample",
            attrs: { type: "button" },
            data: { sample: id },
            on: { click: () => void app.files.openSample(id) },
          },
          frame,
          h(
            "span",
            { class: "grow" },
            h("strong", { text: label }),
            about ? h("span", { class: "hint", text: about.sentence }) : null,
          ),
        ),
      );
    }),
  );
  app.store.watch(["samples"], ({ samples }) => showSamples(samples.map((s) => s.id).join()));
  app.store.watch(["sample", "samples"], ({ sample }) => {
    for (const item of gallery.querySelectorAll<HTMLElement>(".sample")) {
      if (item.dataset.sample === sample) item.setAttribute("aria-current", "true");
      else item.removeAttribute("aria-current");
    }
  });
  return element;
}

function modelCard(model: ModelInfo, about: string | undefined): HTMLElement {
  const { min, max } = model.bounds;
  const size = max.map((value, i) => scientific(value - (min[i] ?? 0))).join(" × ");
  const rows: [string, string][] = [
    ["Vertices", count(model.vertices)],
    ["Triangles", count(model.triangles)],
    ["Size", size],
  ];
  if (model.materials > 0) rows.push(["Materials", count(model.materials)]);
  if (model.textures > 0) rows.push(["Textures", count(model.textures)]);
  if (model.animations + model.skins + model.morphTargets > 0) {
    rows.push(["Also in the file", alsoThere(model)]);
  }
  return h(
    "section",
    { class: "card stack tight", attrs: { "aria-label": "The model that is open" } },
    h(
      "div",
      { class: "row" },
      h("strong", { class: "grow clip", text: model.name }),
      h("span", { class: "badge good" }, icon("check"), "Open"),
    ),
    about ? h("p", { class: "hint", text: about }) : null,
    facts(rows),
    ...model.notices.map((notice) => h("p", { class: "hint", text: sentence(notice) })),
  );
}

function alsoThere(model: ModelInfo): string {
  const parts = [
    model.skins > 0 ? `${model.skins} skin${model.skins > 1 ? "s" : ""}` : "",
    model.animations > 0 ? `${model.animations} animation${model.animations > 1 ? "s" : ""}` : "",
    model.morphTargets > 0 ? `${model.morphTargets} morph target${model.morphTargets > 1 ? "s" : ""}` : "",
  ];
  return parts.filter(Boolean).join(", ");
}
