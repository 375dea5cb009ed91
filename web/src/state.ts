/** The state of the page: one signal per key, from which panels derive what they show. */

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
  SceneOptions,
  Stage,
  View,
} from "./contract";
import { BIND_DEFAULTS, BOX_DIVISIONS, CAGE_DEFAULTS, RIG_DEFAULTS, SCENE_DEFAULTS } from "./defaults";
import { cageKey } from "./derived";
import type { Theme } from "./store";
import type { Message } from "./strings";
import type { Work } from "./works/entry";

export const STEPS = ["model", "cage", "bind", "pose", "export"] as const;
export type StepName = (typeof STEPS)[number];

export interface BindRun {
  pass: "coarse" | "fine";
  /** Engine revision that this bind belongs to. */
  revision: number;
  options: BindOptions;
  stage: Stage;
  /** Finished fraction of the pass, 0 to 1. */
  fraction: number;
  etaMs: number | null;
  iteration: number;
  delta: number | null;
  /** Deltas of this pass, by ascending iteration. */
  curve: readonly (readonly [iteration: number, delta: number])[];
}

export interface Slice {
  axis: 0 | 1 | 2;
  /** Position of the slice along its axis, as a fraction of the cage's bounding box, 0 to 1. */
  position: number;
  busy: boolean;
}

/** Targets for dropped files: the page, the Cage panel, or the list of models in the cage. */
export type DropPlace = "page" | "cage" | "list";

export type CageSource = "auto" | "hull" | "box" | "file";

export interface AppState extends Omit<View, "models" | "mesh" | "cage" | "undo" | "redo" | "forgotten"> {
  step: StepName;
  adapter: string;
  /** Why the page draws with WebGL2 and computes on the processor; null with WebGPU. */
  lack: Lack | null;
  /** Identifiers of the built-in samples. */
  samples: readonly string[];
  /** Describes the operation that blocks the page; null without one. */
  busy: string | null;
  /** Progress of the operation that blocks the page, in words. */
  busyStep: string;
  /** Cancels the operation that blocks the page; null if it cannot be cancelled. */
  cancelBusy: (() => void) | null;
  /** Confirms the operation that blocks the page while it waits for confirmation; otherwise null. */
  goOn: (() => void) | null;
  model: ModelInfo | null;
  /** Point of the sample to pull first, until the model has been pulled. */
  grip: Float32Array | null;
  cage: CageState | null;
  /** Result of the cage's check; null until it is known. */
  check: Check | null;
  cageSource: CageSource;
  cageOptions: CageOptions;
  /** `cageKey` of the settings with which the cage was made or opened. */
  cageMade: string;
  /** Name of a clip whose frames generated cages also enclose; null for none. */
  cageClip: string | null;
  boxDivisions: number;
  /** Number of vertices of the previewed cage; null without a preview. */
  cagePreview: number | null;
  /** Finished fraction of the cage generation, 0 to 1; null if no generation runs. */
  cageProgress: number | null;
  /** Bind options chosen in the Bind panel. */
  bindOptions: BindOptions;
  /** Options of the last finished bind; null before the first. */
  appliedOptions: BindOptions | null;
  bindRun: BindRun | null;
  report: BindReport | null;
  /** Reports of earlier binds of this cage, for comparison, latest first. */
  earlier: readonly BindReport[];
  /** Number of bytes that the next bind needs, or a message why it cannot run. */
  memory: number | Message;
  scene: SceneOptions;
  seeOpen: boolean;
  legend: Legend | null;
  slice: Slice;
  element: CageElement;
  symmetry: boolean;
  unmatched: number;
  /**
   * Radius of proportional editing, as a fraction of the cage's diagonal. Remembered while `proportionalOn` is false.
   */
  proportional: number;
  proportionalOn: boolean;
  /** Whether clicks and taps add to the selection. */
  additive: boolean;
  /** Centre of rotation and scaling. */
  pivot: Pivot;
  boxArmed: boolean;
  /** Kind of inner control that clicks add; null for none. */
  placing: InnerKind | null;
  ortho: boolean;
  /** Label of the gesture in progress; null without one. */
  gesture: string | null;
  /** Number of sampled model vertices outside the cage during a gesture that reshapes it; otherwise 0. */
  strays: number;
  /** Whether the worker for pulls is prepared, or being prepared, for the current model and cage. */
  pullReady: boolean;
  /** Whether pulls move the whole model. */
  pullWhole: boolean;
  playing: boolean;
  /** The brush that paints which vertices of a model stay in place; null while nothing is painted. */
  painting: Painting | null;
  /** The clip shown in place of the cage's pose. */
  clip: ClipState;
  /** Identifier of the only model to export; null to export all. */
  exportOnly: number | "zip" | null;
  /** How the model's skeleton follows the cage. */
  rigOptions: RigOptions;
  /** Name of the pose that the animation approaches; null for the rest pose. */
  playingPose: string | null;
  undoLabel: string | null;
  redoLabel: string | null;
  theme: Theme;
  /** Time of the last save in this browser, ms since 1970; null before the first. */
  savedAt: number | null;
  /** Work saved in this browser, newest first. */
  works: readonly Work[];
  /** Whether the list of saved work is shown. */
  worksOpen: boolean;
  /** State of the tour; null while it is not running. */
  tour: TourState | null;
  sheetOpen: boolean;
  /** Whether the instructions for enabling WebGPU are shown. */
  waysOpen: boolean;
  /** Files that are dragged over the window; null if none are. */
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

/** Keys that mirror the document in Rust. `document.ts` sets them whenever the document changes. */
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
  transition: { interpolation: "linear", loops: true, back: 1 },
  animationSeconds: 0,
  steps: 0,
  undoLabel: null,
  redoLabel: null,
} satisfies Partial<AppState>;

