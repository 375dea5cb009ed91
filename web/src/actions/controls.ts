/** Controls inside the cage: points, bones and sheets, put there by clicks. Each change is one step of the history. */

import type { InnerKind, NamedFile } from "../contract";
import type { SharedControls } from "../share";
import { T } from "../words";
import type { CageActions } from "./cage";
import { attempt, type Context } from "./context";
import type { Edit } from "./edit";

export type Place = readonly [x: number, y: number, z: number];

export interface ControlActions {
  /** Adds a point, a bone through places, or a sheet between them; false when it does not fit. */
  add(kind: InnerKind, places: readonly Place[]): boolean;
  /** Adds a sheet around a place, as large as fits, turned to the eye. */
  addSheet(center: Place): boolean;
  /** Reads controls from an OBJ file: points (p), bones (l), sheets (f). They take the place of those there are. */
  load(files: readonly NamedFile[]): Promise<boolean>;
  /** Radius of points and bones, object units; null for a share of the cage. */
  setRadius(radius: number | null): boolean;
  /** Takes what is selected of them away. */
  remove(): boolean;
  clear(): boolean;
  /** What clicks put there; null for nothing. The cage is shown at rest meanwhile. */
  arm(kind: InnerKind | null): void;
  /** A click while something is armed. */
  place(x: number, y: number): void;
  /** Shows where a click would put it. */
  hover(x: number, y: number): void;
  /** Ends the bone, and what is armed. */
  finish(): void;
  /** For a link. */
  shared(): SharedControls | undefined;
  takeShared(shared: SharedControls): void;
}

/** A second click so near to the last one ends a bone, CSS pixels. */
const SAME_PX = 6;

export function createControls(
  ctx: Context,
  cage: Pick<CageActions, "adopt" | "change">,
  edit: Pick<Edit, "setEditingRest" | "settle" | "sync">,
): ControlActions {
  const { store } = ctx;
  const engine = () => ctx.session().engine;
  /** Corners of the bone that is being drawn, and where the last click was. */
  let places: Place[] = [];
  let last: { readonly x: number; readonly y: number } | undefined;

  const middle = (x: number, y: number): Place => {
    const [a = 0, b = 0, c = 0] = engine().middleAt(x, y);
    return [a, b, c];
  };
  const show = (all: readonly Place[]) => engine().showPlaced(Float32Array.from(all.flat()));
  const change: typeof cage.change = (...what) => {
    edit.settle();
    const went = cage.change(...what);
    edit.sync();
    return went;
  };

  const actions: ControlActions = {
    add: (kind, at) =>
      change(T.did.controls[kind], () => engine().addControl(kind, Float32Array.from(at.flat()))),
    addSheet: (center) => change(T.did.controls.face, () => engine().addSheet(Float32Array.from(center))),
    load: (files) =>
      attempt(ctx, T.failed.controlsFile, async () => {
        const bytes = await files[0]?.file.arrayBuffer();
        const read = (bytes: ArrayBuffer) => () => engine().readControls(new Uint8Array(bytes));
        if (bytes) change(T.did.loadControls, read(bytes), T.failed.controlsFile);
      }),
    setRadius: (radius) => change(T.did.radius, () => engine().setRadius(radius ?? undefined)),
    remove: () => change(T.did.removeControls, () => engine().editRest("delete_vertex")),
    clear() {
      const { vertices = 0 } = store.get().cage?.info ?? {};
      const all = Uint32Array.from({ length: store.get().cage?.controls.inner ?? 0 }, (_, k) => vertices + k);
      engine().select(all, "replace");
      return actions.remove();
    },
    arm(kind) {
      places = [];
      last = undefined;
      show([]);
      if (kind) edit.setEditingRest(true);
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
      const inner =
        controls.inner > 0
          ? engine()
              .restPositions()
              .slice(-3 * controls.inner)
          : [];
      return { controls, inner: Array.from(inner, (x) => Math.fround(x)) };
    },
    takeShared({ controls, inner }) {
      const positions = Float32Array.from([...engine().restPositions(), ...inner]);
      const { sampleCage } = store.get();
      cage.adopt(
        ctx.session().takeCage({ positions, corners: engine().cageCorners(), controls, check: null }),
        null,
      );
      store.set({ sampleCage });
    },
  };
  return actions;
}
