/** The outline of the brush below the pointer, while somebody paints. */

import type { App } from "../app";

/** Puts it on `viewport`; stage.css shows it only while somebody paints. */
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
    if (radius === undefined) {
      // What was shown stays until it is known.
      frame = requestAnimationFrame(() => show(event));
      return;
    }
    outline.hidden = radius === null;
    outline.style.translate = `${x}px ${y}px`;
    outline.style.width = `${2 * (radius ?? 0)}px`;
  };
  const follow = (event: PointerEvent | WheelEvent) => {
    if (app.store.get().painting === null) return;
    // A hand that turns the view does not paint.
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
