/** Messages between page and worker. */

import type {
  BindOptions,
  BindReport,
  BoundArrays,
  CageArrays,
  CageOptions,
  CheckedCage,
  Coordinates,
  FoldArrays,
  GrabInput,
  GrabResult,
  NamedFile,
  PoseArrays,
  Problem,
  Progress,
  ProportionRange,
  ProportionsRequest,
  PullFrame,
  Reading,
  Repair,
  RigArrays,
  RigOptions,
  UpAxis,
} from "../contract";

/** A decoded image, RGBA, rows from top to bottom. */
export interface Texture {
  readonly width: number;
  readonly height: number;
  readonly rgba: Uint8Array;
}

/** What models take: pixels of their textures, and memory of their files and arrays in bytes. */
export interface Held {
  readonly pixels: number;
  readonly bytes: number;
}

/** A file that a worker has read successfully. */
export interface ReadModel {
  /** Arrays of each model, for `LoadedModel.restore`. */
  readonly models: Uint8Array[][];
  readonly held: Held;
  /** Textures of each model, by index; null for those that are missing or that this browser cannot decode. */
  readonly textures: readonly (readonly (Texture | null)[])[];
  /** The cage of a project. */
  readonly cage: CheckedCage | undefined;
  readonly notices: readonly string[];
  /** Number of vertices of all models. */
  readonly vertices: number;
}

/** Sparse rows whose columns and weights stay in the worker until the job `rows` has fetched the last of them. */
export type KeptRows = Omit<BoundArrays, "indices" | "data"> & {
  /** Number of this bind, for `rows`. */
  readonly key: number;
  readonly report: BindReport | undefined;
};

export interface SampleArrays {
  readonly read: ReadModel;
  readonly poses: readonly PoseArrays[];
  /** Point of the model that the page suggests to pull first, object units. */
  readonly grip: readonly number[];
}

