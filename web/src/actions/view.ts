/** Scene options and camera. */

import { effect } from "@preact/signals";
import type { Element as CageElement, Coordinates, Pivot, SceneOptions } from "../contract";
import { clamped, SCENE_DEFAULTS, SLIDERS } from "../defaults";
import { drawn, elementInUse } from "../derived";
import { follow } from "../queue";
import type { Seen } from "../share";
import { MODEL_STATE, type Slice } from "../state";
import { saveTheme, type Theme } from "../store";
import { T } from "../words";
import type { BindActions } from "./bind";
import { attempt, type Context } from "./context";
import { ofLink } from "./project";

export interface View {
  scene(patch: Partial<SceneOptions>): void;
  /** Applies scene options, camera and selection of a link. */
  show(seen: Seen): void;
  theme(theme: Theme): void;
  slice(patch: Partial<Omit<Slice, "busy">>, kind?: SceneOptions["slice"]): void;
  /** Compares coordinates side by side. A single kind ends the comparison. */
  compare(kinds: readonly Coordinates[]): Promise<void>;
  frameAll(): void;
  frameSelection(): void;
  axis(axis: 0 | 1 | 2, negative: boolean): void;
  ortho(): void;
  symmetry(on: boolean): void;
  proportional(on: boolean, radius?: number): void;
  element(element: CageElement): void;
  pivot(pivot: Pivot): void;
  gizmo(gizmo: SceneOptions["gizmo"]): void;
  /** Shows the model at rest while Space is held. */
  original(on: boolean): void;
  /** Updates the scene after the cage has changed. */
  refresh(): void;
  /** Passes the size of the view and of what covers it to the session. Set at startup. */
  resized: () => void;
}

/** Pause after the last movement of a slice before it is computed, ms. A slider sends many positions. */
const SLICE_PAUSE_MS = 90;

/**
 * Whether these kinds are shown side by side, which takes at least two. Kinds other than harmonic are never shown
 * alone, because gestures act on the shape by harmonic coordinates.
 */
export function isComparison(kinds: readonly Coordinates[]): boolean {
  return kinds.length > 1;
}

export function createView(
  ctx: Context,
  prepareCompare: BindActions["prepareCompare"],
  dark: MediaQueryList,
): View {
  const { store } = ctx;
  const engine = () => ctx.session().engine;
  let sliceTimer: ReturnType<typeof setTimeout> | undefined;

  const scene = (patch: Partial<SceneOptions>) => {
    const next = { ...store.get().scene, ...patch };
    store.set({ scene: next });
    engine().setScene(drawn(store.get()));
    store.set({ legend: engine().legend() ?? null });
  };

  const shown = (theme: Theme): "light" | "dark" =>
    theme === "auto" ? (dark.matches ? "dark" : "light") : theme;

  const theme = (choice: Theme) => {
    if (choice === "auto") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = choice;
    saveTheme(choice);
    store.set({ theme: choice });
    scene({ theme: shown(choice) });
  };
  dark.addEventListener("change", () => {
    if (store.get().theme === "auto") scene({ theme: shown("auto") });
  });

  let engineElement: CageElement = MODEL_STATE.element;
  effect(() => {
    const element = elementInUse(store.get());
    if (element === engineElement) return;
    engineElement = element;
    engine().setElement(element);
  });

  const loadSlice = async (signal: AbortSignal) => {
    const { slice, scene: now, bindOptions, cage } = store.get();
    if (now.slice === "off" || !cage?.usable) return;
    store.set({ slice: { ...slice, busy: true } });
    try {
      await follow(signal, ctx.session().loadSlice(slice.axis, slice.position, bindOptions.grid));
    } finally {
      store.set({ slice: { ...store.get().slice, busy: false } });
      scene({});
    }
  };

  return {
    scene,
    show(seen) {
      const next = { ...store.get().scene, ...ofLink({ ...SCENE_DEFAULTS, ...seen.scene }) };
      engine().setScene(next);
      engine().setCamera(seen.camera);
      engine().select(Uint32Array.from(seen.selected), "replace");
      store.set({ ortho: seen.camera.parallel });
      scene(next);
    },
    theme,
    slice(patch, kind) {
      store.set({ slice: { ...store.get().slice, ...patch } });
      if (kind !== undefined) scene({ slice: kind });
      clearTimeout(sliceTimer);
      const load = () => ctx.queue.replace("slice", loadSlice);
      sliceTimer = setTimeout(() => void attempt(ctx, T.failed.slice, load), SLICE_PAUSE_MS);
    },
    async compare(kinds) {
      const next = isComparison(kinds) && (await prepareCompare(kinds)) ? kinds : SCENE_DEFAULTS.compare;
      if (String(store.get().scene.compare) !== String(next)) scene({ compare: [...next] });
    },
    frameAll: () => engine().frameAll(),
    frameSelection: () => engine().frameSelection(),
    axis: (axis, negative) => engine().axisView(axis, negative),
    ortho: () => store.set({ ortho: engine().toggleOrtho() }),
    symmetry(on) {
      engine().setSymmetry(on);
      store.set({ symmetry: on, unmatched: on && store.get().cage ? engine().unmatched().length : 0 });
    },
    proportional(on, radius) {
      const next = clamped(radius ?? store.get().proportional, SLIDERS.proportional);
      engine().setProportional(on ? next : 0);
      store.set({ proportionalOn: on, proportional: next });
    },
    element(element) {
      store.set({ element });
      // Pull mode selects only vertices. Choosing edges or faces ends it, unless the cage is being reshaped.
      if (elementInUse(store.get()) !== element) scene({ pull: false });
    },
    pivot(pivot) {
      engine().setPivot(pivot);
      store.set({ pivot });
    },
    gizmo: (gizmo) => scene({ gizmo, pull: false }),
    original(on) {
      if (store.get().scene.original !== on) scene({ original: on });
    },
    refresh() {
      scene({});
      const { symmetry, cage } = store.get();
      store.set({ unmatched: symmetry && cage ? engine().unmatched().length : 0 });
    },
    resized: () => undefined,
  };
}
