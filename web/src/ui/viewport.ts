/** The view: the canvas and what takes pointer and keys. */

import { h } from "./dom";

export interface Stage {
  /** What takes the pointer and the keys; holds the canvas. */
  readonly viewport: HTMLElement;
  readonly canvas: () => HTMLCanvasElement;
  /** A canvas in place of one whose device was lost. */
  freshCanvas(): HTMLCanvasElement;
  /** The rubber band of a box selection; null hides it. */
  band(box: { x: number; y: number; width: number; height: number } | null): void;
}

/** The view's element and canvas: made first, because the session opens on the canvas. */
export function createStage(element: HTMLElement): Stage {
  const make = () => h("canvas", { attrs: { "aria-hidden": "true" } });
  let canvas = make();
  const rubber = h("div", { class: "band", hidden: true });
  const viewport = h(
    "div",
    {
      class: "viewport",
      id: "viewport",
      attrs: {
        tabindex: "0",
        role: "application",
        "aria-label": "3-D view",
        "aria-describedby": "view-help",
      },
    },
    canvas,
    rubber,
  );
  element.append(
    viewport,
    h("p", {
      id: "view-help",
      class: "visually-hidden",
      text: "Square brackets go from one cage vertex to the next, arrow keys move it, question mark lists all keys. Tab leaves the view.",
    }),
  );
  return {
    viewport,
    canvas: () => canvas,
    freshCanvas() {
      const next = make();
      canvas.replaceWith(next);
      canvas = next;
      return next;
    },
    band(box) {
      rubber.hidden = box === null;
      if (!box) return;
      rubber.style.translate = `${box.x}px ${box.y}px`;
      rubber.style.width = `${box.width}px`;
      rubber.style.height = `${box.height}px`;
    },
  };
}
