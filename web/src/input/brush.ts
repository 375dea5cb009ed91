/** Outline of the brush, shown at the pointer while painting. */

import type { App } from "../app";

/** Adds the outline to `viewport`; stage.css hides it unless the user is painting. */
export function attachBrush(viewport: HTMLElement, app: App): void {
  const outline = document.createElement("div");
  outline.className = "brush";
  viewport.append(outline);
  let frame = 0;
  const hide = () => {
    cancelAnimationFrame(frame);
    frame = 0;
    outline.hidden = true;
  };
  const show = (event: MouseEvent) => {
    const { left, top } = viewport.getBoundingClientRect();
    const [x, y] = [event.clientX - left, event.clientY - top];
    const radius = app.painting.radiusAt(x, y);
    outline.hidden = radius === null;
    outline.style.translate = `${x}px ${y}px`;
    outline.style.width = `${2 * (radius ?? 0)}px`;
  };
  const follow = (event: PointerEvent | WheelEvent) => {
    if (app.store.get().painting === null) return;
    // A drag that started beside the model orbits the camera instead of painting.
    if (event.buttons > 0 && !app.painting.active()) {
      hide();
      return;
    }
    cancelAnimationFrame(frame);
    frame = requestAnimationFrame(() => show(event));
  };
  for (const type of ["pointerdown", "pointermove", "pointerup", "wheel"] as const)
    viewport.addEventListener(type, follow, { passive: true });
  viewport.addEventListener("pointerleave", hide);
  hide();
}
