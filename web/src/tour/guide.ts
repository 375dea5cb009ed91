/** Runs the tour. Each stop changes the state of the page. Leaving the tour restores the previous work and settings. */

import type { BindActions } from "../actions/bind";
import type { Context } from "../actions/context";
import type { Edit } from "../actions/edit";
import type { Files } from "../actions/files";
import type { View } from "../actions/view";
import type { WorkActions } from "../actions/works";
import type { BindOptions, BindReport } from "../contract";
import { BIND_DEFAULTS, SCENE_DEFAULTS } from "../defaults";
import { linkOf, stopOf } from "../share";
import type { AppState, TourName, TourPlace } from "../state";
import { loadStop, saveStop } from "../store";
import { isOf, STOPS, type Stop, stopsOf } from "./stops";

export interface GuideNeeds {
  readonly bind: Pick<BindActions, "start">;
  readonly edit: Pick<Edit, "setEditingRest">;
  readonly view: View;
  readonly files: Pick<Files, "openSample" | "prepared">;
  readonly works: Pick<WorkActions, "flush" | "open" | "restore">;
}

/** Keys of the settings that are restored when the tour ends. */
const RESTORED_KEYS = ["step", "bindOptions", "seeOpen", "slice"] as const;

interface StateBeforeTour {
  readonly settings: Pick<AppState, (typeof RESTORED_KEYS)[number]>;
  readonly scene: AppState["scene"];
  readonly work: AppState["works"][number] | undefined;
  readonly sample: string | null;
  /** The fragment of the address at the start of the tour, which may be a share link. */
  readonly link: string;
}

