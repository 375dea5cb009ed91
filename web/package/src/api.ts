/** The package's functions, for any runtime that can open workers: browser or Node. */

import { indicesOf, optionsOf, originOf, pointsOf, poseOf, requireKnown, trianglesOf } from "./check";
import type { BindOptions, CageArrays, NamedFile } from "./contract";
import { BIND_DEFAULTS, CAGE_DEFAULTS, RIG_DEFAULTS, USUAL_SOLVERS } from "./contract/generated";
import type { Deformer } from "./pkg/cagework";
import { createPool, type Pool } from "./pool";
import type { Package } from "./session/artifact";
import { type Client, named } from "./session/client";
import type { JobKind, Jobs } from "./session/messages";
import type { Api, Cage, CallOptions, File, NameOption, Weights } from "./types";

/** The wasm module, initialised on the calling thread, and a way to open workers. */
export interface Runtime {
  readonly pkg: Package;
  openClient(): Client;
  /** Maximum number of jobs that run in parallel. */
  readonly most: number;
  readonly hasGpu: boolean;
}

const CALL_OPTIONS: Required<{ [K in keyof CallOptions]: null }> = { signal: null, onProgress: null };

/**
 * Creates the functions. `openFull` opens the build with files and the GPU, `openCompute` the smaller one that suffices
 * for the other functions. They use the full build if it is open already.
 */
export function createApi(openFull: () => Promise<Runtime>, openCompute = openFull): Api {
  const full = new Build(openFull);
  const compute = openCompute === openFull ? full : new Build(openCompute);
  const buildFor = ({ backend }: Partial<BindOptions> = {}) =>
    backend === "gpu" || full.isOpen ? full : compute;
  /**
   * Runs a job in a worker of a build. Rejects immediately if `signal` aborts or `onProgress` throws an error, even while the job
   * is queued or the module loads.
   */
  const run = <K extends JobKind>(
    build: Build,
    job: K,
    input: Jobs[K]["input"],
    { signal, onProgress }: CallOptions,
  ) =>
    new Promise<Jobs[K]["output"]>((resolve, reject) => {
      const ended = new AbortController();
      const giveUp = (reason: unknown) => {
        ended.abort();
        reject(reason);
      };
      const hearSignal = () => giveUp(signal?.reason);
      if (signal?.aborted) return hearSignal();
      signal?.addEventListener("abort", hearSignal);
      const hearStep = (step: Jobs[K]["step"]) => {
        try {
          onProgress?.(step);
        } catch (error) {
          giveUp(error);
        }
      };
      build
        .workers()
        .then((pool) => pool.run(job, input, ended.signal, hearStep))
        .then(resolve, reject)
        .finally(() => signal?.removeEventListener("abort", hearSignal));
    });
  const requireGpu = async ({ backend }: Partial<BindOptions>) => {
    if (backend !== "gpu" || (await full.runtime()).hasGpu) return;
    throw named("NoAdapter", 'WebGPU is missing here: leave out backend: "gpu"');
  };
  const deformers = new WeakMap<Weights, Deformer>();

  return {
    async bind(points, cage, options = {}) {
      requireKnown(options, CALL_OPTIONS, BIND_ON_CPU);
      const input = {
        positions: pointsOf("points", points),
        extra: 0,
        cage: cageOf(cage),
        options: bindOptions(options),
      };
      await requireGpu(options);
      const { report, ...arrays } = await run(buildFor(options), "bind", input, options);
      if (!report) throw named("Error", "the bind left no report");
      return { weights: { ...arrays, controls: input.cage.positions.length / 3 }, report };
    },
    async generateCage(mesh, options = {}) {
      requireKnown(options, CALL_OPTIONS, CAGE_DEFAULTS);
      const positions = pointsOf("positions", mesh.positions);
      const triangles = trianglesOf("triangles", mesh.triangles);
      const asked = optionsOf(CAGE_DEFAULTS, options);
      const { origin, rig } = mesh;
      const input = { positions, triangles, rig, model: positions, options: asked, smooth: 0 };
      if (origin) originOf("origin", origin);
      const made = await run(buildFor(), "cage", input, options);
      return {
        ...(origin ? { origin } : {}),
        positions: made.positions,
        corners: made.corners,
        problems: made.check ?? [],
        kind: made.kind ?? asked.kind,
        ...(made.refusal === undefined ? {} : { refusal: made.refusal }),
        ...(made.rings === undefined ? {} : { rings: made.rings }),
      };
    },
    async deform(weights, posed) {
      const pose = pointsOf("posed", posed);
      const { pkg } = await buildFor().runtime();
      let deformer = deformers.get(weights);
      if (!deformer) {
        deformer = new pkg.Deformer(weights.controls, weights);
        deformers.set(weights, deformer);
      }
      return deformer.deform(pose);
    },
    async field(cage, posed, { cells = 64, ...options } = {}) {
      requireKnown(options, CALL_OPTIONS, BIND_ON_CPU);
      const arrays = cageOf(cage);
      const input = { cage: arrays, cells, options: bindOptions(options) };
      const pose = poseOf(posed, arrays.positions);
      await requireGpu(options);
      const build = buildFor(options);
      const { pkg } = await build.runtime();
      const map = new pkg.FieldMap(arrays, cells, await run(build, "lattice", input, options));
      map.pose(pose);
      return {
        pose: (next) => map.pose(poseOf(next, arrays.positions)),
        map: (points) => map.map(pointsOf("points", points)),
        inverse: (points) => map.inverse(pointsOf("points", points)),
        gradient: (points) => map.gradient(pointsOf("points", points)),
        texture() {
          const [x = 0, y = 0, z = 0, spacing = 0] = map.frame;
          const [nx = 0, ny = 0, nz = 0] = map.dims;
          return { data: map.displacements, size: [nx, ny, nz], origin: [x, y, z], spacing };
        },
      };
    },
    async reshape(model, cage, posed, options = {}) {
      const { dynamic: _, expressions: __, ...rigs } = RIG_DEFAULTS;
      requireKnown(options, CALL_OPTIONS, { name: null }, BIND_ON_CPU, rigs);
      const arrays = cageOf(cage);
      const input = {
        files: [fileOf(model, options)],
        origin: originOf("cage.origin", cage.origin ?? [0, 0, 0]),
        cage: arrays,
        posed: poseOf(posed, arrays.positions),
        options: bindOptions(options),
        rig: optionsOf(RIG_DEFAULTS, options),
      };
      await requireGpu(options);
      return (await run(full, "reshape", input, options)) as Uint8Array<ArrayBuffer>;
    },
    async proportions(model, cage, factors, options = {}) {
      const { preset = null, bones = {}, ...rest } = options;
      requireKnown(rest, CALL_OPTIONS, { name: null }, BIND_ON_CPU);
      const input = {
        files: [fileOf(model, options)],
        origin: originOf("cage.origin", cage.origin ?? [0, 0, 0]),
        cage: cageOf(cage),
        request: { factors, preset, bones },
        options: bindOptions(rest),
      };
      await requireGpu(rest);
      return run(full, "proportions", input, rest);
    },
    async readModel(model, options = {}) {
      requireKnown(options, CALL_OPTIONS, { name: null, states: null, clip: null });
      const { states = false, clip } = options;
      return run(full, "model", { files: [fileOf(model, options)], states, clip }, options);
    },
  };
}

