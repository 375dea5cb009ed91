/** Scene options and camera. */

import { effect, untracked } from "@preact/signals";
import type { Element as CageElement, Coordinates, SceneOptions, Tools } from "../contract";
import { SCENE_DEFAULTS } from "../defaults";
import { drawn, elementInUse } from "../derived";
import { follow } from "../queue";
import type { SharedView } from "../share";
import type { Slice } from "../state";
import { saveTheme, shownTheme, type Theme } from "../store";
import { T } from "../words";
import type { BindActions } from "./bind";
import { attemptLatest, type Context } from "./context";
import { ofLink } from "./project";

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
) {
  const { store, engine } = ctx;
  let sliceTimer: ReturnType<typeof setTimeout> | undefined;

  const scene = (patch: Partial<SceneOptions>) => {
    const next = { ...store.get().scene, ...patch };
    store.set({ scene: next });
    engine().setScene(drawn(store.get()));
    store.set({ legend: engine().legend() ?? null });
  };

  let isOnGround = false;
  // The floor is drawn where exports put it.
  effect(() => {
    const { ground } = drawn(store.get());
    if (ground !== isOnGround) untracked(() => engine().setScene(drawn(store.get())));
    isOnGround = ground;
  });

  const theme = (choice: Theme) => {
    if (choice === "auto") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = choice;
    saveTheme(choice);
    store.set({ theme: choice });
    scene({ theme: shownTheme(choice, dark) });
  };
  dark.addEventListener("change", () => {
    if (store.get().theme === "auto") scene({ theme: shownTheme("auto", dark) });
  });

  const tools = (patch: Partial<Tools>) => engine().setTools({ ...store.get().tools, ...patch });

  const loadSlice = async (signal: AbortSignal) => {
    const { slice, scene: now, bindOptions, report, cage } = store.get();
    if (now.slice === "off" || !cage?.usable) return;
    store.set({ slice: { ...slice, busy: true } });
    try {
      await follow(
        signal,
        ctx.session().loadSlice(slice.axis, slice.position, report?.grid ?? bindOptions.grid),
      );
    } finally {
      store.set({ slice: { ...store.get().slice, busy: false } });
      scene({});
    }
  };

  const setSlice = (patch: Partial<Omit<Slice, "busy">>, kind?: SceneOptions["slice"]) => {
    store.set({ slice: { ...store.get().slice, ...patch } });
    if (kind !== undefined) scene({ slice: kind });
    clearTimeout(sliceTimer);
  };
  const showSlice = () => attemptLatest(ctx, T.failed.slice, "slice", loadSlice);

  return {
    scene,
    /** Applies scene options, camera and selection of a link, but compares no coordinates: that needs the bound model. */
    show(seen: SharedView) {
      const { compare: _, ...shared } = ofLink({ ...SCENE_DEFAULTS, ...seen.scene });
      const next = { ...store.get().scene, ...shared };
      engine().setScene(next);
      engine().setCamera(seen.camera);
      engine().select(Uint32Array.from(seen.selected), "replace");
      store.set({ ortho: seen.camera.parallel });
      scene(next);
    },
    theme,
    slice(patch: Partial<Omit<Slice, "busy">>, kind?: SceneOptions["slice"]) {
      setSlice(patch, kind);
      sliceTimer = setTimeout(() => void showSlice(), SLICE_PAUSE_MS);
    },
    /** Like `slice`, without a pause; resolves when the slice is shown. */
    sliceNow(patch: Partial<Omit<Slice, "busy">>, kind?: SceneOptions["slice"]): Promise<boolean> {
      setSlice(patch, kind);
      return showSlice();
    },
    /** Compares coordinates side by side. A single kind ends the comparison. */
    async compare(kinds: readonly Coordinates[]) {
      const next = isComparison(kinds) && (await prepareCompare(kinds)) ? kinds : SCENE_DEFAULTS.compare;
      if (String(store.get().scene.compare) !== String(next)) scene({ compare: [...next] });
    },
    ortho: () => store.set({ ortho: engine().toggleOrtho() }),
    /** Changes how clicks and gestures act on the cage. */
    tools,
    element(element: CageElement) {
      tools({ element });
      // Pull mode selects only vertices. Choosing edges or faces ends it, unless the cage is being reshaped.
      if (elementInUse(store.get()) !== element) scene({ pull: false });
    },
    gizmo: (gizmo: SceneOptions["gizmo"]) => scene({ gizmo, pull: false }),
    /** Shows the model at rest while Space is held. */
    original(on: boolean) {
      if (store.get().scene.original !== on) scene({ original: on });
    },
    /** Updates the scene after the cage has changed. */
    refresh: () => scene({}),
    /** Passes the size of the view and of what covers it to the session. Set at startup. */
    resized: (): void => undefined,
  };
}

export type View = ReturnType<typeof createView>;