export function createGuide(ctx: Context, { bind, edit, view, files, works }: GuideNeeds) {
  const { store } = ctx;
  let before: StateBeforeTour | undefined;
  /** Incremented whenever other binds or another stop start. Asynchronous work with an older value is ignored. */
  let turn = 0;
  /** The sample that the tour has opened, or that was open and unmodified at its start. */
  let opened: string | undefined;
  /** The sample that the tour is opening. */
  let opening: string | null = null;

  const set = (patch: Partial<NonNullable<AppState["tour"]>>) => {
    const { tour } = store.get();
    if (tour) store.set({ tour: { ...tour, ...patch } });
  };

  const putBack = ({ settings, scene }: StateBeforeTour) => {
    const { theme } = store.get().scene;
    store.set(settings);
    view.scene({ ...scene, theme, compare: SCENE_DEFAULTS.compare, slice: "off" });
  };

  const isOpened = (sample: string) => {
    const { sampleCage, cage } = store.get();
    const isPlain = cage?.controls.smooth === 0 && cage.controls.inner === 0;
    return opened === sample && sampleCage && isPlain;
  };

  const open = async (sample: string, mine: number) => {
    edit.setEditingRest(false);
    if (isOpened(sample)) return true;
    opening = sample;
    const isOpen = await files.openSample(sample, store.get().bindOptions);
    if (mine !== turn) return false;
    opening = null;
    opened = isOpen ? sample : undefined;
    return isOpen;
  };

  /** Undoes what the user did at the previous stop, and sets a pose of the sample; undefined for the rest pose. */
  const rest = (pose: number | undefined) => {
    const engine = ctx.engine();
    engine.revert();
    while (engine.undo());
    engine.apply(pose === undefined ? { do: "reset_pose" } : { do: "apply_pose", index: pose });
    engine.amend();
    engine.clearHistory();
    engine.select(new Uint32Array(), "replace");
    engine.showHeld([]);
  };

  const optionsOf = (way: Partial<BindOptions>): BindOptions => {
    const { backend, memory_limit } = before?.settings.bindOptions ?? BIND_DEFAULTS;
    return { ...BIND_DEFAULTS, backend, memory_limit, ...way };
  };

  /** The stop with the user's backend; undefined while no tour runs. */
  const stopNow = (): Stop | undefined => {
    const { tour } = store.get();
    const name = tour && STOPS[tour.name][tour.stop];
    return name ? stopsOf(before?.settings.bindOptions.backend === "gpu")[name] : undefined;
  };

  /** Runs binds in order and adds their reports to `tour.reports`. Ends early if a bind fails or `turn` changes. */
  const run = async (binds: readonly Partial<BindOptions>[], mine: number) => {
    for (const [k, way] of binds.entries()) {
      set({ doing: [k + 1, binds.length] });
      store.set({ bindOptions: optionsOf(way) });
      const reports: BindReport[] = [];
      // The first time includes what later ones reuse, such as compiled code.
      for (let times = stopNow()?.repeats ?? 0; times >= 0; times--) {
        const isBound = await bind.start(true);
        const { report } = store.get();
        if (mine !== turn || !isBound || !report) return;
        reports.push(report);
      }
      const report = medianOf(reports);
      const others = store.get().tour?.reports.filter((other) => !isOf(other, report)) ?? [];
      set({ reports: [...others, report] });
    }
  };

  const runNow = async (binds: readonly Partial<BindOptions>[]) => {
    turn += 1;
    const mine = turn;
    await run(binds, mine);
    if (mine === turn) set({ doing: null });
  };

  const visit = async (stop: Stop, mine: number) => {
    const ours = optionsOf(stop.binds[0] ?? {});
    store.set({ bindOptions: ours });
    const wasOpen = isOpened(stop.sample);
    if (!(await open(stop.sample, mine)) || mine !== turn) return;
    rest(stop.pose);
    const { turn: by } = stop;
    const engine = ctx.engine();
    engine.axisView(0, false);
    if (by) engine.orbit(by[0], by[1]);
    const { theme } = store.get().scene;
    view.scene({ ...SCENE_DEFAULTS, theme });
    store.set({ step: stop.step, seeOpen: false });
    const { report, bound } = store.get();
    const isBound = wasOpen && bound && report && stop.binds.length === 1 && isOf(report, ours);
    if (isBound) set({ reports: [report] });
    else await run(stop.binds, mine);
    if (mine !== turn) return;
    view.scene({ ...stop.scene, slice: "off" });
    if (stop.vertex !== undefined) engine.select(Uint32Array.of(stop.vertex), "replace");
    if (stop.slice) await view.sliceNow(stop.slice, stop.scene?.slice);
    if (mine !== turn) return;
    await view.compare(stop.compare ?? SCENE_DEFAULTS.compare);
    engine.frameAll();
    // A capture is opened without a cage and weights: wait until the page has generated a cage and bound the capture.
    await files.prepared();
    // Splats follow the cage only after a job of kind "lattice" has bound the lattice. That job is queued when the
    // model is bound. An empty job of the same kind ends after it.
    await ctx.queue.add("lattice", async () => undefined).catch(() => undefined);
  };

  const guide = {
    /** Starts at the given stop, or at the stop where the user left the tour, or with the first steps. */
    async start(place: TourPlace = stopOf(loadStop()) ?? { name: "first", stop: 0 }) {
      if (!before) {
        // Save pending changes of the work before the tour replaces it.
        await works.flush();
        const state = store.get();
        const settings = Object.fromEntries(
          RESTORED_KEYS.map((key) => [key, state[key]]),
        ) as StateBeforeTour["settings"];
        const work = state.works.find(({ where }) => where === "here");
        before = { settings, scene: state.scene, work, sample: state.sample, link: location.hash };
        const isUntouched = state.sampleCage && !state.posed && state.undo === null && !work;
        opened = isUntouched ? (state.sample ?? undefined) : undefined;
      }
      await guide.go(Math.min(place.stop, STOPS[place.name].length - 1), place.name);
    },
    /** Goes to a stop, by default of the same tour. After the last stop, ends the tour. */
    async go(stop: number, name: TourName = store.get().tour?.name ?? "first") {
      if (!before) return;
      if (stop >= STOPS[name].length) {
        saveStop("");
        await guide.end();
        return;
      }
      turn += 1;
      const mine = turn;
      const link = linkOf({ name, stop });
      saveStop(link);
      window.history.replaceState(null, "", link);
      ctx.tell.clear();
      store.set({ tour: { name, stop, reports: [], doing: [0, 1] } });
      const now = stopNow();
      if (now) await visit(now, mine);
      if (mine === turn) set({ doing: null });
    },
    /** Runs other binds, whose reports replace the reports of this stop. */
    measure(binds: readonly Partial<BindOptions>[]) {
      set({ reports: [] });
      return runNow(binds);
    },
    /** Runs one more bind to show its result, and adds its report to the reports of this stop. */
    show: (way: Partial<BindOptions>) => runNow([way]),
    /** Ends the tour and restores the previous work and settings. */
    async end() {
      const was = before;
      if (!was) return;
      const sample = was.sample ?? store.get().samples[0] ?? "";
      const isStill = isOpened(sample);
      if (isStill) rest(undefined);
      guide.beforeOpen(null);
      if (was.link.includes("sample=") && !was.work) {
        // Setting the fragment reopens the shared link.
        location.hash = was.link;
        return;
      }
      if (was.work) await works.open({ ...was.work, where: "nowhere" });
      else if (was.sample !== null || !(await works.restore())) {
        if (isStill) await bind.start(true);
        else await files.openSample(sample, was.settings.bindOptions);
      }
      store.set({ step: was.settings.step });
      ctx.engine().frameAll();
    },
    /** Called when a sample or file is opened. Unless the tour opened it, ends the tour and restores the settings. */
    beforeOpen(sample: string | null) {
      if (!before || (sample !== null && sample === opening)) return;
      turn += 1;
      ctx.queue.cancel("bind");
      // Changes that the user made during the tour cannot be undone afterwards, and are not saved.
      ctx.engine().clearHistory();
      store.set({ tour: null });
      putBack(before);
      before = undefined;
      opened = undefined;
      opening = null;
      window.history.replaceState(null, "", location.pathname + location.search);
    },
  };
  return guide;
}

/** The report with the median total time; without the first one if there are more. */
function medianOf(reports: readonly BindReport[]): BindReport {
  const timed = reports.length > 1 ? reports.slice(1) : reports;
  const sorted = timed.toSorted((a, b) => a.timings_ms.total - b.timings_ms.total);
  return sorted[Math.floor(sorted.length / 2)] as BindReport;
}

export type Guide = ReturnType<typeof createGuide>;
