/** Mirrors the document: updates the keys of the state whose values Rust determines. */

import { attempt, type Context } from "./actions/context";
import type { Check, View } from "./contract";
import { SCENE_DEFAULTS } from "./defaults";
import { type CageSettings, cageKey, cageSettings } from "./derived";
import { follow } from "./queue";
import type { AppState } from "./state";
import { T } from "./words";

/** Number of checks kept for cages that undo may restore. */
const KEPT_CHECKS = 32;

export interface DocumentMirror {
  /** Updates the state after a change of the document. */
  take(view: View): void;
  /** Stores and shows the result of a check. Cancels a check in progress. */
  know(check: Check): void;
  /** Keeps the settings of the current cage, by default those of the panel; undo of a later cage shows them again. */
  made(settings?: CageSettings): void;
  /** Resolves when the current cage has been checked. */
  checked(): Promise<unknown>;
}

export function followDocument(ctx: Context): DocumentMirror {
  const { store } = ctx;
  const engine = () => ctx.session().engine;
  /** Finished checks, by the `keyOf` of models and cage. */
  const checks = new Map<string, Check>();
  /** Settings of generated cages, by the key of the cage. */
  const settings = new Map<number, CageSettings>();
  let shown: View | undefined;
  let checking: Promise<unknown> = Promise.resolve();

  const know = (check: Check) => {
    ctx.queue.cancel("check");
    checks.set(keyOf(shown), check);
    const [oldest] = checks.keys();
    if (checks.size > KEPT_CHECKS && oldest !== undefined) checks.delete(oldest);
    engine().showFaults(check.vertices, check.edges, check.faces, check.points, check.outside);
    store.set({ check });
  };

  const startCheck = () =>
    attempt(ctx, T.failed.check, () =>
      ctx.queue.replace("check", async (signal) => {
        // Wait for the current task to end: an opened cage may come with its check, and taking that cancels this job.
        await new Promise((resolve) => setTimeout(resolve));
        if (!signal.aborted) know(await follow(signal, ctx.session().checkCage()));
      }),
    );

  const modelPatch = (): Partial<AppState> => {
    const { model, cageClip } = store.get();
    const info = engine().modelInfo();
    // The name of a single model may be that of its sample or file. Keep it.
    const isAlone = info.members.length === 1 && model?.members.length === 1;
    const notices = [...new Set([...(model?.notices ?? []), ...info.notices])];
    return {
      model: {
        ...info,
        name: isAlone ? model.name : T.models.several(info.name, info.members.length - 1),
        notices,
      },
      cageClip: info.clips.some(({ name }) => name === cageClip) ? cageClip : null,
    };
  };

  /** The settings of the cage, if it was made before. */
  const settingsPatch = ({ cage }: View): Partial<AppState> => {
    const of = settings.get(cage);
    return of ? { ...of, cageMade: cageKey(of) } : {};
  };

  /** Values of state keys for another cage, or for the same cage around other models. */
  const cagePatch = (view: View): Partial<AppState> => ({
    cage: engine().cageState() ?? null,
    check: checks.get(keyOf(view)) ?? null,
    pullReady: false,
    report: null,
    earlier: [],
    scene: { ...store.get().scene, compare: SCENE_DEFAULTS.compare, slice: "off" },
  });

  return {
    know,
    made(of = cageSettings(store.get())) {
      if (shown) settings.set(shown.cage, of);
      store.set({ cageMade: cageKey(of) });
    },
    checked: () => checking,
    take(view) {
      const before = shown;
      const old = store.get();
      const isOther = keyOf(view) !== keyOf(before);
      // A bind in progress is for the previous models or cage.
      if (isOther) ctx.queue.cancel("bind");
      shown = view;
      const isNewlyBound = view.bound && (isOther || !before?.bound);
      const hasOtherColours =
        isOther || view.bound !== before?.bound || view.selected.last !== before.selected.last;
      const { models, mesh: _, cage: __, undo, redo, forgotten, ...same } = view;
      store.set({
        ...same,
        poses: unchanged(old.poses, view.poses),
        shares: unchanged(old.shares, view.shares),
        transition: unchanged(old.transition, view.transition),
        pins: unchanged(old.pins, view.pins),
        // Edges and faces can be selected only while the cage is reshaped.
        ...(old.editingRest && !view.editingRest ? { element: "vertex" } : {}),
        selected: unchanged(old.selected, view.selected),
        undoLabel: undo,
        redoLabel: redo,
        ...(models === (before?.models ?? 0) ? {} : modelPatch()),
        ...(isOther ? cagePatch(view) : {}),
        ...(view.cage === before?.cage ? {} : settingsPatch(view)),
        ...(isNewlyBound ? { report: engine().boundReport() ?? null } : {}),
        ...(hasOtherColours ? { legend: engine().legend() ?? null } : {}),
      });
      if (forgotten > 0 && !before?.forgotten) ctx.tell.say(T.did.forgotten);
      if (!isOther) return;
      const { cage, check } = store.get();
      if (check) know(check);
      else if (cage) checking = startCheck();
      else ctx.queue.cancel("check");
    },
  };
}

const keyOf = (view: View | undefined) => `${view?.mesh ?? 0} ${view?.cage ?? 0}`;

/** Returns the old value if the new one is equal, so that panels that show it are not rendered again. */
function unchanged<T>(old: T, value: T): T {
  return JSON.stringify(old) === JSON.stringify(value) ? old : value;
}
