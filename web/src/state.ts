/** Everything the page shows, in one place, a signal a key: panels derive from it. */

import type {
  BindOptions,
  BindReport,
  Element as CageElement,
  CageOptions,
  CageState,
  Check,
  InnerKind,
  Lack,
  Legend,
  ModelInfo,
  Pivot,
  RigOptions,
  Sample,
  SceneOptions,
  Stage,
  View,
} from "./contract";
import { BIND_DEFAULTS, CAGE_DEFAULTS, RIG_DEFAULTS, SCENE_DEFAULTS } from "./defaults";
import type { Theme } from "./store";
import { T } from "./words";
import type { Work } from "./works/entry";

export const STEPS = ["model", "cage", "bind", "pose", "export"] as const;
export type StepName = (typeof STEPS)[number];

export interface BindRun {
  pass: "coarse" | "fine";
  /** Of the engine: what the bind is for. */
  revision: number;
  options: BindOptions;
  stage: Stage;
  /** Of the pass, 0 to 1. */
  fraction: number;
  etaMs: number | null;
  iteration: number;
  delta: number | null;
  /** Iteration and delta of this pass, in turn. */
  curve: readonly (readonly [iteration: number, delta: number])[];
}

export interface Slice {
  axis: 0 | 1 | 2;
  /** Along the cage's box, 0 to 1. */
  position: number;
  busy: boolean;
}

/** Where files are dropped: anywhere, on the panel of the cage, or on the list of the models in it. */
export type DropPlace = "page" | "cage" | "list";

export type CageSource = "auto" | "hull" | "box" | "file";

export interface AppState extends Omit<View, "models" | "mesh" | "cage" | "undo" | "redo" | "forgotten"> {
  step: StepName;
  adapter: string;
  /** Why the page draws with WebGL2 and computes on the processor; null with WebGPU. */
  lack: Lack | null;
  samples: readonly Sample[];
  /** What keeps the whole page waiting, as a sentence; null when nothing does. */
  busy: string | null;
  /** How far that is, in words. */
  busyStep: string;
  /** Gives it up; null where that is not possible. */
  cancelBusy: (() => void) | null;
  /** Goes on with it, where the user is asked before; null otherwise. */
  goOn: (() => void) | null;
  model: ModelInfo | null;
  cage: CageState | null;
  /** What is wrong with it; null while that is not known. */
  check: Check | null;
  cageSource: CageSource;
  cageOptions: CageOptions;
  /** Name of a clip that generated cages enclose as well. */
  cageClip: string | null;
  boxDivisions: number;
  /** Share of the cage generation done; null when none runs. */
  cageProgress: number | null;
  /** As the panel shows them. */
  bindOptions: BindOptions;
  /** Those of the last bind that ended; null before the first. */
  appliedOptions: BindOptions | null;
  bindRun: BindRun | null;
  report: BindReport | null;
  /** Reports of earlier binds of this cage, latest first: to compare methods. */
  earlier: readonly BindReport[];
  /** Bytes the next bind needs, or why it cannot run. */
  memory: number | string;
  scene: SceneOptions;
  seeOpen: boolean;
  legend: Legend | null;
  slice: Slice;
  element: CageElement;
  symmetry: boolean;
  unmatched: number;
  /** Radius as a share of the cage's diagonal; kept while `proportionalOn` is false. */
  proportional: number;
  proportionalOn: boolean;
  /** Clicks and taps add to the selection. */
  additive: boolean;
  /** What turns and scales go about. */
  pivot: Pivot;
  boxArmed: boolean;
  /** What clicks put inside the cage; null for nothing. */
  placing: InnerKind | null;
  ortho: boolean;
  /** What the gesture under way does, null without one. */
  gesture: string | null;
  /** Vertices of the model that the gesture under way leaves outside of the rest cage: of some that are watched. */
  strays: number;
  /** The model can be pulled: what is needed for it belongs to the cage as it is. */
  pullReady: boolean;
  /** Pulls move the whole model. */
  pullWhole: boolean;
  playing: boolean;
  /** What stays of a model is painted; null when nothing is. */
  painting: Painting | null;
  /** The clip that is shown in place of the cage's pose. */
  clip: ClipState;
  /** The one of several models whose files are exported; null for all. */
  exportOnly: number | null;
  /** What becomes of the model's skeleton. */
  rigOptions: RigOptions;
  /** Name of the pose that is played towards, null for the rest pose. */
  playingPose: string | null;
  undoLabel: string | null;
  redoLabel: string | null;
  theme: Theme;
  /** When the project was kept in the browser last, ms since 1970. */
  savedAt: number | null;
  /** What this browser keeps, newest first. */
  works: readonly Work[];
  /** Whether the list of it is shown. */
  worksOpen: boolean;
  /** Where the tour is; null without one. */
  tour: TourState | null;
  sheetOpen: boolean;
  /** Whether the steps to switch WebGPU on are shown. */
  waysOpen: boolean;
  /** Files hover over the window; null when none do. */
  hovering: { readonly files: number; readonly to: DropPlace } | null;
}

