/**
 * The page with a fake session instead of the engine, for words.spec.ts. Shows each step, panel, dialog and message
 * with made-up contents.
 */

import { sayGesture } from "../../src/actions/edit";
import { createApp } from "../../src/app";
import type {
  BindOptions,
  BindReport,
  CageState,
  HumanoidInfo,
  InnerElement,
  ModelInfo,
  Problem,
  Session,
} from "../../src/contract";
import type { ProblemFix } from "../../src/derived";
import type { AppState } from "../../src/state";
import { INITIAL_STATE, STEPS } from "../../src/state";
import { STOPS, solvers, stopsOf } from "../../src/tour/stops";
import { askAfterCrash, showReport } from "../../src/ui/crashed";
import { createLost } from "../../src/ui/lost";
import { loadSheetPart, mount, mountUnsupported } from "../../src/ui/page";
import { createToasts } from "../../src/ui/toasts";
import { createStage } from "../../src/ui/viewport";
import { chooseLanguage, T } from "../../src/words";
import { createFake, MODEL, memberOf, reportOf } from "../../test/fake";
import { inspect } from "./inspect";

declare global {
  /** Shows all states of the page, and returns the faults found in their texts. */
  var visitAll: (() => Promise<string[]>) | undefined;
  /** Functions that show a step or dialog with as much as it can contain, by name. */
  var visits: ReadonlyMap<string, () => Promise<void>> | undefined;
}

type Patch = Partial<AppState>;

// Made-up names contain no letters, so that `inspect` does not report them as untranslated.
/** The stops of both tours. */
const TOUR_PLACES = (["first", "how"] as const).flatMap((name) =>
  STOPS[name].map((_, stop) => ({ name, stop })),
);

const BOUNDS = { min: [0, 0, 0], max: [1, 2, 3] } as ModelInfo["bounds"];
const MEMBER = {
  ...memberOf(0, "01", 1234),
  joints: 4,
  painted: true,
  parts: ["material:1", "node:2", "joint:3", "group:4"],
};
const RIG: ModelInfo = {
  ...MODEL,
  name: "01",
  vertices: 12_345,
  triangles: 23_456,
  materials: 2,
  textures: 3,
  joints: 4,
  clips: [{ name: "1", seconds: 2 }],
  targets: [{ name: "1", default: 0.5 }],
  props: ["1"],
  rigged: true,
  vrm: true,
  bounds: BOUNDS,
  members: [MEMBER],
};
const TWO_MODELS: ModelInfo = {
  ...RIG,
  members: [
    { ...MEMBER, options: { shown: false, rigid: ["material:1"], stays: ["node:2"] } },
    { ...memberOf(1, "02"), parts: [], options: { shown: true, rigid: ["all"], stays: [] } },
    { ...memberOf(2, "03"), parts: [], options: { shown: true, rigid: [], stays: ["all"] } },
    { ...memberOf(3, "04"), parts: [], options: { shown: true, rigid: ["1", "2"], stays: ["3", "4"] } },
  ],
};
const CAGE: CageState = {
  usable: true,
  controls: { smooth: 0, inner: 0, elements: [], radius: null },
  radius: 0.1,
  info: { vertices: 80, edges: 200, faces: 122, quads: 80, bounds: BOUNDS, notices: [] },
};
const INNER_ELEMENTS: readonly InnerElement[] = [
  { point: 0 },
  { line: [1, 2] },
  { face: [3, 4, 5] },
  { point: 6 },
];
const BONES = Object.keys(T.proportions.bone) as HumanoidInfo["bones"][number]["bone"][];
const HUMANOID: HumanoidInfo = {
  source: "names",
  fault: null,
  bones: BONES.map((bone) => ({ bone, joint: "1", given: false })),
  joints: ["1", "2"],
};
const CAGE_WITH_CONTROLS: CageState = {
  ...CAGE,
  controls: { smooth: 2, inner: 7, elements: [...INNER_ELEMENTS], radius: null },
};
const PLACES = { vertices: [], edges: [], faces: [], points: [] };
/** Problems with these fixes; null for one without a fix. */
const checkOf = (
  mends: readonly (ProblemFix | null)[],
  severity: "error" | "note",
  count: number,
): Problem[] =>
  mends.map((fix, k) => {
    const fixes = fix && fix.kind !== "regenerate" ? [fix] : [];
    return { code: "model_outside", severity, message: `${k}.`, count, places: PLACES, fixes };
  });
