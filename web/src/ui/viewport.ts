/** The view: the canvas and what takes pointer and keys. */

import { T } from "../words";

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
  const make = () => {
    const made = document.createElement("canvas");
    made.setAttribute("aria-hidden", "true");
    return made;
  };
  let canvas = make();
  const rubber = document.createElement("div");
  rubber.className = "band";
  rubber.hidden = true;
  const viewport = document.createElement("div");
  viewport.className = "viewport";
  viewport.id = "viewport";
  viewport.tabIndex = 0;
  viewport.role = "application";
  viewport.ariaLabel = T.view.name;
  viewport.setAttribute("aria-describedby", "view-help");
  viewport.append(canvas, rubber);
  const help = document.createElement("p");
  help.id = "view-help";
  help.className = "visually-hidden";
  help.textContent = T.view.help;
  element.append(viewport, help);
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
