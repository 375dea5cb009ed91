/** What the colours on the view mean. */

import type { App } from "../app";
import type { SceneOptions } from "../contract";
import { scientific } from "../format";
import { h, setText } from "./dom";

export function createLegend(app: App): HTMLElement {
  const title = h("strong");
  const low = h("span");
  const middle = h("span", { class: "grow" });
  const high = h("span");
  const ramp = h("div", { class: "ramp" });
  const element = h(
    "figure",
    { class: "floating legend" },
    h("figcaption", {}, title),
    ramp,
    h("div", { class: "row ends" }, low, middle, high),
  );
  app.store.watch(["legend", "scene", "selected"], ({ legend, scene, selected }) => {
    element.hidden = legend === null;
    if (!legend) return;
    ramp.dataset.map = legend.map;
    setText(title, legendTitle(scene, selected.last));
    setText(low, legend.map === "kinds" ? "inside" : scientific(legend.low));
    setText(middle, legend.map === "kinds" ? "on the cage" : "");
    setText(high, legend.map === "kinds" ? "outside" : scientific(legend.high));
    element.setAttribute("aria-label", `${title.textContent}: ${low.textContent} to ${high.textContent}`);
  });
  return element;
}

function legendTitle(scene: SceneOptions, last: number): string {
  if (scene.slice === "kinds") return "Cells";
  if (scene.slice === "value") return `Coordinate of vertex ${last}`;
  if (scene.colour === "weight") return `Weight of vertex ${last}`;
  return "Rest error";
}
