/** The view: its canvas and the element that receives pointer and keyboard events. */

import { T } from "../words";

/** Creates the view. Call this before opening the session, which needs the canvas. */
export function createStage(element: HTMLElement) {
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
    /** Receives pointer and keyboard events; contains the canvas. */
    viewport,
    canvas: () => canvas,
    /** Replaces the canvas. Another GPU device needs a new one. */
    freshCanvas(): HTMLCanvasElement {
      const next = make();
      canvas.replaceWith(next);
      canvas = next;
      return next;
    },
    /** Shows the rubber band of a box selection; null hides it. */
    band(box: { x: number; y: number; width: number; height: number } | null) {
      rubber.hidden = box === null;
      if (!box) return;
      rubber.style.translate = `${box.x}px ${box.y}px`;
      rubber.style.width = `${box.width}px`;
      rubber.style.height = `${box.height}px`;
    },
  };
}

export type Stage = ReturnType<typeof createStage>;
