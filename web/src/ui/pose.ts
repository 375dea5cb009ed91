/** Step 4: exact numbers for what is selected, help for moving, and poses. */

import type { App } from "../app";
import type { Pose } from "../contract";
import { coordinate, percent, plural } from "../format";
import { fittingPoses } from "../state";
import { AXES } from "../strings";
import { button, head, iconButton, section, slider, toggle, uid } from "./controls";
import { fill, h, setText } from "./dom";
import { icon } from "./icons";

export function createPosePanel(app: App): HTMLElement {
  const { store } = app;
  const what = h("p", { class: "hint" });
  const inputs = AXES.map((axis) => axisField(app, axis));
  const fields = h("div", { class: "axis-fields" }, ...inputs.map(({ element }) => element));

  const symmetry = toggle("Mirror across X", "What you move on one side moves on the other.", (on) =>
    app.view.symmetry(on),
  );
  const unmatched = h("p", { class: "hint warn-text" });
  const proportional = toggle(
    "Proportional editing",
    "Vertices nearby follow, less the farther they are. While dragging, the wheel sets how far.",
    (on) => app.view.proportional(on),
  );
  const radius = slider(
    "How far",
    { min: 0.02, max: 1, step: 0.01, format: (value) => `${percent(value)} of the cage` },
    (value) => app.view.proportional(true, value),
  );

  const list = h("ul", { class: "poses" });
  const none = h(
    "div",
    { class: "empty-state" },
    icon("pose"),
    h("p", {
      text: "No poses yet. Drag the cage, then save what you see; saved poses can be mixed, played and exported as morph targets.",
    }),
    button("Save this pose", () => app.run("savePose"), { icon: "plus", kind: "small" }),
  );
  const waiting = h("p", { class: "hint" });
  const play = button("Play", () => app.run("play"), { icon: "play", kind: "small" });
  const reset = button("Reset", () => app.run("resetPose"), {
    icon: "reset",
    kind: "small",
    title: `Back to the rest pose (${app.key("resetPose")})`,
  });
  const tools = h("div", { class: "row" }, play, reset);
  const rows = new Map<Pose, { element: HTMLElement; set(share: number): void }>();

  store.watch(["selected", "element", "editingRest"], ({ selected, editingRest }) => {
    const { count, center, last } = selected;
    setText(
      what,
      count === 0
        ? "Nothing selected. Click a handle in the view, or press ] to go from one to the next."
        : count === 1
          ? `Vertex ${last} of the cage${editingRest ? " at rest" : ""}`
          : `Middle of ${plural(count, "vertex", "vertices")}`,
    );
    fields.hidden = count === 0;
    inputs.forEach(({ input }, i) => {
      const value = center?.[i];
      if (value !== undefined && document.activeElement !== input) input.value = coordinate(value);
    });
  });
  store.watch(["symmetry", "unmatched"], (state) => {
    symmetry.set(state.symmetry);
    unmatched.hidden = !state.symmetry || state.unmatched === 0;
    setText(
      unmatched,
      `${plural(state.unmatched, "vertex has", "vertices have")} no mirror image and ${state.unmatched === 1 ? "moves" : "move"} alone.`,
    );
  });
  store.watch(["proportionalOn", "proportional"], (state) => {
    proportional.set(state.proportionalOn);
    radius.element.hidden = !state.proportionalOn;
    radius.set(state.proportional);
  });
  store.watch(["posed"], ({ posed }) => {
    reset.disabled = !posed;
  });
  store.watch(["playing"], ({ playing }) => {
    fill(play, icon(playing ? "stop" : "play"), h("span", { text: playing ? "Stop" : "Play" }));
  });
  store.watch(["poses", "cage"], (state) => {
    const fitting = fittingPoses(state);
    const others = state.poses.length - fitting.length;
    for (const pose of rows.keys()) if (!fitting.includes(pose)) rows.delete(pose);
    for (const pose of fitting) if (!rows.has(pose)) rows.set(pose, poseRow(app, pose));
    fill(list, ...fitting.map((pose) => rows.get(pose)?.element));
    none.hidden = state.poses.length > 0;
    play.disabled = fitting.length === 0;
    waiting.hidden = others === 0;
    setText(
      waiting,
      `${plural(others, "pose belongs", "poses belong")} to another cage and ${others === 1 ? "waits" : "wait"} for it.`,
    );
  });
  store.watch(["shares", "poses"], ({ shares, poses }) => {
    poses.forEach((pose, i) => {
      rows.get(pose)?.set(shares[i] ?? 0);
    });
  });

  return h(
    "div",
    { class: "stack loose" },
    head("Pose it", "Drag the round handles of the cage. The model follows in the same frame."),
    h("div", { class: "stack" }, what, fields),
    section("Help with moving", symmetry.element, unmatched, proportional.element, radius.element),
    section("Poses", none, list, waiting, tools),
  );
}

function axisField(app: App, axis: (typeof AXES)[number]): { element: HTMLElement; input: HTMLInputElement } {
  const id = uid("axis");
  const index = AXES.indexOf(axis);
  const input = h("input", {
    attrs: { type: "number", id, step: "any", "aria-label": `Selection, ${axis}` },
  });
  input.addEventListener("change", () => {
    const { center } = app.store.get().selected;
    const value = input.valueAsNumber;
    if (!center || Number.isNaN(value)) return;
    const next = center.map((old, i) => (i === index ? value : old));
    app.edit.moveTo(next[0] ?? 0, next[1] ?? 0, next[2] ?? 0);
  });
  const element = h(
    "div",
    { class: "axis-field", data: { axis: axis.toLowerCase() } },
    h("span", { text: axis, attrs: { "aria-hidden": "true" } }),
    input,
  );
  return { element, input };
}

function poseRow(app: App, pose: Pose): { element: HTMLElement; set(share: number): void } {
  const share = slider(
    "Blend",
    { min: 0, max: 1, step: 0.01, format: percent, onCommit: (value) => app.poses.blend(pose, value, true) },
    (value) => app.poses.blend(pose, value, false),
  );
  share.input.setAttribute("aria-label", `Blend of ${pose.name}`);
  const name = h("input", {
    class: "pose-name",
    attrs: { type: "text", value: pose.name, "aria-label": `Name of ${pose.name}`, maxlength: "60" },
    on: { change: () => app.poses.rename(pose, name.value) },
  });
  const element = h(
    "li",
    { class: "card pose" },
    h(
      "div",
      { class: "row" },
      name,
      button("Show", () => app.poses.apply(pose), { kind: "small", title: `Show ${pose.name}` }),
      iconButton("trash", `Delete ${pose.name}`, () => app.poses.remove(pose), { kind: "small" }),
    ),
    share.element,
  );
  return { element, set: share.set };
}