const CAGE_SETTINGS = {
  cageSource: "auto",
  cageOptions: CAGE_DEFAULTS,
  cageClip: null,
  boxDivisions: BOX_DIVISIONS,
} satisfies Partial<AppState>;

/** Initial values of the keys that belong to the open model, see docs/page.md. */
export const MODEL_STATE = {
  ...CAGE_SETTINGS,
  grip: null,
  cageMade: cageKey(CAGE_SETTINGS),
  cagePreview: null,
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

/**
 * Initial values of the keys that stay when another model is opened: the user's choices and the state of the page
 * itself.
 */
export const PERSON_STATE: Omit<AppState, keyof typeof MODEL_STATE | keyof typeof DOCUMENT_STATE> = {
  step: "model",
  adapter: "",
  lack: null,
  samples: [],
  busy: null,
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

/**
 * Values of the `MODEL_STATE` keys when another model is opened. Backend and memory limit stay: they suit the computer.
 */
export function stateOfNextModel({ bindOptions: { backend, memory_limit } }: AppState): ModelState {
  return { ...MODEL_STATE, bindOptions: { ...BIND_DEFAULTS, backend, memory_limit } };
}

/** State of the tour. */
export interface TourState {
  /** Index of the stop, from 0. */
  readonly stop: number;
  /** Reports of this stop's binds, in order. */
  readonly reports: readonly BindReport[];
  /**
   * Number of the bind in progress, from 1 (0 while the sample is opened), and of all binds; null when all are done.
   */
  readonly doing: readonly [bind: number, all: number] | null;
}

/** The brush and the model that it paints. */
export interface Painting {
  readonly id: number;
  /** Radius of the brush, as a fraction of the model's size. */
  readonly radius: number;
  /** Whether the brush removes paint. */
  readonly erase: boolean;
}

/** A clip and its playback state. */
export interface ClipState {
  /** Index of the clip; null if no clip is shown. */
  readonly clip: number | null;
  readonly seconds: number;
  readonly playing: boolean;
  readonly speed: number;
  readonly loop: boolean;
  /** Weights of the morph targets that the clip does not animate; empty for the file's weights. */
  readonly targets: readonly number[];
}
