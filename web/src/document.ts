/** Mirrors the document, which Rust stores: updates the keys of the state that show it. */

import { attemptLatest, type Context } from "./actions/context";
import type { Problem, View } from "./contract";
import { SCENE_DEFAULTS } from "./defaults";
import { cageKey, cageSettings } from "./derived";
import { follow } from "./queue";
import type { AppState, CageSettings } from "./state";
import { T } from "./words";

/** Number of checks kept for cages that undo may restore. */
const KEPT_CHECKS = 32;

export function followDocument(ctx: Context) {
  const { store, engine } = ctx;
  /** Finished checks, by the `keyOf` of models and cage. */
  const checks = new Map<string, readonly Problem[]>();
  /** Settings with which cages were made, by the key of the cage. */
  const settings = new Map<number, CageSettings>();
  let shown: View | undefined;
  let checking: Promise<unknown> = Promise.resolve();

  const know = (check: readonly Problem[]) => {
    ctx.queue.cancel("check");
    checks.set(keyOf(shown), check);
    const [oldest] = checks.keys();
    if (checks.size > KEPT_CHECKS && oldest !== undefined) checks.delete(oldest);
    engine().showFaults(check);
    store.set({ check });
  };

  const startCheck = () =>
    attemptLatest(ctx, T.failed.check, "check", async (signal) => {
      // Wait for the current task to end: an opened cage may already have a check, and `know` then cancels this job.
      await new Promise((resolve) => setTimeout(resolve));
      if (!signal.aborted) know(await follow(signal, ctx.session().checkCage()));
    });

  const modelPatch = (): Partial<AppState> => {
    const { model, cageClip } = store.get();
    const info = engine().modelInfo();
    // A single model may have the name of its sample or file. Keep this name.
    const isAlone = info.members.length === 1 && model?.members.length === 1;
    const notices = [...new Set([...(model?.notices ?? []), ...info.notices])];
    return {
      humanoid: engine().humanoidInfo() ?? null,
      folds: null,
      model: {
        ...info,
        name: isAlone ? model.name : T.models.several(info.name, info.members.length - 1),
        notices,
      },
      cageClip: info.clips.some(({ name }) => name === cageClip) ? cageClip : null,
    };
  };

  /** The settings with which the document's cage was made, as a change of the state; empty if they are not known. */
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
    folds: null,
    earlier: [],
    scene: { ...store.get().scene, compare: SCENE_DEFAULTS.compare, slice: "off" },
  });

  return {
    /** Stores and shows the result of a check. Cancels a check in progress. */
    know,
    /**
     * Remembers the settings with which the current cage was made, by default those of the panel. When undo returns to
     * this cage, the panel shows them again.
     */
    made(of: CageSettings = cageSettings(store.get())) {
      if (shown) settings.set(shown.cage, of);
      store.set({ cageMade: cageKey(of) });
    },
    /** Resolves when the current cage has been checked. */
    checked: (): Promise<unknown> => checking,
    /** Updates the state after a change of the document. */
    take(view: View) {
      const before = shown;
      const isOther = keyOf(view) !== keyOf(before);
      // A bind in progress is for the previous models or cage.
      if (isOther) ctx.queue.cancel("bind");
      shown = view;
      const isNewlyBound = view.bound && (isOther || !before?.bound);
      const hasOtherColours =
        isOther || view.bound !== before?.bound || view.selected.last !== before.selected.last;
      const { cage: _, ...same } = view;
      store.set({
        ...changed<typeof same>(store.get(), same),
        ...(view.models === (before?.models ?? 0) ? {} : modelPatch()),
        ...(isOther ? cagePatch(view) : {}),
        ...(view.cage === before?.cage ? {} : settingsPatch(view)),
        ...(isNewlyBound ? { report: engine().boundReport() ?? null, folds: null } : {}),
        ...(hasOtherColours ? { legend: engine().legend() ?? null } : {}),
      });
      if (view.forgotten > 0 && !before?.forgotten) ctx.tell.say(T.did.forgotten);
      if (!isOther) return;
      const { cage, check } = store.get();
      if (check) know(check);
      else if (cage) checking = startCheck();
      else ctx.queue.cancel("check");
    },
  };
}

export type DocumentMirror = ReturnType<typeof followDocument>;

const keyOf = (view: View | undefined) => `${view?.mesh ?? 0} ${view?.cage ?? 0}`;

/**
 * Returns the values of `next` that differ from those of `old`. Panels that show only equal values are not rendered
 * again.
 */
function changed<T extends object>(old: T, next: T): Partial<T> {
  const isOther = (key: string) =>
    JSON.stringify(old[key as keyof T]) !== JSON.stringify(next[key as keyof T]);
  return Object.fromEntries(Object.entries(next).filter(([key]) => isOther(key))) as Partial<T>;
}
