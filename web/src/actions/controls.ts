/** Inner controls of the cage: points, bones and sheets, added by clicks. Each change is one undo step. */

import type { Command, InnerKind, NamedFile, Session } from "../contract";
import { triples } from "../points";
import type { SharedControls } from "../share";
import { T } from "../words";
import type { CageActions } from "./cage";
import { attempt, type Context } from "./context";
import type { Edit } from "./edit";

export type Place = readonly [x: number, y: number, z: number];

/** Maximum distance between two clicks, CSS pixels, at which the second click ends the bone. */
const MAX_CLICK_DISTANCE_PX = 6;

export function createControls(
  ctx: Context,
  change: CageActions["change"],
  setEditingRest: Edit["setEditingRest"],
) {
  const { store, engine } = ctx;
  /** Points of the bone that is being drawn. */
  let places: Place[] = [];
  /** Position of the last click, CSS pixels. */
  let last: { readonly x: number; readonly y: number } | undefined;

  const middle = (x: number, y: number): Place => {
    const [a = 0, b = 0, c = 0] = engine().middleAt(x, y);
    return [a, b, c];
  };
  const show = (all: readonly Place[]) => engine().showPlaced(Float32Array.from(all.flat()));
  const remove = (command: Command) => change(T.did.removeControls, command);

  const actions = {
    /**
     * Adds a point, a bone through `places`, or a sheet with corners at `places`. Returns false if the control does not
     * fit into the cage.
     */
    add: (kind: InnerKind, places: readonly Place[]): boolean =>
      change(T.did.controls[kind], { do: "add_control", kind, places }),
    /** Adds a sheet centred at a point. The sheet faces the camera and is as large as will fit in the cage. */
    addSheet(center: Place): boolean {
      const label = T.did.controls.face;
      return change(label, () => engine().addSheet(Float32Array.from(center), label));
    },
    /** Replaces the inner controls by those of an OBJ file: points (p), bones (l), sheets (f). */
    load: (files: readonly NamedFile[]): Promise<boolean> =>
      attempt(ctx, T.failed.controlsFile, async () => {
        const bytes = await files[0]?.file.arrayBuffer();
        if (!bytes) return;
        const read = () => engine().readControls(new Uint8Array(bytes), T.did.loadControls);
        change(T.did.loadControls, read, T.failed.controlsFile);
      }),
    /** Sets the radius of points and bones, object units; null for the default, 1/32 of the cage's longest side. */
    setRadius: (radius: number | null): boolean => change(T.did.radius, { do: "set_radius", radius }),
    /** Removes the selected inner controls. */
    remove: (): boolean => remove({ do: "edit_rest", edit: "delete_vertex" }),
    clear: (): boolean => remove({ do: "replace_controls", positions: [], elements: [] }),
    /** Chooses the kind of control that clicks add, and shows the cage at rest. Null ends adding. */
    arm(kind: InnerKind | null) {
      places = [];
      last = undefined;
      show([]);
      if (kind) setEditingRest(true);
      store.set({ placing: kind, boxArmed: false });
    },
    /**
     * Handles a click while a kind of control is chosen: adds a point or sheet there, or extends the bone by a point. A
     * second click at the same position ends the bone.
     */
    place(x: number, y: number) {
      const { placing } = store.get();
      if (!placing || !store.get().cage?.usable) return;
      if (placing === "point") actions.add("point", [middle(x, y)]);
      else if (placing === "face") actions.addSheet(middle(x, y));
      else if (last && Math.hypot(x - last.x, y - last.y) < MAX_CLICK_DISTANCE_PX) {
        actions.finish();
        return;
      } else {
        places.push(middle(x, y));
        last = { x, y };
        show(places);
        return;
      }
      actions.arm(null);
    },
    /** Marks the point that a click at this position would add. */
    hover(x: number, y: number) {
      show([...places, middle(x, y)]);
    },
    /** Adds the bone that is being drawn, and ends adding. */
    finish() {
      const drawn = places;
      actions.arm(null);
      if (drawn.length > 1) actions.add("line", drawn);
    },
    /** Returns smoothing and inner controls for a link; undefined if the cage has neither. */
    shared(): SharedControls | undefined {
      const controls = engine().cageArrays().controls;
      if (controls.smooth === 0 && controls.inner === 0) return undefined;
      const rest = engine().restPositions();
      const inner = rest.slice(rest.length - 3 * controls.inner);
      return { controls, inner: Array.from(inner, (x) => Math.fround(x)) };
    },
    takeShared: (shared: SharedControls) => takeControls(engine(), shared),
  };
  return actions;
}

/** Sets smoothing and inner controls of a link. On an error, changes nothing. */
export function takeControls(engine: Session["engine"], { controls, inner }: SharedControls): void {
  const { smooth, radius, elements } = controls;
  try {
    engine.apply({ do: "subdivide", steps: smooth });
    engine.apply({ do: "set_radius", radius });
    engine.apply({ do: "replace_controls", positions: triples(inner), elements });
    engine.amend();
  } catch (error) {
    engine.revert();
    throw error;
  }
}

export type ControlActions = ReturnType<typeof createControls>;
