/** What the package does, over whatever opens a worker: in a browser, or in Node. */

import { indicesOf, optionsOf, pointsOf, poseOf, requireKnown, trianglesOf } from "./check";
import type {
  BindOptions,
  BindReport,
  CageArrays,
  CageControls,
  CageOptions,
  NamedFile,
  Problem,
  RigOptions,
} from "./contract";
import { BIND_DEFAULTS, CAGE_DEFAULTS, RIG_DEFAULTS } from "./contract/generated";
import type { Deformer } from "./pkg/cagework";
import { createPool, type Follow } from "./pool";
import type { Package } from "./session/artifact";
import { type Client, named } from "./session/client";

/** Vertices `[n, 3]` in object units, and triangles `[n, 3]`, flattened. */
export interface Mesh {
  readonly positions: ArrayLike<number>;
  readonly triangles: ArrayLike<number>;
}

/** A closed mesh of polygons. */
export interface Cage {
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
  /** For each point outside the cage: the point, and the corners of its frame. `[n_outside, 4]` */
  readonly outside: Uint32Array;
  /** Where it is in that frame. `[n_outside, 3]` */
  readonly offsets: Float32Array;
  /** Columns. */
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

export type BindAsked = Follow & Partial<BindOptions>;
export type CageAsked = Follow & Partial<CageOptions>;
/** `plain`: the shape alone, no rig. */
export type ReshapeAsked = Follow & Named & Partial<BindOptions> & Partial<Omit<RigOptions, "dynamic">>;

export interface Api {
  /**
   * Binds points, `[n, 3]`, to a cage by harmonic coordinates. On the processor, with the command's numbers; `backend: "gpu"`
   * takes WebGPU.
   */
  bind(points: ArrayLike<number>, cage: Cage, options?: BindAsked): Promise<Bound>;
  /** A cage that encloses a model strictly; the model may be any triangle soup. */
  generateCage(mesh: Mesh, options?: CageAsked): Promise<GeneratedCage>;
  /** Where the points are in a pose of the cage, `[n_points, 3]`: on this thread, once the module is there. */
  deform(weights: Weights, posed: ArrayLike<number>): Promise<Float32Array>;
  /** The file of a model as it follows a posed cage: a glTF keeps rig, clips, morph targets and materials, as a GLB. */
  reshape(
    model: File,
    cage: Cage,
    posed: ArrayLike<number>,
    options?: ReshapeAsked,
  ): Promise<Uint8Array<ArrayBuffer>>;
  /** Vertices and triangles of a file, in the order that `reshape` binds them in. */
  readModel(
    model: File,
    options?: Follow & Named,
  ): Promise<{ positions: Float32Array; triangles: Uint32Array }>;
}

/** The module, ready on this thread, and workers. */
export interface Runtime {
  readonly pkg: Package;
  openClient(): Client;
  /** Jobs at a time. */
  readonly most: number;
  readonly hasGpu: boolean;
}

const FOLLOWED: Required<{ [K in keyof Follow]: null }> = { signal: null, onProgress: null };

export function createApi(open: () => Promise<Runtime>): Api {
  const runtime = once(open);
  const workers = once(async () => {
    const { openClient, most } = await runtime();
    return createPool(openClient, most);
  });
  const requireGpu = async ({ backend }: Partial<BindOptions>) => {
    if (backend !== "gpu" || (await runtime()).hasGpu) return;
    throw named("NoAdapter", 'there is no WebGPU here: leave out backend: "gpu"');
  };
  const deformers = new WeakMap<Weights, Deformer>();

  return {
    async bind(points, cage, options = {}) {
      requireKnown(options, FOLLOWED, BIND_ON_CPU);
      const input = {
        positions: pointsOf("points", points),
        extra: 0,
        cage: cageOf(cage),
        options: bindOptions(options),
      };
      await requireGpu(options);
      const { report, ...arrays } = await (await workers()).run("bind", input, options);
      if (!report) throw named("Error", "the bind left no report");
      return { weights: { ...arrays, controls: input.cage.positions.length / 3 }, report };
    },
    async generateCage(mesh, options = {}) {
      requireKnown(options, FOLLOWED, CAGE_DEFAULTS);
      const positions = pointsOf("positions", mesh.positions);
      const triangles = trianglesOf("triangles", mesh.triangles);
      const asked = optionsOf(CAGE_DEFAULTS, options);
      const input = { positions, triangles, model: positions, options: asked, smooth: 0 };
      const made = await (await workers()).run("cage", input, options);
      return {
        positions: made.positions,
        corners: made.corners,
        problems: made.check?.problems ?? [],
      };
    },
    async deform(weights, posed) {
      const pose = pointsOf("posed", posed);
      const { pkg } = await runtime();
      let deformer = deformers.get(weights);
      if (!deformer) {
        const { controls, indptr, indices, data, outside, offsets } = weights;
        deformer = new pkg.Deformer(controls, indptr, indices, data, outside, offsets);
        deformers.set(weights, deformer);
      }
      return deformer.deform(pose);
    },
    async reshape(model, cage, posed, options = {}) {
      const { dynamic: _, ...rigs } = RIG_DEFAULTS;
      requireKnown(options, FOLLOWED, { name: null }, BIND_ON_CPU, rigs);
      const arrays = cageOf(cage);
      const input = {
        files: [fileOf(model, options)],
        cage: arrays,
        posed: poseOf(posed, arrays.positions),
        options: bindOptions(options),
        rig: optionsOf(RIG_DEFAULTS, options),
      };
      await requireGpu(options);
      return (await (await workers()).run("reshape", input, options)) as Uint8Array<ArrayBuffer>;
    },
    async readModel(model, options = {}) {
      requireKnown(options, FOLLOWED, { name: null });
      return (await workers()).run("model", { files: [fileOf(model, options)] }, options);
    },
  };
}

/** What failed, a download perhaps, is tried again by the next call. */
function once<T>(open: () => Promise<T>): () => Promise<T> {
  let opening: Promise<T> | undefined;
  return () => {
    opening ??= open().catch((error: unknown) => {
      opening = undefined;
      throw error;
    });
    return opening;
  };
}

const BIND_ON_CPU: BindOptions = { ...BIND_DEFAULTS, backend: "cpu" };

/** The classic method comes with its own solver, as in the command. */
function bindOptions(given: Partial<BindOptions>): BindOptions {
  const solver = given.method === "classic" ? "jacobi" : BIND_ON_CPU.solver;
  return optionsOf({ ...BIND_ON_CPU, solver }, given);
}

function cageOf({ positions, corners, controls }: Cage): CageArrays {
  return {
    positions: pointsOf("cage.positions", positions),
    corners: indicesOf("cage.corners", corners),
    controls,
  };
}

function fileOf(model: File, { name = "model.glb" }: Named): NamedFile {
  const isBytes = model instanceof Uint8Array || model instanceof ArrayBuffer;
  if (!isBytes && !(model instanceof Blob)) {
    throw named("Error", "model must be the bytes of a file: a Uint8Array, an ArrayBuffer or a Blob");
  }
  const file = model instanceof Blob ? model : new Blob([model as BlobPart]);
  return { name, path: name, file };
}
