/** Moving the cage: gestures, fields, arrows, each one step of the history, in the pose or in the rest cage. */

import { nextAmount } from "../amount";
import type {
  CageState,
  Check,
  CheckedCage,
  Gesture,
  GizmoHandle,
  RestEdit,
  SurfacePoint,
} from "../contract";
import { T } from "../words";
import { type Context, report } from "./context";

export interface Edit {
  /** Begins a gesture at a point; false when nothing is selected. */
  begin(gesture: Gesture, x: number, y: number): boolean;
  beginGizmo(handle: GizmoHandle, x: number, y: number): boolean;
  drag(x: number, y: number): void;
  constrain(axis: 0 | 1 | 2, plane: boolean): void;
  /** A key typed as part of an amount; false when it is not one. */
  type(key: string): boolean;
  end(keep: boolean): void;
  active(): boolean;
  nudge(right: number, up: number): void;
  /** Writes what is still open as a step: a nudge, a pull that comes to rest. */
  settle(): void;
  /** Something else that may be open, and what writes it. */
  alsoSettles(write: () => void): void;
  moveTo(x: number, y: number, z: number): void;
  /** Takes positions, and what they are a blend of, as one step. */
  pose(
    label: string,
    positions: Float32Array,
    shares: readonly number[],
    pins?: readonly SurfacePoint[],
  ): void;
  /** Remembers positions before something that ends with `posedSince`. */
  positions(): Float32Array;
  posedSince(label: string, before: Float32Array, sharesBefore: readonly number[]): void;
  restEdit(edit: RestEdit): void;
  /** Refreshes what the page knows about selection and pose. */
  sync(): void;
  setEditingRest(on: boolean): void;
}

const NUDGE_PAUSE_MS = 600;