/** A build of the wasm module: opened by the first function that needs it. */
class Build {
  /** Whether it was opened, or is being opened. */
  isOpen = false;
  readonly runtime: () => Promise<Runtime>;
  readonly workers: () => Promise<Pool>;

  constructor(open: () => Promise<Runtime>) {
    const runtime = once(open);
    this.runtime = async () => {
      this.isOpen = true;
      return runtime().catch((error: unknown) => {
        this.isOpen = false;
        throw error;
      });
    };
    this.workers = once(async () => {
      const { openClient, most } = await this.runtime();
      return createPool(openClient, most);
    });
  }
}

/** Returns a function that calls `open` once. After a failure, such as a failed download, its next call tries again. */
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

/** Fills in missing options. The default solver depends on the method. */
function bindOptions(given: Partial<BindOptions>): BindOptions {
  const solver = USUAL_SOLVERS[given.method ?? BIND_ON_CPU.method];
  return optionsOf({ ...BIND_ON_CPU, solver }, given);
}

function cageOf({ positions, corners, controls }: Cage): CageArrays {
  return {
    positions: pointsOf("cage.positions", positions),
    corners: indicesOf("cage.corners", corners),
    controls,
  };
}

function fileOf(model: File, { name = "model.glb" }: NameOption): NamedFile {
  const isBytes = model instanceof Uint8Array || model instanceof ArrayBuffer;
  if (!isBytes && !(model instanceof Blob)) {
    throw named("Error", "model must be the bytes of a file: a Uint8Array, an ArrayBuffer or a Blob");
  }
  const file = model instanceof Blob ? model : new Blob([model as BlobPart]);
  return { name, path: name, file };
}