const REPAIRS = ["weld", "drop_degenerate", "mirror", "fill_holes", "flip", "grow"] as const;
const MENDS: readonly ProblemFix[] = [
  ...REPAIRS.map((repair) => ({ kind: "repair", repair }) as const),
  { kind: "grid", cells: 32 },
  { kind: "grid", cells: 128 },
  { kind: "regenerate" },
];
const reportBy = (way: Partial<BindOptions>): BindReport =>
  reportOf({
    ...way,
    delta_history: [0.1, 0.01, 0.001],
    timings_ms: { voxelize: 12, solve: 1234, sample: 0.5, total: 98_765 },
    memory_bytes: { estimated: 12_345_678, peak: 1_234_567_890 },
    inner_controls: 3,
    smooth: 2,
    outside_vertices: 2,
  });
const REPORT = reportBy({});
const EARLIER_REPORTS = solvers(32).map(reportBy);
const BOUND_STATE: Patch = {
  model: RIG,
  cage: CAGE,
  check: [],
  bound: true,
  report: REPORT,
  steps: 1,
};
const RUN = { ...INITIAL_STATE.bindOptions, solver: "cg" } as const;
const selected = (count: number, last: number | null): AppState["selected"] => ({
  count,
  last,
  center: count > 0 ? [1, 2, 3] : null,
});
const of = <K extends keyof AppState>(key: K, values: readonly AppState[K][], also: Patch = {}): Patch[] =>
  values.map((value) => ({ ...also, [key]: value }) as Patch);

/** Two saved poses, of which the first is shown, and one of another cage. */
const TWO_POSES: Patch = {
  poses: [1, 2, 3].map((k) => ({ name: `0${k}`, fits: k < 3, seconds: k, interpolation: null, hash: k })),
  shares: [1, 0, 0],
  animationSeconds: 3,
};

/** For each step, changes of `BOUND_STATE` with which its panel shows as much as it can contain. */
const full = (): Record<AppState["step"], Patch> => ({
  model: {
    model: TWO_MODELS,
    sample: "rat",
    painting: { id: 0, radius: 0.1, erase: false },
    works: [work("here")],
    undo: T.did.grab,
    redo: T.did.pull,
  },
  cage: {
    check: checkOf(MENDS, "error", 2),
    cage: { ...CAGE_WITH_CONTROLS, usable: false },
    editingRest: true,
    tools: { ...INITIAL_STATE.tools, element: "face" },
    placing: "line",
    cageProgress: 0.5,
  },
  bind: {
    earlier: EARLIER_REPORTS,
    appliedOptions: { ...INITIAL_STATE.bindOptions, grid: 32 },
    bindOptions: { ...RUN, method: "classic" },
    lack: "NoAdapter",
  },
  pose: {
    selected: selected(3, 1),
    pins: [{ triangle: 0, bary: [1, 0, 0] }],
    tools: { ...INITIAL_STATE.tools, symmetry: true, proportionalOn: true },
    unmatched: 3,
    ...TWO_POSES,
    modified: true,
    posed: true,
    scene: { ...INITIAL_STATE.scene, slice: "value", colour: "weight" },
    humanoid: HUMANOID,
    factors: [2, 2],
    folds: [{ proportion: "leg", min: 0.5, max: 1.5 }],
    scaled: true,
    apart: true,
    seeOpen: true,
    legend: { low: 0, high: 1, logarithmic: false, map: "viridis", largest: null },
  },
  export: {
    model: TWO_MODELS,
    cage: CAGE_WITH_CONTROLS,
    ...TWO_POSES,
  },
});

