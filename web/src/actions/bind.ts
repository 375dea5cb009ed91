/** Starts, tracks and cancels binds, and estimates their memory. */

import { effect } from "@preact/signals";
import type { BindEvent, BindOptions, BindReport, Coordinates } from "../contract";
import { cageBroken, drawn } from "../derived";
import { follow } from "../queue";
import type { BindRun } from "../state";
import { messageOf, sentence } from "../strings";
import { T } from "../words";
import { attempt, attemptLatest, type Context } from "./context";

/** Number of earlier reports kept for comparing methods. */
const MAX_EARLIER_REPORTS = 4;

export function createBind(ctx: Context) {
  const { store } = ctx;
  const estimate = () => {
    const { model, cage, bindOptions } = store.get();
    if (!model || !cage?.usable) return;
    try {
      store.set({ memory: ctx.engine().estimateMemory(bindOptions) });
    } catch (error) {
      store.set({ memory: messageOf(error) });
    }
  };
  effect(estimate);

  /** Report of the latest coarse pass, which is excluded from the reports that later binds are compared with. */
  let coarse: BindReport | undefined;
  const adopted = (report: BindReport, pass: BindRun["pass"]) => {
    const { report: last, earlier } = store.get();
    const before = last && last !== coarse ? [last, ...earlier] : earlier;
    if (pass === "coarse") coarse = report;
    store.set({ report, earlier: before.filter((e) => !sameWay(e, report)).slice(0, MAX_EARLIER_REPORTS) });
    const { scene } = store.get();
    if (scene.colour === "material" || scene.colour === "clay") return;
    // Colours of weights or errors may have been chosen before there were weights.
    const engine = ctx.engine();
    engine.setScene(drawn(store.get()));
    store.set({ legend: engine.legend() ?? null });
  };

  const bind = async (revision: number, signal: AbortSignal, options: BindOptions) => {
    const session = ctx.session();
    session.engine.requireCurrent(revision);
    let run: BindRun = start("coarse", revision, options);
    const hear = (event: BindEvent) => {
      switch (event.kind) {
        case "progress": {
          const { kind: _, ...progress } = event;
          const curve = progress.pass === run.pass ? run.curve : [];
          run = { ...run, ...progress, curve: grown(curve, progress.iteration, progress.delta) };
          store.set({ bindRun: run });
          break;
        }
        case "adopted":
          adopted(event.report, event.pass);
          break;
        case "fallback":
          ctx.tell.say(sentence(event.reason));
          break;
        default:
          event satisfies never;
      }
    };
    const report = await follow(signal, session.bind(options, hear));
    adopted(report, "fine");
    store.set({ appliedOptions: options });
    if (!report.converged) ctx.tell.say(T.bind.stopped);
  };

  const actions = {
    /**
     * Binds the model to the cage. Resolves with true if the model is bound afterwards. `unasked`: the page started the
     * bind, not the user, so earlier error messages remain.
     */
    async start(unasked = false, options: BindOptions = store.get().bindOptions): Promise<boolean> {
      if (!store.get().cage || cageBroken(store.get())) return false;
      if (!unasked) ctx.tell.clear();
      const { revision } = ctx.engine();
      store.set({ bindRun: start("coarse", revision, options) });
      const ok = await attemptLatest(ctx, T.failed.bind, "bind", (signal) => bind(revision, signal, options));
      // In the meantime, a bind of another cage may have been queued. It has another revision.
      if (store.get().bindRun?.revision === revision) store.set({ bindRun: null });
      return ok && store.get().bound;
    },
    /** Changes the bind options by `patch` and binds again. */
    again(patch: Partial<BindOptions>): Promise<boolean> {
      actions.setOptions(patch);
      return actions.start();
    },
    cancel() {
      const { bindRun, bound, report } = store.get();
      ctx.queue.cancel("bind");
      if (bindRun && bound && report !== coarse) ctx.tell.say(T.bind.cancelled);
    },
    /** Whether the model is bound to the current cage, is being bound to it, or has cached weights for it. */
    covers(): boolean {
      const { bound, bindRun } = store.get();
      const engine = ctx.engine();
      return bound || engine.hasWeights || bindRun?.revision === engine.revision;
    },
    /** The handle whose weight a picture shows best; 0 before a bind. */
    clearestControl: () => ctx.engine().clearestControl(),
    /** Draws the model with the colours of a weight; undefined if that is not possible now. */
    async drawWeight(width: number, height: number, column: number): Promise<Blob | undefined> {
      if (!store.get().bound) return undefined;
      // The next bind, or an error of the next frame, is reported elsewhere.
      return ctx
        .session()
        .weightPicture(width, height, column)
        .catch(() => undefined);
    },
    setOptions(patch: Partial<BindOptions>) {
      store.set({ bindOptions: { ...store.get().bindOptions, ...patch } });
    },
    /** Computes coordinates of these kinds for comparison, once for each cage. Resolves with false on failure. */
    async prepareCompare(kinds: readonly Coordinates[]): Promise<boolean> {
      for (const kind of kinds) {
        if (kind === "harmonic") continue;
        const isThere = await attempt(ctx, T.failed.formula(T.coordinates[kind]), () =>
          ctx.queue.add("compare", async (signal) => {
            const session = ctx.session();
            if (!session.engine.hasOther(kind)) await follow(signal, session.bindByFormula(kind));
          }),
        );
        if (!isThere) return false;
      }
      return true;
    },
  };
  return actions;
}

export type BindActions = ReturnType<typeof createBind>;

function start(pass: BindRun["pass"], revision: number, options: BindOptions): BindRun {
  return {
    pass,
    revision,
    options,
    stage: "voxelize",
    fraction: 0,
    etaMs: null,
    iteration: 0,
    delta: null,
    curve: [],
  };
}

/**
 * Whether two binds had the same method, solver, grid and backend. The report of the newer bind then
 * replaces the report of the older bind.
 */
export function sameWay(a: BindReport, b: BindReport): boolean {
  const keys = ["method", "solver", "grid", "backend"] as const;
  return keys.every((key) => a[key] === b[key]);
}

/** Maximum number of points of a curve. A longer curve loses every second point; the plot is only 328 pixels wide. */
const MAX_CURVE_POINTS = 600;

/** Appends a point to a curve, unless its delta is not positive or its iteration equals that of the last point. */
export function grown(curve: BindRun["curve"], iteration: number, delta: number | null): BindRun["curve"] {
  if (delta === null || !(delta > 0) || curve.at(-1)?.[0] === iteration) return curve;
  const next = [...curve, [iteration, delta] as const];
  return next.length > MAX_CURVE_POINTS ? next.filter((_, i) => i % 2 === 0 || i === next.length - 1) : next;
}
