/**
 * Pointer input of the element. Dragging a cage vertex moves it, dragging elsewhere turns the view, and the wheel or
 * two fingers zoom.
 */

import type { Engine } from "../contract";
import { createTouch } from "../session/touch";

/** Distance from a cage vertex within which a press grabs it, CSS pixels. */
const MOUSE_RADIUS = 10;
const TOUCH_RADIUS = 24;
/** Logarithm of the zoom factor per wheel unit. A wheel notch is about 100 units, which enlarges the view by 16 %. */
const WHEEL_RATE = 0.0015;

/**
 * Lets the pointer drag handles, orbit and zoom. Calls `posed` after every change of the pose. Returns a function that
 * cancels the drag in progress.
 */
export function attachPointer(
  element: HTMLElement,
  engineOf: () => Engine | undefined,
  posed: () => void,
): () => void {
  let drag: "handle" | "orbit" | undefined;
  let last = { x: 0, y: 0 };
  const place = ({ clientX, clientY }: MouseEvent) => {
    const { left, top } = element.getBoundingClientRect();
    return { x: clientX - left, y: clientY - top };
  };
  const release = (keep: boolean) => {
    const isMoved = drag === "handle" && engineOf()?.endTransform(keep);
    // A cancelled drag restores the previous pose, which is also a change.
    if (isMoved || (drag === "handle" && !keep)) posed();
    drag = undefined;
  };
  const touch = createTouch({
    engine: () => {
      const engine = engineOf();
      if (!engine) throw new Error("nothing is open");
      return engine;
    },
    interrupt: () => release(false),
  });
  /**
   * Selects the cage vertex under the pointer and starts to drag the selection. Returns false if there is no vertex.
   */
  const hold = (engine: Engine, event: PointerEvent): boolean => {
    const { x, y } = last;
    const radius = event.pointerType === "touch" ? TOUCH_RADIUS : MOUSE_RADIUS;
    const vertices = engine.bound ? engine.pick(x, y, radius) : new Uint32Array();
    if (vertices.length === 0) return false;
    const selected = new Set(engine.selection());
    if (event.shiftKey) engine.select(vertices, "add");
    else if (!vertices.every((vertex) => selected.has(vertex))) engine.select(vertices, "replace");
    return engine.beginTransform("grab", x, y);
  };

  element.addEventListener("pointerdown", (event) => {
    const engine = engineOf();
    if (!engine || (event.pointerType !== "touch" && event.button !== 0)) return;
    element.setPointerCapture(event.pointerId);
    const at = place(event);
    if (event.pointerType === "touch" && touch.down(event.pointerId, at)) return;
    if (drag) return;
    last = at;
    drag = hold(engine, event) ? "handle" : "orbit";
  });
  element.addEventListener("pointermove", (event) => {
    const engine = engineOf();
    if (!engine) return;
    const at = place(event);
    if (event.pointerType === "touch" && touch.move(event.pointerId, at)) return;
    if (drag === "handle") {
      engine.dragTransform(at.x, at.y);
      posed();
    } else if (drag === "orbit") engine.orbit(at.x - last.x, at.y - last.y);
    else if (engine.bound) {
      const under = engine.pick(at.x, at.y, MOUSE_RADIUS);
      engine.hover(under);
      element.style.cursor = under.length > 0 ? "pointer" : "";
    }
    last = at;
  });
  const up = (keep: boolean) => (event: PointerEvent) => {
    if (!engineOf()) return;
    if (event.pointerType === "touch" && touch.up(event.pointerId)) return;
    release(keep);
  };
  element.addEventListener("pointerup", up(true));
  element.addEventListener("pointercancel", up(false));
  element.addEventListener("pointerleave", () => {
    if (!drag) engineOf()?.hover(new Uint32Array());
  });
  element.addEventListener(
    "wheel",
    (event) => {
      const engine = engineOf();
      if (!engine) return;
      event.preventDefault();
      const step = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? event.deltaY * 33 : event.deltaY;
      const { x, y } = place(event);
      engine.zoomAt(x, y, Math.exp(-step * WHEEL_RATE));
    },
    { passive: false },
  );
  return () => {
    release(false);
    touch.clear();
  };
}