/** States of each step that `full` does not contain. */
const states = (): Record<AppState["step"], readonly Patch[]> => ({
  model: [
    { model: null, cage: null, bound: false },
    { works: [work("here"), work("nowhere")], lack: "NoWebGPU" },
    { model: TWO_MODELS, sample: "rat", undo: T.did.grab, redo: T.did.pull },
    ...of("painting", [
      { id: 0, radius: 0.1, erase: false },
      { id: 0, radius: 0.1, erase: true },
    ]),
    {
      busy: T.opening.fileOf("01", 0, 2),
      busyStep: T.opening.far(T.opening.stages.geometry, 0.4),
      busyFraction: 0.4,
    },
    {
      busy: T.opening.fileOf("01", 0, 2),
      busyStep: T.opening.large(12_345_678),
      confirmBusy: () => {},
      cancelBusy: () => {},
    },
    ...of(
      "hovering",
      (["page", "cage", "list"] as const).map((to) => ({ files: 2, to })),
    ),
    { hovering: { files: 1, to: "page" }, model: null },
  ],
  cage: [
    ...of("cageSource", ["auto", "hull", "box", "file"]),
    { cage: null, check: null, bound: false },
    { check: null, cageProgress: 0.5 },
    { check: checkOf(MENDS, "error", 2), cage: { ...CAGE, usable: false }, bound: false },
    { check: checkOf(MENDS, "error", 1), cage: { ...CAGE, usable: false }, bound: false },
    { check: checkOf([null], "note", 1) },
    { cage: { ...CAGE, info: { ...CAGE.info, vertices: 30 } } },
    { cage: CAGE_WITH_CONTROLS, selected: selected(1, 81) },
    ...of("placing", ["point", "line", "face"], { cage: CAGE_WITH_CONTROLS }),
    ...(["vertex", "edge", "face"] as const).map((element) => ({
      tools: { ...INITIAL_STATE.tools, element },
      editingRest: true,
      selected: selected(2, 1),
    })),
    { editingRest: true, strays: 3 },
    { editingRest: true, check: null },
    { editingRest: true, scene: { ...INITIAL_STATE.scene, cage: false } },
    { model: { ...RIG, notices: ["1."] }, cageClip: "1" },
  ],
  bind: [
    { bound: false, report: null },
    { earlier: EARLIER_REPORTS, appliedOptions: { ...INITIAL_STATE.bindOptions, grid: 32 } },
    { bindOptions: { ...INITIAL_STATE.bindOptions, method: "classic", solver: "jacobi", backend: "gpu" } },
    { bindOptions: { ...INITIAL_STATE.bindOptions, method: "classic" } },
    { bindOptions: { ...INITIAL_STATE.bindOptions, solver: "jacobi" } },
    { bindOptions: RUN, lack: "NoAdapter" },
    { report: { ...REPORT, converged: false } },
    { report: { ...REPORT, at_round_off: true, outside_vertices: 0, backend: "gpu" } },
    { report: { ...REPORT, rest_error: { ...REPORT.rest_error, max_rel: 1 } } },
    ...(["simplify", "voxelize", "solve", "sample"] as const).map((stage, k): Patch => {
      const curve = REPORT.delta_history.map((delta, i) => [i + 1, delta] as const);
      const run = { options: RUN, revision: 0, fraction: 0.5, iteration: 3, delta: 0.1, curve };
      return {
        bindRun: {
          ...run,
          pass: k % 2 === 0 ? "coarse" : "fine",
          stage,
          etaMs: [null, 900, 90_000][k] ?? null,
        },
      };
    }),
  ],
  pose: [
    {},
    ...of("humanoid", [
      { ...HUMANOID, source: "vrm" },
      { ...HUMANOID, source: "shape" },
      { ...HUMANOID, source: null, fault: "1." },
    ]),
    { bound: false, report: null },
    { selected: selected(1, 1), pins: [{ triangle: 0, bary: [1, 0, 0] }], pullWhole: true },
    { selected: selected(1, 81), cage: CAGE_WITH_CONTROLS },
    {
      selected: selected(3, 1),
      tools: { ...INITIAL_STATE.tools, symmetry: true, proportionalOn: true },
      unmatched: 3,
      scene: { ...INITIAL_STATE.scene, pull: false },
    },
    {
      selected: selected(1, 1),
      editingRest: true,
      scene: { ...INITIAL_STATE.scene, gizmo: "move", pull: false },
    },
    { scene: { ...INITIAL_STATE.scene, cage: false } },
    { scene: { ...INITIAL_STATE.scene, cage: false, pull: false } },
    { scene: { ...INITIAL_STATE.scene, pull: false } },
    { scene: { ...INITIAL_STATE.scene, original: true } },
    { boxArmed: true, ortho: true },
    { gesture: sayGesture({ kind: "grab", amounts: [0.123, 0.456, 0.789], axis: 0, plane: true }) },
    { ...TWO_POSES, shares: [0.5, 1, 0], playing: true, playingPose: null, posed: true },
    { ...TWO_POSES, model: { ...RIG, clips: [], targets: [] }, playing: true, playingPose: "01" },
    {
      model: { ...RIG, clips: [], rigged: false, joints: 0 },
      walk: { name: "02", clips: [["1", 2]], clip: 0 },
    },
    { hoversAlone: true },
    {
      clip: { ...INITIAL_STATE.clip, clip: 0, playing: true },
      rigOptions: { ...INITIAL_STATE.rigOptions, rigid: ["1"] },
    },
    { clip: { ...INITIAL_STATE.clip, clip: 0 }, rigOptions: { ...INITIAL_STATE.rigOptions, dynamic: true } },
    { rigOptions: { ...INITIAL_STATE.rigOptions, joints: "turn" } },
    { rigOptions: { ...INITIAL_STATE.rigOptions, joints: "stay" } },
    ...(["material", "clay", "weight", "error"] as const).map(
      (colour): Patch => ({
        scene: { ...INITIAL_STATE.scene, colour },
        seeOpen: true,
        selected: selected(1, 1),
        legend: {
          low: 1e-7,
          high: 0.5,
          logarithmic: true,
          map: "error",
          largest: { value: 0.5, vertex: 1234 },
        },
      }),
    ),
    ...(["kinds", "value"] as const).flatMap((slice) =>
      [null, 1].map(
        (last): Patch => ({
          scene: { ...INITIAL_STATE.scene, slice, colour: "weight" },
          seeOpen: true,
          selected: selected(last === null ? 0 : 1, last),
          legend: {
            low: 0,
            high: 1,
            logarithmic: false,
            map: slice === "kinds" ? "kinds" : "viridis",
            largest: null,
          },
        }),
      ),
    ),
    {
      scene: { ...INITIAL_STATE.scene, compare: ["harmonic", "mean_value", "green"] },
      cage: CAGE_WITH_CONTROLS,
    },
  ],
  export: [
    { model: null, cage: null, bound: false },
    { bound: false, report: null },
    { cage: CAGE_WITH_CONTROLS },
    { model: TWO_MODELS, poses: [{ name: "01", fits: true, seconds: 1, interpolation: null, hash: 7 }] },
    { rigOptions: { ...INITIAL_STATE.rigOptions, dynamic: true } },
  ],
});

