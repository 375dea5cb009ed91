/** The package's functions and what they take and give: all that a user's compiler reads. */

import type {
  BindOptions,
  BindReport,
  CageControls,
  CageOptions,
  Offsets,
  Problem,
  Progress,
  RigOptions,
} from "./contract/generated";
import type { Reading } from "./contract/work";

/** What can be followed, and given up. */
export interface Follow {
  /** Ends the work at once; the promise is rejected with the signal's reason. */
  readonly signal?: AbortSignal | undefined;
  readonly onProgress?: ((progress: Progress | Reading) => void) | undefined;
}

/**
 * What 32-bit positions are seen from, `[3]`, object units: the origin of a model far from the world's, as coordinates of a map are;
 * `[0, 0, 0]` unless told. A model, its cage, poses and points have the same one.
 */
export interface Placed {
  readonly origin?: ArrayLike<number> | undefined;
}

/** Vertices `[n, 3]` in object units, and triangles `[n, 3]`, flattened. */
export interface Mesh extends Placed {
  readonly positions: ArrayLike<number>;
  readonly triangles: ArrayLike<number>;
}

/** A mesh of a file. */
export interface ModelMesh extends Mesh {
  readonly positions: Float32Array;
  readonly triangles: Uint32Array;
  readonly origin: Float64Array;
}

/** A closed mesh of polygons. */
export interface Cage extends Placed {
  /** Vertices `[n_cage, 3]`, object units; a pose is another array of that length. */
  readonly positions: ArrayLike<number>;
  /** For each face the number of its corners, then them, counter-clockwise seen from outside. */
  readonly corners: ArrayLike<number>;
  /** Steps of subdivision, and controls inside, whose positions come last. */
  readonly controls?: CageControls | undefined;
}

/** A cage that was made for a model. */
export interface GeneratedCage extends Cage {
  readonly positions: Float32Array;
  readonly corners: Uint32Array;
  /** What a check of it found; nothing of severity "error". */
  readonly problems: readonly Problem[];
}

/** Weights as compressed sparse rows: a row a point, a column a control. Each row sums to 1. */
export interface Weights {
  /** `[n_points + 1]` */
  readonly indptr: Uint32Array;
  /** `[n_nonzeros]` */
  readonly indices: Uint32Array;
  /** `[n_nonzeros]`, dimensionless. */
  readonly data: Float32Array;
  /** The columns from `controls` on, which carry offsets, and the points outside the cage. */
  readonly offsets: Offsets;
  /** Columns of controls: the first. */
  readonly controls: number;
}

export interface Bound {
  readonly weights: Weights;
  /** As `cagework bind --report` writes it. */
  readonly report: BindReport;
}

/** A file: `name` says of what kind, "model.glb" unless told. */
export type File = Uint8Array | ArrayBuffer | Blob;
export interface Named {
  readonly name?: string | undefined;
}

/** `states`: after the vertices also where each morph target takes them, and `clip`: the name of a clip, the frames of it: what a
 * cage should enclose. */
export interface ReadAsked extends Follow, Named {
  readonly states?: boolean | undefined;
  readonly clip?: string | undefined;
}

export type BindAsked = Follow & Partial<BindOptions>;
export type CageAsked = Follow & Partial<CageOptions>;
/** `plain`: the shape alone, no rig. */
export type ReshapeAsked = Follow & Named & Partial<BindOptions> & Partial<Omit<RigOptions, "dynamic">>;

/** What index.ts exports, and says of it. */
export interface Api {
  bind(points: ArrayLike<number>, cage: Cage, options?: BindAsked): Promise<Bound>;
  generateCage(mesh: Mesh, options?: CageAsked): Promise<GeneratedCage>;
  deform(weights: Weights, posed: ArrayLike<number>): Promise<Float32Array>;
  reshape(
    model: File,
    cage: Cage,
    posed: ArrayLike<number>,
    options?: ReshapeAsked,
  ): Promise<Uint8Array<ArrayBuffer>>;
  readModel(model: File, options?: ReadAsked): Promise<ModelMesh>;
}