/** `adopt` is the page's side of a cage whose shape at rest has changed. */
export function createEdit(ctx: Context, adopt: (state: CageState, check: Check | null) => void): Edit {
  const engine = () => ctx.session().engine;
  let before: Float32Array | undefined;
  let beforeRest: CheckedCage | undefined;
  let verb: string = T.did.grab;
  let typed = "";
  let nudging:
    | { before: Float32Array; beforeRest: CheckedCage; timer: ReturnType<typeof setTimeout> }
    | undefined;

  const restNow = (): CheckedCage => {
    const [positions, corners] = [engine().restPositions(), engine().cageCorners()];
    return { positions, corners, controls: engine().cageControls(), check: ctx.store.get().check };
  };

  const sync = () => {
    const e = engine();
    const hasCage = ctx.store.get().cage !== null;
    const selection = hasCage ? e.selection() : new Uint32Array();
    const center = selection.length > 0 ? e.selectionCenter() : new Float32Array();
    const [x, y, z] = center;
    const rested = hasCage ? e.restPositions() : new Float32Array();
    const moved = hasCage ? e.cagePositions() : new Float32Array();
    ctx.store.set({
      selected: {
        count: selection.length,
        last: hasCage ? e.last() : -1,
        center: x === undefined || y === undefined || z === undefined ? null : [x, y, z],
      },
      posed: !ctx.store.get().editingRest && moved.some((value, i) => value !== rested[i]),
      legend: e.legend() ?? null,
    });
  };

  const setEditingRest = (on: boolean) => {
    if (ctx.store.get().editingRest === on) return;
    engine().setEditingRest(on);
    // Edges and faces are selected for reshaping.
    ctx.store.set({ editingRest: on, ...(on ? {} : { element: "vertex" }) });
    sync();
  };

  const setPose = (positions: Float32Array) => {
    setEditingRest(false);
    engine().setCagePositions(positions);
    sync();
  };

  const setPins = (pins: readonly SurfacePoint[]) => {
    if (pins === ctx.store.get().pins) return;
    ctx.store.set({ pins });
    engine().showHeld([...pins]);
  };

  /** A step from one pose, and the shares of its blend and its pins, to those of the moment. */
  const pushPose = (
    label: string,
    from: Float32Array,
    sharesFrom: readonly number[],
    pinsFrom: readonly SurfacePoint[] = ctx.store.get().pins,
  ) => {
    const to = engine().cagePositions();
    const { shares: sharesTo, pins: pinsTo } = ctx.store.get();
    const set = (positions: Float32Array, shares: readonly number[], pins: readonly SurfacePoint[]) => {
      setPose(positions);
      ctx.store.set({ shares });
      setPins(pins);
    };
    const undo = () => set(from, sharesFrom, pinsFrom);
    ctx.history.push({ label, undo, redo: () => set(to, sharesTo, pinsTo) });
    sync();
  };

  const setRest = (shape: CheckedCage) => {
    adopt(ctx.session().takeCage(shape), shape.check);
    sync();
  };

  const pushRest = (label: string, from: CheckedCage, state: CageState) => {
    const to = { ...restNow(), check: null };
    ctx.history.push({ label, undo: () => setRest(from), redo: () => setRest(to) });
    adopt(state, null);
    sync();
  };

  /** What moved since `from` becomes a step. */
  const keep = (label: string, from: Float32Array, fromRest: CheckedCage) => {
    if (!ctx.store.get().editingRest) {
      // The blend stays; what the hand has moved lies on top of it.
      pushPose(label, from, ctx.store.get().shares);
      return;
    }
    try {
      pushRest(T.did.ofCage(label), fromRest, engine().commitRest());
    } catch (error) {
      engine().setCagePositions(from);
      report(ctx, T.failed.shape, error);
      sync();
    }
  };

  const others: (() => void)[] = [];
  const settle = () => {
    for (const write of others) write();
    if (!nudging) return;
    clearTimeout(nudging.timer);
    const open = nudging;
    nudging = undefined;
    keep(T.did.vertices(T.did.nudge, ctx.store.get().selected.count), open.before, open.beforeRest);
  };

  const remember = () => {
    settle();
    before = engine().cagePositions();
    beforeRest = restNow();
    typed = "";
  };

  /** What the gesture does, and whether the cage that it shapes still encloses the model. */
  const showLabel = (typed = "") => {
    const label = engine().transformLabel();
    const { editingRest } = ctx.store.get();
    ctx.store.set({
      gesture: typed === "" ? label : `${label}  [${typed}]`,
      strays: editingRest ? engine().strays() : 0,
    });
  };

  return {
    begin(gesture, x, y) {
      if (before || ctx.store.get().playing) return false;
      remember();
      if (!engine().beginTransform(gesture, x, y)) {
        before = undefined;
        return false;
      }
      verb = T.did[gesture];
      showLabel();
      return true;
    },
    beginGizmo(handle, x, y) {
      if (before) return false;
      remember();
      if (!engine().beginGizmo(handle, x, y)) {
        before = undefined;
        return false;
      }
      const { gizmo } = ctx.store.get().scene;
      verb = gizmo === "rotate" || gizmo === "scale" ? T.did[gizmo] : T.did.grab;
      showLabel();
      return true;
    },
    drag(x, y) {
      engine().dragTransform(x, y);
      showLabel();
    },
    constrain(axis, plane) {
      engine().constrain(axis, plane);
      showLabel();
    },
    type(key) {
      const next = nextAmount(typed, key);
      if (next === undefined) return false;
      typed = next;
      const amount = Number(typed);
      engine().typeTransform(typed === "" || Number.isNaN(amount) ? undefined : amount);
      showLabel(typed);
      return true;
    },
    end(keepIt) {
      if (!before || !beforeRest) return;
      const from = before;
      const fromRest = beforeRest;
      before = undefined;
      beforeRest = undefined;
      const count = engine().selection().length;
      const moved = engine().endTransform(keepIt);
      ctx.store.set({ gesture: null, strays: 0 });
      if (moved) keep(T.did.vertices(verb, count), from, fromRest);
      else sync();
    },
    active: () => before !== undefined,
    nudge(right, up) {
      const open = nudging ?? { before: engine().cagePositions(), beforeRest: restNow() };
      if (!engine().nudge(right, up)) return;
      if (nudging) clearTimeout(nudging.timer);
      nudging = { ...open, timer: setTimeout(settle, NUDGE_PAUSE_MS) };
      sync();
    },
    settle,
    alsoSettles: (write) => others.push(write),
    moveTo(x, y, z) {
      remember();
      const from = before;
      const fromRest = beforeRest;
      before = undefined;
      if (from && fromRest && engine().moveSelectionTo(x, y, z)) keep(T.did.type, from, fromRest);
    },
    pose(label, positions, shares, pins) {
      settle();
      const from = engine().cagePositions();
      const { shares: before, pins: pinned } = ctx.store.get();
      setPose(positions);
      ctx.store.set({ shares });
      setPins(pins ?? pinned);
      pushPose(label, from, before, pinned);
    },
    positions: () => engine().cagePositions(),
    posedSince: pushPose,
    restEdit(edit) {
      settle();
      const from = restNow();
      try {
        pushRest(T.did.edits[edit], from, engine().editRest(edit));
      } catch (error) {
        report(ctx, T.failed.edit(T.did.edits[edit]), error);
      }
    },
    sync,
    setEditingRest(on) {
      settle();
      const { posed, shares } = ctx.store.get();
      const from = engine().cagePositions();
      setEditingRest(on);
      if (!on || !posed) return;
      // The pose is gone with that; undo brings it back.
      ctx.store.set({ shares: shares.map(() => 0) });
      pushPose(T.did.reset, from, shares);
    },
  };
}
