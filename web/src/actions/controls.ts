/** Inner controls of the cage: points, bones and sheets, added by clicks. Each change is one undo step. */

import type { Command, InnerKind, NamedFile } from "../contract";
import { triples } from "../points";
import type { SharedControls } from "../share";
import { T } from "../words";
import type { CageActions } from "./cage";
import { attempt, type Context } from "./context";
import type { Edit } from "./edit";

export type Place = readonly [x: number, y: number, z: number];

export interface ControlActions {
  /**
   * Adds a point, a bone through several points, or a sheet between them. Returns false if it does not fit into the
   * cage.
   */
  add(kind: InnerKind, places: readonly Place[]): boolean;
  /** Adds a sheet around a point that faces the camera and is as large as fits. */
  addSheet(center: Place): boolean;
  /** Reads controls from an OBJ file: points (p), bones (l), sheets (f). They replace the existing ones. */
  load(files: readonly NamedFile[]): Promise<boolean>;
  /** Sets the radius of points and bones, object units; null for the default, a share of the cage's size. */
  setRadius(radius: number | null): boolean;
  /** Removes the selected inner controls. */
  remove(): boolean;
  clear(): boolean;
  /** Chooses the kind of control that clicks add, and shows the cage at rest. Null ends adding. */
  arm(kind: InnerKind | null): void;
  /** Handles a click while a kind is chosen. */
  place(x: number, y: number): void;
  /** Marks the point that a click at this position would add. */
  hover(x: number, y: number): void;
  /** Adds the bone that is being drawn, and ends adding. */
  finish(): void;
  /** Smoothing and inner controls for a link; undefined without any. */
  shared(): SharedControls | undefined;
  takeShared(shared: SharedControls): void;
}

/** Maximum distance between two clicks, CSS pixels, at which the second click ends the bone. */
const SAME_PX = 6;

export function createControls(
  ctx: Context,
  change: CageActions["change"],
  setEditingRest: Edit["setEditingRest"],
): ControlActions {
  const { store } = ctx;
  const engine = () => ctx.session().engine;
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

  const actions: ControlActions = {
    add: (kind, places) => change(T.did.controls[kind], { do: "add_control", kind, places }),
    addSheet(center) {
      const label = T.did.controls.face;
      return change(label, () => engine().addSheet(Float32Array.from(center), label));
    },
    load: (files) =>
      attempt(ctx, T.failed.controlsFile, async () => {
        const bytes = await files[0]?.file.arrayBuffer();
        if (!bytes) return;
        const read = () => engine().readControls(new Uint8Array(bytes), T.did.loadControls);
        change(T.did.loadControls, read, T.failed.controlsFile);
      }),
    setRadius: (radius) => change(T.did.radius, { do: "set_radius", radius }),
    remove: () => remove({ do: "edit_rest", edit: "delete_vertex" }),
    clear: () => remove({ do: "replace_controls", positions: [], elements: [] }),
    arm(kind) {
      places = [];
      last = undefined;
      show([]);
      if (kind) setEditingRest(true);
      store.set({ placing: kind, boxArmed: false });
    },
    place(x, y) {
      const { placing } = store.get();
      if (!placing || !store.get().cage?.usable) return;
      if (placing === "point") actions.add("point", [middle(x, y)]);
      else if (placing === "face") actions.addSheet(middle(x, y));
      else if (last && Math.hypot(x - last.x, y - last.y) < SAME_PX) {
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
    hover(x, y) {
      show([...places, middle(x, y)]);
    },
    finish() {
      const drawn = places;
      actions.arm(null);
      if (drawn.length > 1) actions.add("line", drawn);
    },
    shared() {
      const controls = engine().cageControls();
      if (controls.smooth === 0 && controls.inner === 0) return undefined;
      const rest = engine().restPositions();
      const inner = rest.slice(rest.length - 3 * controls.inner);
      return { controls, inner: Array.from(inner, (x) => Math.fround(x)) };
    },
    takeShared({ controls, inner }) {
      const { smooth, radius, elements } = controls;
      try {
        engine().apply({ do: "subdivide", steps: smooth });
        engine().apply({ do: "set_radius", radius });
        engine().apply({ do: "replace_controls", positions: triples(inner), elements });
        engine().amend();
      } catch (error) {
        engine().revert();
        throw error;
      }
    },
  };
  return actions;
}
