/** Public types of the package. */

import type {
  BindOptions,
  BindReport,
  CageControls,
  CageKind,
  CageOptions,
  Offsets,
  Problem,
  Progress,
  RigArrays,
  RigOptions,
  Rings,
} from "./contract/generated";
import type { Reading } from "./contract/work";

/** Options of all functions that run in a worker. */
export interface CallOptions {
  /** Aborting the signal cancels the call at once; the promise is rejected with the signal's reason. */
  readonly signal?: AbortSignal | undefined;
  readonly onProgress?: ((progress: Progress | Reading) => void) | undefined;
}

/**
 * Origin to which 32-bit positions are relative, `[3]`, object units. It is not zero for models far from the world's
 * origin, such as those in map coordinates. A model, its cage, poses and points must have the same origin. Default `[0,
 * 0, 0]`.
 */
export interface OriginOption {
  readonly origin?: ArrayLike<number> | undefined;
}

/** Vertices `[n, 3]` in object units, and triangles `[n, 3]`, flattened. */
export interface Mesh extends OriginOption {
  readonly positions: ArrayLike<number>;
  readonly triangles: ArrayLike<number>;
  /** Joints of the model at rest, along which `generateCage` makes rings. */
  readonly rig?: RigArrays | undefined;
}

/** A mesh read from a file. */
export interface ModelMesh extends Mesh {
  readonly positions: Float32Array;
  readonly triangles: Uint32Array;
  readonly origin: Float64Array;
}

/** A cage: a closed mesh of polygons around a model, and optional controls inside. */
export interface Cage extends OriginOption {
  /** Vertices `[n_cage, 3]`, object units. A pose is another array of this length. */
  readonly positions: ArrayLike<number>;
  /** For each face, the number of its corners and then its vertices, counter-clockwise seen from outside. */
  readonly corners: ArrayLike<number>;
  /** Subdivision steps, and controls inside the cage. Their positions come after the cage vertices in `positions`. */
  readonly controls?: CageControls | undefined;
}

/** A cage that `generateCage` returns. */
export interface GeneratedCage extends Cage {
  readonly positions: Float32Array;
  readonly corners: Uint32Array;
  /** Result of the cage check. Contains no problem of severity "error". */
  readonly problems: readonly Problem[];
  /** Kind of the cage: "skeleton", "shell" or "hull". */
  readonly kind: CageKind;
  /** Why a cage of the kind "auto" has no rings, one sentence. */
  readonly refusal?: string;
  /** Rings of a cage of the kind "skeleton": the place of each vertex, and the names of the limbs. */
  readonly rings?: Rings;
}

/**
 * Weights as compressed sparse rows: one row per point; one column per control, then the columns of `offsets`. For
 * points inside the cage, the weights of the controls sum to 1.
 */
export interface Weights {
  /** Index of each row's first entry in `indices` and `data`. `[n_points + 1]` */
  readonly indptr: Uint32Array;
  /** Column of each entry. `[n_nonzeros]` */
  readonly indices: Uint32Array;
  /** Weight of each entry, dimensionless. `[n_nonzeros]` */
  readonly data: Float32Array;
  /** Meaning of the columns from `controls` on, and the points outside the cage. */
  readonly offsets: Offsets;
  /** Number of leading columns that belong to controls. */
  readonly controls: number;
}

export interface BindResult {
  readonly weights: Weights;
  /** The report that `cagework bind --report` writes. */
  readonly report: BindReport;
}

/** The bytes of a file. */
export type File = Uint8Array | ArrayBuffer | Blob;
export interface NameOption {
  /** Name of the file, whose extension determines the format. Default "model.glb". */
  readonly name?: string | undefined;
}

/**
 * `states`: append the vertices of each morph target and, if `clip` names a clip, of the clip's frames. A cage
 * generated around all of them encloses the moving model.
 */
export interface ReadCallOptions extends CallOptions, NameOption {
  readonly states?: boolean | undefined;
  readonly clip?: string | undefined;
}

export type BindCallOptions = CallOptions & Partial<BindOptions>;
export type CageCallOptions = CallOptions & Partial<CageOptions>;
/** `plain`: export the shape without its rig. */
export type ReshapeCallOptions = CallOptions &
  NameOption &
  Partial<BindOptions> &
  Partial<Omit<RigOptions, "dynamic" | "expressions">>;

/**
 * `preset`: start from the factors of a preset, such as "chibi". `bones`: names of joints by humanoid bones, with their
 * names in VRM 1.0, for bones that are not found.
 */
export type ProportionsCallOptions = CallOptions &
  NameOption &
  Partial<BindOptions> & {
    readonly preset?: string | undefined;
    readonly bones?: Readonly<Record<string, string>> | undefined;
  };

/** The deformation of the space in and around a cage, for points that are not bound. */
export interface Field {
  /** Sets the pose of the cage, without binding the lattice again. */
  pose(posed: ArrayLike<number>): void;
  /** Positions of points after the deformation, `[n, 3]`. */
  map(points: ArrayLike<number>): Float32Array;
  /** The points that `map` moves to the given positions, `[n, 3]`; NaN for positions that no point moves to. */
  inverse(points: ArrayLike<number>): Float32Array;
  /** Deformation gradients at points, `[n, 3, 3]`, by rows. */
  gradient(points: ArrayLike<number>): Float32Array;
  /**
   * Displacements at the nodes of the lattice, for a 3-D texture of shaders: `[nz, ny, nx, 4]`, x, y, z and a number
   * that shaders ignore. `origin` is the position of the first node and `spacing` the distance between adjacent nodes.
   */
  texture(): {
    readonly data: Float32Array;
    readonly size: readonly [number, number, number];
    readonly origin: readonly [number, number, number];
    readonly spacing: number;
  };
}

/** Options of `field`. `cells`: number of lattice cells along the cage's longest side, 8 to 256, default 64. */
export type FieldCallOptions = BindCallOptions & { readonly cells?: number | undefined };

/** The functions that index.ts exports and documents. */
export interface Api {
  bind(points: ArrayLike<number>, cage: Cage, options?: BindCallOptions): Promise<BindResult>;
  generateCage(mesh: Mesh, options?: CageCallOptions): Promise<GeneratedCage>;
  deform(weights: Weights, posed: ArrayLike<number>): Promise<Float32Array>;
  field(cage: Cage, posed: ArrayLike<number>, options?: FieldCallOptions): Promise<Field>;
  reshape(
    model: File,
    cage: Cage,
    posed: ArrayLike<number>,
    options?: ReshapeCallOptions,
  ): Promise<Uint8Array<ArrayBuffer>>;
  proportions(
    model: File,
    cage: Cage,
    factors: Readonly<Record<string, number>>,
    options?: ProportionsCallOptions,
  ): Promise<Float32Array>;
  readModel(model: File, options?: ReadCallOptions): Promise<ModelMesh>;
}
