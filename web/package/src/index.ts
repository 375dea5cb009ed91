/** The package in a browser: each function in a worker but `deform`. */

import { createApi } from "./api";
import { compile } from "./session/artifact";
import { createClient } from "./session/client";
import type { Api } from "./types";

/** Binds take a core each; more than these would only take memory. */
const MOST = 4;

const api = /* @__PURE__ */ createApi(async () => {
  const { WEBGPU } = await import("./session/webgpu");
  const module = await compile(WEBGPU.wasm);
  await WEBGPU.pkg.default({ module_or_path: module });
  const most = Math.min(MOST, navigator.hardwareConcurrency);
  const openClient = () => createClient(module, WEBGPU.openWorker);
  return { pkg: WEBGPU.pkg, openClient, most, hasGpu: "gpu" in navigator };
});

// Each with its sentence: editors show what stands at the name that is imported.
/**
 * Binds points, `[n, 3]`, to a cage by harmonic coordinates. On the processor, with the command's numbers; `backend: "gpu"`
 * takes WebGPU. A promise here is rejected with an error whose `name` is an `ErrorName`, or with the signal's reason.
 */
export const bind: Api["bind"] = api.bind;
/** A cage that encloses a model strictly; the model may be any triangle soup. */
export const generateCage: Api["generateCage"] = api.generateCage;
/** Where the points are in a pose of the cage, `[n_points, 3]`: on this thread, once the module is there. */
export const deform: Api["deform"] = api.deform;
/** The file of a model as it follows a posed cage: a glTF keeps rig, clips, morph targets and materials, as a GLB. */
export const reshape: Api["reshape"] = api.reshape;
/** Vertices and triangles of a file, in the order that `reshape` binds them in; with `states` what a cage should enclose. */
export const readModel: Api["readModel"] = api.readModel;

export type {
  BindOptions,
  BindReport,
  CageControls,
  CageOptions,
  ErrorName,
  Problem,
  RigOptions,
} from "./contract/generated";
export type * from "./types";
