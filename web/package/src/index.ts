/** The package in a browser: what `Api` describes, each function in a worker but `deform`. */

import { createApi } from "./api";
import { compile } from "./session/artifact";
import { createClient } from "./session/client";

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
const { bind, generateCage, deform, reshape, readModel } = api;

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
export { bind, deform, generateCage, readModel, reshape };
