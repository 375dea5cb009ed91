/** Mouse, pen and single-finger input on the view. `press` decides what a drag does. */

import { createTouch } from "@cagework/core/session/touch";
import type { App } from "../app";
import type { GizmoPart, SelectMode } from "../contract";
import { asksToPull } from "../derived";
import type { Stage } from "../ui/viewport";

/** Movement of the pointer above which a press is a drag instead of a click, CSS pixels. */
const SLOP = 4;
/** Duration of a long press, which pins the model under the finger or removes the pin there, ms. */
const LONG_PRESS_MS = 500;
/** Distance from a handle of the cage or the gizmo within which a press grabs it, CSS pixels. */
const MOUSE_RADIUS = 10;
const TOUCH_RADIUS = 24;
/** Logarithm of the zoom factor per wheel unit. A wheel notch is about 100 units, which enlarges the view by 16 %. */
const WHEEL_RATE = 0.0015;
/**
 * Logarithm of the zoom factor per unit of a trackpad pinch. Browsers send pinches as wheel events with Ctrl and much
 * smaller amounts.
 */
const PINCH_RATE = 0.01;

type Drag =
  | { kind: "orbit" | "pan" | "zoom" }
  | { kind: "handle"; started: boolean; vertices: Uint32Array; mode: SelectMode; was: boolean; bare: boolean }
  | { kind: "pull"; started: boolean }
  | { kind: "pin" }
  | { kind: "place" }
  | { kind: "paint" }
  | { kind: "gizmo" }
  | { kind: "box"; mode: SelectMode };

/** A position in the view, CSS pixels. */
interface Point {
  readonly x: number;
  readonly y: number;
}

