/** The package in a browser. Every function except `deform` runs in a worker. */

import { createApi, type Runtime } from "./api";
import { type Artifact, compile } from "./session/artifact";
import { createClient } from "./session/client";
import { loadPart } from "./session/parts";
import type { Api } from "./types";

/** Maximum number of parallel workers. A bind keeps one core busy, and each worker takes memory. */
const MAX_WORKERS = 4;

const api = /* @__PURE__ */ createApi(
  async () => runtimeOf((await loadPart(import("./session/webgpu"))).WEBGPU),
  async () => runtimeOf((await loadPart(import("./session/compute"))).COMPUTE),
);

async function runtimeOf({ pkg, wasm, openWorker }: Artifact): Promise<Runtime> {
  const module = await compile(wasm);
  await pkg.default({ module_or_path: module });
  const most = Math.min(MAX_WORKERS, navigator.hardwareConcurrency);
  const openClient = () => createClient(module, openWorker);
  return { pkg, openClient, most, hasGpu: "gpu" in navigator };
}

// The functions are documented here and not at `Api`, because editors show the comment of the imported name.
/**
 * Binds points, `[n, 3]`, to a cage by harmonic coordinates. Runs on the processor, or with `backend: "gpu"` through
 * WebGPU. Rejects with an error whose `name` is an `ErrorName`, or with the signal's reason.
 */
export const bind: Api["bind"] = api.bind;
/** Generates a cage that strictly encloses a model. The model may be any triangle soup. */
export const generateCage: Api["generateCage"] = api.generateCage;
/** Positions of the points in a pose of the cage, `[n_points, 3]`. Runs on the calling thread. */
export const deform: Api["deform"] = api.deform;
/**
 * The deformation of the space in and around a posed cage, for points that are not bound. The lattice is bound in a
 * worker; the methods of the result run on the calling thread.
 */
export const field: Api["field"] = api.field;
/**
 * Deforms the file of a model with a posed cage. A glTF keeps its rig, clips, morph targets and materials and is
 * returned as a GLB.
 */
export const reshape: Api["reshape"] = api.reshape;
/**
 * Pose of the cage of a rigged humanoid, `[n_controls, 3]`: longer legs, a bigger head. `factors`: from 0.5 to 2, by
 * names such as `leg`, `head` or `left_arm`. Give the pose to `reshape` with `ground: true`.
 */
export const proportions: Api["proportions"] = api.proportions;
/**
 * Vertices and triangles of a file, in the order in which `reshape` binds them. With `states`, also the vertices of its
 * morph targets, for a cage that encloses them.
 */
export const readModel: Api["readModel"] = api.readModel;

export type {
  BindOptions,
  BindReport,
  CageControls,
  CageKind,
  CageOptions,
  ErrorName,
  Problem,
  RigArrays,
  RigOptions,
  Rings,
} from "./contract/generated";
export type * from "./types";
