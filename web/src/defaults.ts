/** What is chosen before anybody chose anything. The reasons are in Rust, next to each option. */

import type { BindOptions, CageWish, SceneOptions } from "./contract";

export const BIND_DEFAULTS: BindOptions = {
  grid: 64,
  method: "embedded",
  solver: "multigrid",
  preconditioner: "none",
  backend: "gpu",
  cell_shape: "box",
  delta_norm: "euclidean",
  tau: 1e-5,
  max_iterations: 20_000,
  sparsify: 0,
  outside: "closest_point",
  memory_limit: 2 * 1024 ** 3,
};

/** What the paper did. */
export const PAPER_DEFAULTS: BindOptions = { ...BIND_DEFAULTS, method: "classic", solver: "jacobi" };

export const CAGE_DEFAULTS: CageWish = {
  vertices: 80,
  margin: 0,
  symmetry: "auto",
  voxels: 0,
  shape: "follow",
  per_component: false,
};

export const SCENE_DEFAULTS: SceneOptions = {
  theme: "dark",
  model: true,
  base_wireframe: false,
  cage: true,
  floor: true,
  original: false,
  colour: "material",
  slice: "off",
  gizmo: "none",
  compare: false,
  problems: true,
};
