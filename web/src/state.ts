/** The state of the page: one signal per key, from which panels derive what they show. */

import type {
  BindOptions,
  BindReport,
  CageState,
  HumanoidInfo,
  InnerKind,
  Legend,
  ModelInfo,
  Problem,
  ProportionRange,
  Stage,
  WebGpuFault,
} from "./contract";
import {
  BIND_DEFAULTS,
  BOX_DIVISIONS,
  CAGE_DEFAULTS,
  RIG_DEFAULTS,
  SCENE_DEFAULTS,
  type SHAPE_FORMATS,
  type SPLAT_FORMATS,
  VIEW_DEFAULTS,
} from "./defaults";
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

export type ShapeFormat = (typeof SHAPE_FORMATS | typeof SPLAT_FORMATS)[number];

export type CageSource = "auto" | "hull" | "box" | "file";

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
  ...VIEW_DEFAULTS,
  model: null as ModelInfo | null,
  cage: null as CageState | null,
  /** Result of the cage's check; null until it is known. */
  check: null as readonly Problem[] | null,
  report: null as BindReport | null,
  /** Reports of earlier binds of this cage, for comparison, latest first. */
  earlier: [] as readonly BindReport[],
  legend: null as Legend | null,
  /** Humanoid bones of the models; null without a skeleton. */
  humanoid: null as HumanoidInfo | null,
  /** Factors of proportions beyond which the model folds; null until they are measured for the current weights. */
  folds: null as readonly ProportionRange[] | null,
  /** Whether the worker for pulls is prepared, or being prepared, for the current model and cage. */
  pullReady: false,
};

const CAGE_SETTINGS = {
  cageSource: "auto" as CageSource,
  cageOptions: CAGE_DEFAULTS,
  /** Name of a clip whose frames generated cages also enclose; null for none. */
  cageClip: null as string | null,
  boxDivisions: BOX_DIVISIONS as number,
};

export type CageSettings = typeof CAGE_SETTINGS;

/** Initial values of the keys that belong to the open model, see docs/page.md. */
export const MODEL_STATE = {
  ...CAGE_SETTINGS,
  /**
   * Point of the sample that the page asks the user to pull first; null for other models, and once the model has been
   * pulled.
   */
  grip: null as readonly number[] | null,
  /** `cageKey` of the settings with which the cage was made or opened. */
  cageMade: cageKey(CAGE_SETTINGS),
  /** Number of vertices of the previewed cage; null without a preview. */
  cagePreview: null as number | null,
  /** Finished fraction of the cage generation, 0 to 1; null if no generation runs. */
  cageProgress: null as number | null,
  /** Bind options chosen in the Bind panel. */
  bindOptions: BIND_DEFAULTS,
  /** Options of the last finished bind; null before the first. */
  appliedOptions: null as BindOptions | null,
  bindRun: null as BindRun | null,
  /** Number of bytes that the next bind needs, or a message that says why it cannot run. */
  memory: 0 as number | Message,
  slice: { axis: 2, position: 0.5, busy: false } as Slice,
  boxArmed: false,
  /** Whether the pointer is over a handle that has no mirror image, while editing is symmetric. */
  hoversAlone: false,
  /** Kind of inner control that clicks add; null for none. */
  placing: null as InnerKind | null,
  ortho: false,
  /** Label of the gesture in progress; null without one. */
  gesture: null as string | null,
  /** Number of sampled model vertices outside the cage during a gesture that reshapes it; otherwise 0. */
  strays: 0,
  /** Whether pulls move the whole model. */
  pullWhole: false,
  playing: false,
  /** Position of the playhead in the animation of the cage, seconds. */
  moment: 0,
  /** Whether the exported GLB contains the animation of the saved poses. */
  withAnimation: true,
  /** The rig whose clips the cage follows; null without one. */
  walk: null as WalkState | null,
  /** Whether the left and right parts of a humanoid have sliders of their own. */
  apart: false,
  /** The brush that paints which vertices of a model stay in place; null while nothing is painted. */
  painting: null as Painting | null,
  /** The clip shown in place of the cage's pose. */
  clip: NO_CLIP,
  /**
   * Identifier of the only model to export; "zip" to export all in one archive, null to export all as separate files.
   */
  exportOnly: null as number | "zip" | null,
  /** Format of exported shapes, if the model can have it; null: that of the model's file. See `shapeFormatOf`. */
  shapeFormat: null as ShapeFormat | null,
  /** Whether an exported shape is the shown frame of a clip or the rest shape. */
  shapeMoment: "frame" as "frame" | "rest",
  /** Picture pixels per CSS pixel of the view. */
  pictureScale: 2 as 1 | 2 | 4,
  /** Whether a picture shows only the model. */
  pictureAlone: false,
  /** Options that determine how the model's skeleton follows the cage. */
  rigOptions: RIG_DEFAULTS,
  /** Name of the pose that the animation approaches; null for the rest pose. */
  playingPose: null as string | null,
  /** Time of the last save in this browser, ms since 1970; null before the first. */
  savedAt: null as number | null,
  /** Addresses of pictures of saved poses, by `PoseView.hash`. */
  pictures: {} as Readonly<Record<number, string>>,
};

