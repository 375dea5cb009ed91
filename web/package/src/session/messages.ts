/** What page and worker say to each other. */

import type {
  BindOptions,
  BindReport,
  CageArrays,
  CageOptions,
  Check,
  CheckedCage,
  Coordinates,
  Grabbed,
  GrabInput,
  NamedFile,
  Offsets,
  Progress,
  PullFrame,
  Reading,
  Repair,
  RigOptions,
  UpAxis,
} from "../contract";
import type { Bytes } from "./files";

/** A decoded image: red, green, blue, alpha; rows from the top. */
export interface Texture {
  readonly width: number;
  readonly height: number;
  readonly rgba: Uint8Array;
}

/** A file that was read once without harm. */
export interface ReadModel extends Bytes {
  /** What points up in it, if that is not what the file says. */
  readonly up: UpAxis | undefined;
  /** Of each model, a project's further ones too: by number; null where there is none, or none that this browser could decode. */
  readonly textures: readonly (readonly (Texture | null)[])[];
  /** A project's. */
  readonly cage: CheckedCage | undefined;
  readonly notices: readonly string[];
  /** What the module needed for it, ms: as long as the page will need. */
  readonly took: number;
  /** Of its models. */
  readonly vertices: number;
}

/** Weights as compressed sparse rows, and the columns of offsets. */
export interface BoundArrays {
  readonly indptr: Uint32Array;
  readonly indices: Uint32Array;
  readonly data: Float32Array;
  readonly offsets: Offsets;
  readonly report: BindReport | undefined;
}

export interface SampleArrays {
  readonly glb: Uint8Array;
  readonly cage: CheckedCage;
  readonly poses: readonly { readonly name: string; readonly positions: Float32Array }[];
}

/** A job's name, what it needs, its steps, and what it results in. */
export interface Jobs {
  bind: {
    /** The last `extra` positions are no vertices. */
    input: { positions: Float32Array; extra: number; cage: CageArrays; options: BindOptions };
    step: Progress;
    output: BoundArrays;
  };
  formula: {
    input: { kind: Coordinates; positions: Float32Array; cage: CageArrays };
    step: never;
    output: BoundArrays;
  };
  /** A model's vertices and triangles. */
  model: {
    /** `states`: what a cage should enclose, with the frames of a clip if one is named. */
    input: { files: readonly NamedFile[]; states: boolean; clip: string | undefined };
    step: Reading;
    output: { positions: Float32Array; triangles: Uint32Array; origin: Float64Array };
  };
  /** A model's file as it follows a posed cage. */
  reshape: {
    input: {
      files: readonly NamedFile[];
      /** What cage and pose are seen from. */
      origin: Float64Array;
      cage: CageArrays;
      posed: Float32Array;
      options: BindOptions;
      rig: RigOptions;
    };
    step: Step;
    output: Uint8Array;
  };
  slice: {
    input: { cage: CageArrays; axis: number; fraction: number; options: BindOptions };
    step: Progress;
    output: BoundArrays | undefined;
  };
  lattice: { input: { cage: CageArrays; options: BindOptions }; step: Progress; output: BoundArrays };
  cage: {
    /** All that is to be enclosed, and the model at rest, which it is checked for. */
    input: {
      positions: Float32Array;
      triangles: Uint32Array;
      model: Float32Array;
      options: CageOptions;
      smooth: number;
    };
    step: Progress;
    output: CheckedCage;
  };
  read: {
    input: { files: readonly NamedFile[]; up: UpAxis | undefined };
    step: Reading;
    output: ReadModel;
  };
  /** `model`: the vertices to be enclosed, `[n_vertices, 3]`, as seen from `origin`. */
  readCage: {
    input: {
      files: readonly NamedFile[];
      up: UpAxis;
      origin: Float64Array;
      model: Float32Array;
      smooth: number;
    };
    step: Reading;
    output: CheckedCage;
  };
  check: { input: { cage: CageArrays; model: Float32Array }; step: never; output: Check };
  repair: {
    input: { kind: Repair; cage: CageArrays; model: Float32Array };
    step: never;
    output: CheckedCage;
  };
  /** `cage`: the new one's vertices; `poses` of the old one, one after the other, become poses of the new one. */
  carry: {
    input: { model: Float32Array; cage: Float32Array; old: CageArrays; poses: Float32Array };
    step: never;
    output: Float32Array;
  };
  /** Makes ready to pull a model; what was being pulled is dropped. */
  pullOpen: {
    input: { positions: Float32Array; triangles: Uint32Array; cage: CageArrays };
    step: never;
    output: null;
  };
  pullGrab: { input: GrabInput; step: never; output: Grabbed };
  pullFrame: { input: { to: Float32Array }; step: never; output: PullFrame };
  sample: { input: { id: string }; step: never; output: SampleArrays };
}

export type JobKind = keyof Jobs;

/** One step of a job. */
export type Step = Progress | Reading;

export type ToWorker =
  | { readonly kind: "start"; readonly module: WebAssembly.Module }
  | { readonly kind: "job"; readonly id: number; readonly job: JobKind; readonly input: unknown }
  | { readonly kind: "cancel"; readonly id: number };

export type FromWorker =
  | { readonly kind: "step"; readonly id: number; readonly step: Step }
  | { readonly kind: "done"; readonly id: number; readonly output: unknown }
  | { readonly kind: "failed"; readonly id: number; readonly name: string; readonly message: string };