export const NO_CLIP: ClipState = {
  clip: null,
  seconds: 0,
  playing: false,
  speed: 1,
  loop: true,
  targets: [],
};

/** What Rust decides: `document.ts` sets it whenever the document changes. */
export const DOCUMENT_STATE = {
  model: null,
  sample: null,
  cage: null,
  check: null,
  sampleCage: false,
  report: null,
  earlier: [],
  bound: false,
  legend: null,
  editingRest: false,
  selected: { count: 0, last: null, center: null },
  posed: false,
  pullReady: false,
  pins: [],
  poses: [],
  shares: [],
  steps: 0,
  undoLabel: null,
  redoLabel: null,
} satisfies Partial<AppState>;

/** What belongs to the model that is open, as it is for the next one: see docs/page.md. */
export const MODEL_STATE = {
  cageSource: "auto",
  cageOptions: CAGE_DEFAULTS,
  cageClip: null,
  boxDivisions: 2,
  cageProgress: null,
  bindOptions: BIND_DEFAULTS,
  appliedOptions: null,
  bindRun: null,
  memory: 0,
  slice: { axis: 2, position: 0.5, busy: false },
  element: "vertex",
  symmetry: false,
  unmatched: 0,
  boxArmed: false,
  placing: null,
  ortho: false,
  gesture: null,
  strays: 0,
  pullWhole: false,
  playing: false,
  painting: null,
  clip: NO_CLIP,
  exportOnly: null,
  rigOptions: RIG_DEFAULTS,
  playingPose: null,
  savedAt: null,
} satisfies Partial<AppState>;

type ModelState = Pick<AppState, keyof typeof MODEL_STATE>;

/** What stays when another model is opened: the person's choices, and what the page itself is doing. */
export const PERSON_STATE: Omit<AppState, keyof typeof MODEL_STATE | keyof typeof DOCUMENT_STATE> = {
  step: "model",
  adapter: "",
  lack: null,
  samples: [],
  busy: T.opening.starting,
  busyStep: "",
  cancelBusy: null,
  goOn: null,
  scene: SCENE_DEFAULTS,
  seeOpen: false,
  proportional: 0.2,
  proportionalOn: false,
  additive: false,
  pivot: "middle",
  theme: "auto",
  works: [],
  worksOpen: false,
  tour: null,
  sheetOpen: false,
  waysOpen: false,
  hovering: null,
};

export const INITIAL: AppState = { ...PERSON_STATE, ...MODEL_STATE, ...DOCUMENT_STATE };

/** The model's part of the state for another model. Where a bind is computed and how much memory it may take is the computer's. */
export function stateOfNextModel({ bindOptions: { backend, memory_limit } }: AppState): ModelState {
  return { ...MODEL_STATE, bindOptions: { ...BIND_DEFAULTS, backend, memory_limit } };
}

/** A stop of the tour. */
export interface TourState {
  /** Its number, from 0. */
  readonly stop: number;
  /** Binds of this stop, as they were done. */
  readonly reports: readonly BindReport[];
  /** Which bind of how many it is at; null when it is ready. */
  readonly doing: readonly [bind: number, all: number] | null;
}

/** The brush, and the model that it paints. */
export interface Painting {
  readonly id: number;
  /** Over the model's size. */
  readonly radius: number;
  /** It takes away what was painted. */
  readonly erase: boolean;
}

/** A clip and the time in it. */
export interface ClipState {
  /** Its number; null at rest. */
  readonly clip: number | null;
  readonly seconds: number;
  readonly playing: boolean;
  readonly speed: number;
  readonly loop: boolean;
  /** Weights of the morph targets; none for those of the file. */
  readonly targets: readonly number[];
}