/**
 * Initial values of the keys that do not change when another model is opened: the user's choices and the state of the
 * page itself.
 */
export const PERSON_STATE = {
  step: "model" as StepName,
  adapter: "",
  /** Why the page draws with WebGL2 and computes on the processor; null with WebGPU. */
  lack: null as WebGpuFault | null,
  /** Identifiers of the built-in samples. */
  samples: [] as readonly string[],
  /** Describes the operation that blocks the page; null without one. */
  busy: null as string | null,
  /** Progress of the operation that blocks the page, in words. */
  busyStep: "",
  /** Finished fraction of the current step, 0 to 1; 0 if it is unknown. */
  busyFraction: 0,
  /** Cancels the operation that blocks the page; null if it cannot be cancelled. */
  cancelBusy: null as (() => void) | null,
  /** Confirms the operation that blocks the page while it waits for confirmation; otherwise null. */
  confirmBusy: null as (() => void) | null,
  scene: SCENE_DEFAULTS,
  seeOpen: false,
  /** Whether clicks and taps add to the selection. */
  additive: false,
  theme: "auto" as Theme,
  /** Work saved in this browser, newest first. */
  works: [] as readonly Work[],
  /** Whether the list of saved work is shown. */
  worksOpen: false,
  /** State of the tour; null while it is not running. */
  tour: null as TourState | null,
  sheetOpen: false,
  /** Whether the instructions for enabling WebGPU are shown. */
  waysOpen: false,
  /** Number of files that are dragged over the window, and their target; null if none are. */
  hovering: null as { readonly files: number; readonly to: DropPlace } | null,
};

export const INITIAL_STATE = { ...PERSON_STATE, ...MODEL_STATE, ...DOCUMENT_STATE };

export type AppState = typeof INITIAL_STATE;

/**
 * Returns the values of the `MODEL_STATE` keys when another model is opened. Keeps the backend and the memory limit,
 * which depend on the computer.
 */
export function stateOfNextModel({ bindOptions: { backend, memory_limit } }: AppState): typeof MODEL_STATE {
  return { ...MODEL_STATE, bindOptions: { ...BIND_DEFAULTS, backend, memory_limit } };
}

/** The tours: first steps with a model, and how the method works. */
export type TourName = "first" | "how";

/** A stop of a tour. */
export interface TourPlace {
  readonly name: TourName;
  /** Index of the stop, from 0. */
  readonly stop: number;
}

/** Current stop of a tour, and its binds. */
export interface TourState extends TourPlace {
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

/** Clips of another file that the cage follows. */
export interface WalkState {
  /** Name of the file. */
  readonly name: string;
  /** Names and lengths of the clips, seconds. */
  readonly clips: readonly (readonly [name: string, seconds: number])[];
  /** Index of the clip. */
  readonly clip: number;
}

/** A clip and its playback state. */
export interface ClipState {
  /** Index of the clip; null if no clip is shown. */
  readonly clip: number | null;
  readonly seconds: number;
  readonly playing: boolean;
  readonly speed: number;
  readonly loop: boolean;
  /** A weight per morph target, used where the clip does not animate it. Empty: the file's default weights apply. */
  readonly targets: readonly number[];
}