export function attachPointer(stage: Stage, app: App): void {
  const { viewport } = stage;
  const { store, edit, pull, controls, painting } = app;
  const { engine } = app.ctx;
  const ready = () => store.get().busy === null && store.get().model !== null;
  let drag: Drag | undefined;
  let start = { x: 0, y: 0 };
  let last = { x: 0, y: 0 };
  let moved = false;
  let pointer: Point = { x: 0, y: 0 };
  let hoverFrame = 0;
  let longPress: ReturnType<typeof setTimeout> | undefined;

  const place = (event: { clientX: number; clientY: number }) => {
    const box = viewport.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  const radiusOf = (event: PointerEvent) => (event.pointerType === "touch" ? TOUCH_RADIUS : MOUSE_RADIUS);

  const takeGizmo = (part: GizmoPart, at: Point) => {
    app.clips.pause();
    return edit.beginGizmo(part, at.x, at.y);
  };

  const press = (event: PointerEvent, at: Point): Drag => {
    const { altKey, button, shiftKey } = event;
    const { placing, painting: painted, boxArmed, cage, scene } = store.get();
    const mod = event.ctrlKey || event.metaKey;
    const adds = shiftKey || store.get().additive;
    if (altKey && button !== 0) return { kind: button === 1 ? "pan" : "zoom" };
    if (button !== 0) return { kind: "pan" };
    if (placing) return { kind: "place" };
    if (painted) {
      const isOnModel = !altKey && painting.begin(at.x, at.y);
      return { kind: isOnModel ? "paint" : shiftKey ? "pan" : "orbit" };
    }
    const hasHandles = cage !== null && scene.cage;
    const isOnHandle = () => hasHandles && engine().pick(at.x, at.y, MOUSE_RADIUS).length > 0;
    if (altKey && !isOnHandle()) return { kind: "orbit" };
    if (boxArmed) return { kind: "box", mode: adds ? "add" : mod ? "remove" : "replace" };
    if (hasHandles) {
      // A vertex under the finger takes precedence over a nearby gizmo.
      const part = engine().gizmoAt(at.x, at.y, isOnHandle() ? MOUSE_RADIUS : radiusOf(event));
      if (part !== undefined && takeGizmo(part, at)) return { kind: "gizmo" };
      // A finger on the model pulls the model, unless a handle is closer to the finger than MOUSE_RADIUS. While the page
      // asks the user to pull, a handle beside the indicated point must not be taken instead.
      const isOnModel = scene.pull && pull.hover(at.x, at.y);
      const isAsked = isOnModel && event.pointerType === "touch" && asksToPull(store.get());
      const vertices = engine().pick(at.x, at.y, isOnModel ? MOUSE_RADIUS : radiusOf(event));
      if (vertices.length > 0 && !isAsked) {
        const selected = new Set(engine().selection());
        const was = vertices.every((vertex) => selected.has(vertex));
        const mode = adds ? "toggle" : mod ? "remove" : "replace";
        return { kind: "handle", started: false, vertices, mode, was, bare: altKey };
      }
    }
    if (!mod && scene.pull && pull.hover(at.x, at.y)) {
      if (shiftKey) return { kind: "pin" };
      if (event.pointerType === "touch") {
        longPress = setTimeout(() => {
          if (drag?.kind !== "pull" || moved) return;
          drag = undefined;
          pull.pin(start.x, start.y);
        }, LONG_PRESS_MS);
      }
      return { kind: "pull", started: false };
    }
    if (mod) return { kind: "box", mode: shiftKey ? "add" : "replace" };
    return { kind: shiftKey ? "pan" : "orbit" };
  };

  const move = (at: Point) => {
    const dx = at.x - last.x;
    const dy = at.y - last.y;
    last = at;
    if (!drag) return;
    switch (drag.kind) {
      case "orbit":
      case "place":
        engine().orbit(dx, dy);
        break;
      case "pan":
        engine().pan(dx, dy);
        break;
      case "zoom":
        engine().zoomAt(start.x, start.y, Math.exp((dx - dy) * 0.008));
        break;
      case "box":
        stage.band(rectangle(start, at));
        break;
      case "gizmo":
        edit.drag(at.x, at.y);
        break;
      case "handle":
        if (!drag.started && moved) {
          app.clips.pause();
          if (!drag.was || drag.mode === "replace") {
            if (!drag.was) engine().select(drag.vertices, drag.mode === "toggle" ? "add" : "replace");
          }
          const [vertex = 0] = drag.vertices;
          const { scene, tools } = store.get();
          const isOne = drag.vertices.length === 1 && engine().selection().length === 1;
          // A single handle is pulled like a point of the model, except with Alt, proportional editing or mirroring.
          if (scene.pull && isOne && !drag.bare && !tools.proportionalOn && !tools.symmetry) {
            if (pull.beginCage(vertex, start.x, start.y)) {
              drag = { kind: "pull", started: true };
              pull.drag(at.x, at.y);
              break;
            }
          }
          drag.started = edit.begin("grab", start.x, start.y);
        }
        if (drag.started) edit.drag(at.x, at.y);
        break;
      case "pull":
        clearTimeout(longPress);
        drag.started ||= pull.begin(start.x, start.y);
        if (drag.started) pull.drag(at.x, at.y);
        break;
      case "paint":
        painting.drag(at.x, at.y);
        break;
      case "pin":
        engine().pan(dx, dy);
        break;
      default:
        drag satisfies never;
    }
  };

  /** Clears the selection after a click that hit nothing. */
  const selectNothing = () => {
    if (store.get().cage) engine().select(new Uint32Array(), "replace");
  };

  const release = (at: Point, keep: boolean) => {
    const ended = drag;
    drag = undefined;
    if (!ended) return;
    switch (ended.kind) {
      case "gizmo":
        edit.end(keep);
        break;
      case "handle":
        if (ended.started) edit.end(keep);
        else if (keep) engine().select(ended.vertices, ended.mode);
        break;
      case "pull":
        clearTimeout(longPress);
        if (ended.started) pull.end(keep);
        else if (keep) selectNothing();
        break;
      case "pin":
        if (keep && !moved) pull.pin(start.x, start.y);
        break;
      case "paint":
        painting.end(keep);
        break;
      case "place":
        if (keep && !moved) controls.place(start.x, start.y);
        break;
      case "box": {
        stage.band(null);
        store.set({ boxArmed: false });
        if (!keep || !moved) break;
        const box = rectangle(start, at);
        engine().selectBox(box.x, box.y, box.x + box.width, box.y + box.height, ended.mode);
        break;
      }
      case "orbit":
        if (keep && !moved) selectNothing();
        break;
      case "pan":
      case "zoom":
        break;
      default:
        ended satisfies never;
    }
  };

  const touch = createTouch({
    engine,
    interrupt() {
      release(last, false);
      pull.leave();
    },
  });

  viewport.addEventListener("pointerdown", (event) => {
    if (!ready()) return;
    viewport.focus({ preventScroll: true, focusVisible: false } as FocusOptions);
    const at = place(event);
    pointer = at;
    // After G, R or S the selection follows the pointer without a button. A left click keeps the change, a right click
    // reverts it.
    if (edit.active() && !drag) {
      edit.end(event.button !== 2);
      return;
    }
    app.poses.stop();
    viewport.setPointerCapture(event.pointerId);
    if (event.pointerType === "touch" && touch.down(event.pointerId, at)) return;
    if (drag) return;
    start = at;
    last = at;
    moved = false;
    drag = press(event, at);
  });

  viewport.addEventListener("pointermove", (event) => {
    if (!ready()) return;
    const at = place(event);
    pointer = at;
    if (event.pointerType === "touch" && touch.move(event.pointerId, at)) return;
    if (drag) {
      moved ||= Math.hypot(at.x - start.x, at.y - start.y) > SLOP;
      if (moved) move(at);
    } else if (edit.active()) {
      edit.drag(at.x, at.y);
    } else if (event.pointerType !== "touch" && hoverFrame === 0 && store.get().cage) {
      hoverFrame = requestAnimationFrame(() => {
        hoverFrame = 0;
        if (!drag && ready() && store.get().placing) {
          controls.hover(pointer.x, pointer.y);
        } else if (!drag && ready() && store.get().cage && !store.get().painting) {
          const under = engine().pick(pointer.x, pointer.y, MOUSE_RADIUS);
          engine().hover(under);
          store.set({ hoversAlone: under.length === 1 && engine().movesAlone(under[0] ?? 0) });
          const isOver = under.length > 0;
          const { pull: canPull } = store.get().scene;
          const isHeld = !isOver && canPull && !event.altKey && pull.hover(pointer.x, pointer.y);
          viewport.toggleAttribute("data-over", isOver || isHeld);
        }
      });
    }
  });

  const up = (event: PointerEvent, keep: boolean) => {
    if (event.pointerType === "touch" && touch.up(event.pointerId)) return;
    release(place(event), keep);
    // After a finger is lifted, no point of the model is hovered.
    if (event.pointerType === "touch") pull.leave();
  };
  viewport.addEventListener("pointerup", (event) => up(event, true));
  viewport.addEventListener("pointercancel", (event) => up(event, false));
  // The clicks before have selected a vertex or an edge.
  viewport.addEventListener("dblclick", (event) => {
    const { cage, scene, placing, painting: painted, gesture } = store.get();
    if (!ready() || !cage || !scene.cage || placing || painted || gesture !== null) return;
    const at = place(event);
    const vertices = engine().pick(at.x, at.y, MOUSE_RADIUS);
    const mode = event.shiftKey || store.get().additive ? "add" : "replace";
    if (vertices.length > 0) engine().selectRing(vertices, mode);
  });
  viewport.addEventListener("pointerleave", () => {
    if (drag || !store.get().cage) return;
    engine().hover(new Uint32Array());
    pull.leave();
  });
  viewport.addEventListener("contextmenu", (event) => event.preventDefault());
  viewport.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      if (!ready()) return;
      const step = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? event.deltaY * 33 : event.deltaY;
      if (pull.active()) {
        pull.reach(Math.exp(-step * WHEEL_RATE));
        return;
      }
      if (edit.active() && store.get().tools.proportionalOn) {
        app.view.tools({ proportional: store.get().tools.proportional * Math.exp(-step * WHEEL_RATE) });
        edit.drag(pointer.x, pointer.y);
        return;
      }
      const at = place(event);
      engine().zoomAt(at.x, at.y, Math.exp(-step * (event.ctrlKey ? PINCH_RATE : WHEEL_RATE)));
    },
    { passive: false },
  );

  app.pointer = () => pointer;
}

/** Returns the rectangle with these opposite corners. */
export function rectangle(a: Point, b: Point) {
  return {
    x: Math.min(a.x, b.x),
    y: Math.min(a.y, b.y),
    width: Math.abs(a.x - b.x),
    height: Math.abs(a.y - b.y),
  };
}
