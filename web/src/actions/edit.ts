/**
 * Moves vertices of the cage and reshapes it. A gesture changes the cage live and becomes one undo step when it ends.
 */

import { nextAmount } from "../amount";
import type { Command, Gesture, GestureView, GizmoPart, RestEdit } from "../contract";
import { decimals } from "../format";
import { T } from "../words";
import { type Context, report } from "./context";

/** Longest interval between two presses of arrow keys that become one undo step, or belong to one pull, ms. */
export const NUDGE_PAUSE_MS = 600;

export function createEdit(ctx: Context) {
  const { store, engine } = ctx;
  /** Name of the gesture in progress, which the label of its undo step contains. */
  let verb: string | undefined;
  let typed = "";
  let nudging: ReturnType<typeof setTimeout> | undefined;

  /** Adds an undo step with the changes of a finished gesture. */
  const keep = (label: string) => {
    if (!store.get().editingRest) {
      engine().commit(label);
      return;
    }
    try {
      engine().apply({ do: "move_rest" }, T.did.ofCage(label));
    } catch (error) {
      engine().revert();
      report(ctx, T.failed.shape, error);
    }
  };

  const others: (() => void)[] = [];
  const settle = () => {
    for (const write of others) write();
    if (nudging === undefined) return;
    clearTimeout(nudging);
    nudging = undefined;
    keep(T.did.vertices(T.did.nudge, store.get().selected.count));
  };

  const step = (work: () => void, failed: string): boolean => {
    settle();
    try {
      work();
      return true;
    } catch (error) {
      report(ctx, failed, error);
      return false;
    }
  };
  const apply = (command: Command, label: string, failed = T.failed.edit(label)): boolean =>
    step(() => engine().apply(command, label), failed);

  const start = (name: string, begin: () => boolean): boolean => {
    if (verb !== undefined || store.get().playing) return false;
    settle();
    typed = "";
    if (!begin()) return false;
    verb = name;
    showLabel();
    return true;
  };

  /** Shows the gesture's label and, while reshaping, how many sampled vertices are outside the cage. */
  const showLabel = () => {
    const view = engine().gestureView();
    const label = view ? sayGesture(view) : "";
    store.set({
      gesture: typed === "" ? label : `${label}  [${typed}]`,
      strays: store.get().editingRest ? engine().strays() : 0,
    });
  };

  return {
    /** Starts a gesture at a point of the view. False if nothing is selected, or during a gesture or animation. */
    begin: (gesture: Gesture, x: number, y: number): boolean =>
      start(T.did[gesture], () => engine().beginTransform(gesture, x, y)),
    beginGizmo(part: GizmoPart, x: number, y: number): boolean {
      const { gizmo } = store.get().scene;
      const name = gizmo === "rotate" || gizmo === "scale" ? T.did[gizmo] : T.did.grab;
      return start(name, () => engine().beginGizmo(part, x, y));
    },
    drag(x: number, y: number) {
      engine().dragTransform(x, y);
      showLabel();
    },
    constrain(axis: 0 | 1 | 2, plane: boolean) {
      engine().constrain(axis, plane);
      showLabel();
    },
    /** Handles a key as part of the gesture's amount, such as "-0.5". Returns false for other keys. */
    type(key: string): boolean {
      const next = nextAmount(typed, key);
      if (next === undefined) return false;
      typed = next;
      const amount = Number(typed);
      engine().typeTransform(typed === "" || Number.isNaN(amount) ? undefined : amount);
      showLabel();
      return true;
    },
    end(keepIt: boolean) {
      if (verb === undefined) return;
      const label = T.did.vertices(verb, store.get().selected.count);
      verb = undefined;
      const moved = engine().endTransform(keepIt);
      store.set({ gesture: null, strays: 0 });
      if (moved) keep(label);
    },
    active: (): boolean => verb !== undefined,
    nudge(right: number, up: number) {
      if (!engine().nudge(right, up)) return;
      clearTimeout(nudging);
      nudging = setTimeout(settle, NUDGE_PAUSE_MS);
    },
    /** Adds the pending undo step of nudges or of a released pull, and ends an animation. */
    settle,
    /** Adds a function that `settle` calls. */
    alsoSettles: (write: () => void) => others.push(write),
    moveTo(x: number, y: number, z: number) {
      settle();
      if (engine().moveSelectionTo(x, y, z)) keep(T.did.type);
    },
    /**
     * Runs a command as one undo step. If it throws, shows the error under the title `failed`. Returns whether the
     * command succeeded.
     */
    apply,
    /** Like `apply`, for a method of the engine that adds an undo step itself. */
    step,
    restEdit: (edit: RestEdit) => void apply({ do: "edit_rest", edit }, T.did.edits[edit]),
    /** Turns reshaping of the cage on or off. Calls `settle` first. */
    setEditingRest(on: boolean) {
      settle();
      if (store.get().editingRest !== on) engine().setEditingRest(on, T.did.reset);
    },
  };
}

export type Edit = ReturnType<typeof createEdit>;

/** Formats the status line of a gesture, such as "Move 0.25 along X". */
export function sayGesture({ kind, amounts, axis, plane }: GestureView): string {
  const by = amounts.map(decimals).join(", ");
  const what = T.gesture[kind](amounts.length > 1 ? `(${by})` : by);
  if (axis === null) return what;
  if (kind === "rotate") return T.gesture.around(what, T.axes[axis] ?? "");
  if (!plane) return T.gesture.along(what, T.axes[axis] ?? "");
  return T.gesture.within(what, `${T.axes[(axis + 1) % 3]}${T.axes[(axis + 2) % 3]}`);
}