const work = (where: "here" | "elsewhere" | "nowhere") => ({
  id: where,
  name: `01-${where.length}`,
  when: Date.now() - 90_000_000,
  size: 1234,
  where,
  stopped: true as const,
});
/** States that show a dialog, as changes of `BOUND_STATE`. */
const DIALOGS: readonly Patch[] = [
  { sheetOpen: true },
  { waysOpen: true, lack: "NoDevice" },
  { worksOpen: true, works: [work("here"), work("elsewhere"), work("nowhere")] },
  { worksOpen: true },
];

const CRASH = { during: "…", report: "…" };

async function start(): Promise<void> {
  await chooseLanguage();
  await loadSheetPart();
  const byId = (id: string) => document.getElementById(id) ?? document.body;
  const stage = createStage(byId("stage"));
  const fake = createFake();
  fake.teach({ legend: () => legend ?? undefined });
  let legend: AppState["legend"] = null;
  const { store } = fake;
  const { Toasts, tell, offer } = createToasts();
  const { session } = fake.ctx;
  const viewport = () => stage.viewport.getBoundingClientRect();
  const app = createApp({ store, session, tell, viewport });
  // The browser has no saved work: reading it would remove the made-up work from the list.
  app.works.refresh = () => Promise.resolve();
  let lose = (_: string) => {};
  const lost = createLost(stage.freshCanvas, () => {});
  let isBroken = false;
  lost.watch({
    onLost: (listener: typeof lose) => {
      lose = listener;
    },
    recover: () => (isBroken ? Promise.reject(new Error("1")) : new Promise(() => {})),
  } as unknown as Session);
  mount({ app, Toasts, Lost: lost.Lost, byId });
  // Mark the model as bound, so that the page does not start a bind.
  fake.show({ bound: true });
  const show = (patch: Patch) => {
    legend = patch.legend ?? null;
    const samples = Object.keys(T.samples);
    store.set({ ...INITIAL_STATE, ...BOUND_STATE, adapter: "1", samples, ...patch, legend });
  };

  /** Waits until components are rendered (in microtasks) and effects have run (in a task). */
  const rendered = async () => {
    for (const _ of [1, 2]) await new Promise((done) => setTimeout(done));
  };
  const visit = (patch: Patch) => {
    show(patch);
    return rendered();
  };

  const whole = full();
  const visits = new Map([
    ...STEPS.map((step) => [step, () => visit({ step, ...whole[step] })] as const),
    [
      "timeline",
      async () => {
        await visit({ step: "pose", ...TWO_POSES, bound: true });
        document.querySelector<HTMLElement>(".timeline-row > :last-child")?.click();
        await rendered();
      },
    ] as const,
    ...DIALOGS.map((patch, k) => [`dialog ${k}`, () => visit(patch)] as const),
    ...TOUR_PLACES.map((place) => {
      const stopName = STOPS[place.name][place.stop] ?? "pull";
      const { binds, step } = stopsOf(true)[stopName];
      const tour = { ...place, reports: binds.map(reportBy), doing: null };
      return [
        `stop ${stopName}`,
        async () => {
          await tourLoaded();
          await visit({ step, tour });
        },
      ] as const;
    }),
  ]);
  globalThis.visits = visits;
  /** Loads the tour. Does not await `start`, which waits for a sample that the fake session never opens. */
  const tourLoaded = async () => {
    if (!app.tour.loaded()) void app.tour.start();
    while (!app.tour.loaded()) await new Promise((done) => setTimeout(done));
  };

  globalThis.visitAll = async () => {
    const faults = new Set<string>();
    const seen = new Set<string>();
    const look = async (where: string) => {
      await rendered();
      for (const fault of inspect(seen)) faults.add(`${where}: ${fault}`);
    };
    const all = states();
    for (const step of STEPS)
      for (const [k, patch] of all[step].entries()) {
        show({ step, ...patch });
        await look(`${step} ${k}`);
      }
    for (const [name, visit] of visits) {
      await visit();
      await look(name);
    }
    for (const place of TOUR_PLACES) {
      show({ tour: { ...place, reports: [], doing: [2, 3] } });
      await look(`stop ${place.stop} of ${place.name}, binding`);
    }
    show({});

    for (const title of Object.values(T.failed)) {
      const fixes = Object.keys(T.fixes) as (keyof typeof T.fixes)[];
      const fix = fixes[seen.size % fixes.length] ?? "file";
      tell.problem(
        { title: typeof title === "string" ? title : title("1"), message: T.somethingWrong },
        app.ctx.fixFor(fix),
      );
      await look("problem");
      tell.clear();
    }
    for (const [text, label] of [
      [T.did.forgotten, ""],
      [T.works.restored("01", "1"), T.works.show],
      [T.works.left("01"), T.works.back],
      [T.exports.noLinkChanged, T.exports.saveProject],
      [T.models.together(3), T.models.showList],
      [T.models.outside, T.models.makeAround],
    ] as const) {
      if (label) tell.say(text, { label, run: () => {} });
      else tell.say(text);
      await look("message");
    }
    offer(T.offline.ready, { label: T.offline.reload, run: () => {} });
    await look("offer");

    // Show as messages all sentences that no state has shown.
    for (const text of sentencesOf(T).filter((text) => !isSeen(seen, text))) {
      tell.say(text);
      await look("message");
    }

    lose("1");
    await look("a lost device");
    isBroken = true;
    lose("1");
    await look("a device lost again");
    document.querySelector<HTMLElement>(".lost .primary")?.click();
    await look("a device that stays lost");

    showReport(CRASH);
    await look("a report");
    document.querySelector<HTMLElement>("dialog[open] .icon-button")?.click();
    askAfterCrash(CRASH, () => {});
    await look("a second crash");
    mountUnsupported("NoWebGPU");
    await look("no WebGL2");
    return [...faults];
  };
}

const isSeen = (seen: ReadonlySet<string>, text: string) => {
  const own = text.trim();
  for (const one of seen) if (one.includes(own)) return true;
  return false;
};

/** Lists all sentences of a catalogue that take no values. */
const sentencesOf = (words: unknown): string[] => {
  if (typeof words === "string") return words === "" ? [] : [words];
  return typeof words === "object" && words !== null ? Object.values(words).flatMap(sentencesOf) : [];
};

void start();