/** Input, progress and output of each job. */
export interface Jobs {
  bind: {
    /** The last `extra` positions are points of the model's rig, such as joints, instead of vertices. */
    input: { positions: Float32Array; extra: number; cage: CageArrays; options: BindOptions };
    step: Progress;
    output: BoundArrays & { readonly report: BindReport | undefined };
  };
  /** Like `bind`, but the worker keeps columns and weights for `rows`. */
  bindKept: { input: Jobs["bind"]["input"]; step: Progress; output: KeptRows };
  /** Columns and values of the weights `start` to `end - 1` of the last `bindKept`, counted over all rows. */
  rows: {
    input: { key: number; start: number; end: number };
    step: never;
    output: [Uint32Array, Float32Array];
  };
  formula: {
    input: { kind: Coordinates; positions: Float32Array; cage: CageArrays };
    step: never;
    output: BoundArrays;
  };
  /** A model's vertices and triangles. */
  model: {
    /** `states`: append the vertices of the morph targets and, if `clip` is given, of the clip's frames. */
    input: { files: readonly NamedFile[]; states: boolean; clip: string | undefined };
    step: Reading;
    output: {
      positions: Float32Array;
      triangles: Uint32Array;
      origin: Float64Array;
      rig?: RigArrays | undefined;
    };
  };
  /** Deforms a model's file with a posed cage. */
  reshape: {
    input: {
      files: readonly NamedFile[];
      /** The origin to which the cage and the pose are relative. */
      origin: Float64Array;
      cage: CageArrays;
      posed: Float32Array;
      options: BindOptions;
      rig: RigOptions;
    };
    step: Step;
    output: Uint8Array;
  };
  /** Poses the cage of a humanoid by proportions. */
  proportions: {
    input: {
      files: readonly NamedFile[];
      /** The origin to which the cage is relative. */
      origin: Float64Array;
      cage: CageArrays;
      request: ProportionsRequest;
      options: BindOptions;
    };
    step: Step;
    output: Float32Array;
  };
  slice: {
    input: { cage: CageArrays; axis: number; fraction: number; options: BindOptions };
    step: Progress;
    output: BoundArrays | undefined;
  };
  lattice: {
    /** `cells`: lattice cells along the cage's longest side; undefined for the lattice of splats and clips. */
    input: { cage: CageArrays; cells?: number | undefined; options: BindOptions };
    step: Progress;
    output: BoundArrays;
  };
  cage: {
    /** `positions` and `triangles` are what the cage must enclose; `model` is the model at rest, for the check. */
    input: {
      positions: Float32Array;
      triangles: Uint32Array;
      rig: RigArrays | undefined;
      model: Float32Array;
      options: CageOptions;
      smooth: number;
    };
    /** `skeleton`: segments of the model's skeleton, once, before the cage is made along it. `[n_segments, 2, 3]` */
    step: Progress & { readonly skeleton?: Float32Array };
    output: CheckedCage;
  };
  read: {
    /** `held`: what the other models take that are open together with this one; nothing by default. */
    input: { files: readonly NamedFile[]; up: UpAxis | undefined; held?: Held };
    step: Reading;
    output: ReadModel;
  };
  /**
   * Gives clothes the joints, joint weights and morph targets of a body. `clothes`, `body`: arrays of
   * `Engine.storedModel`; `held`: what the other models take. `report`: a sentence about what was
   * copied.
   */
  copyRig: {
    input: { clothes: Uint8Array[]; body: Uint8Array[]; held: Held };
    step: Reading;
    output: ReadModel & { readonly report: string };
  };
  /** `model`: the vertices that the cage must enclose, `[n_vertices, 3]`, relative to `origin`. */
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
  check: { input: { cage: CageArrays; model: Float32Array }; step: never; output: readonly Problem[] };
  repair: {
    input: { kind: Repair; cage: CageArrays; model: Float32Array };
    step: never;
    output: CheckedCage;
  };
  /** Converts poses of the cage `old` to poses of the cage with the vertices `cage`. `poses` are concatenated. */
  carry: {
    input: { model: Float32Array; cage: Float32Array; old: CageArrays; poses: Float32Array };
    step: never;
    output: Float32Array;
  };
  /** Prepares pulls of a model. Replaces the model of the previous `pullOpen`. */
  pullOpen: {
    input: { positions: Float32Array; triangles: Uint32Array; cage: CageArrays };
    step: never;
    output: null;
  };
  /** Factors of proportions within which the model does not fold. */
  folds: { input: FoldArrays; step: never; output: readonly ProportionRange[] };
  pullGrab: { input: GrabInput; step: never; output: GrabResult };
  pullFrame: { input: { to: Float32Array }; step: never; output: PullFrame };
  /** Builds a sample. `name`: file name of its model, with the extension .glb. */
  sample: { input: { id: string; name: string }; step: never; output: SampleArrays };
}

export type JobKind = keyof Jobs;

/** Progress of a job. */
export type Step = Progress | Reading;

export type WorkerRequest =
  | { readonly kind: "start"; readonly module: WebAssembly.Module }
  | { readonly kind: "job"; readonly id: number; readonly job: JobKind; readonly input: unknown }
  | { readonly kind: "cancel"; readonly id: number };

export type WorkerReply =
  | { readonly kind: "step"; readonly id: number; readonly step: Step }
  | { readonly kind: "done"; readonly id: number; readonly output: unknown }
  | { readonly kind: "failed"; readonly id: number; readonly name: string; readonly message: string };

/** Collects the buffers of all typed arrays in a message, without duplicates, to be transferred instead of copied. */
export function buffers(value: unknown): ArrayBuffer[] {
  const found = new Set<ArrayBuffer>();
  const look = (value: unknown): void => {
    if (ArrayBuffer.isView(value)) {
      if (value.buffer instanceof ArrayBuffer) found.add(value.buffer);
    } else if (value instanceof Map) for (const item of value.values()) look(item);
    else if (typeof value === "object" && value !== null) for (const item of Object.values(value)) look(item);
  };
  look(value);
  return [...found];
}
