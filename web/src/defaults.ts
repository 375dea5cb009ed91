/** Defaults and ranges of options, generated from Rust, which documents the reasons. */

import { BIND_DEFAULTS, type BindOptions } from "@cagework/core/contract/generated";

export {
  BIND_DEFAULTS,
  CAGE_DEFAULTS,
  COMPANION_ENDINGS,
  COORDINATES,
  MODEL_ENDINGS,
  MODEL_TYPES,
  RIG_DEFAULTS,
  SCENE_DEFAULTS,
  SHAPE_FORMATS,
  SLIDERS,
} from "@cagework/core/contract/generated";

/** The published method. */
export const PAPER_DEFAULTS: BindOptions = { ...BIND_DEFAULTS, method: "classic", solver: "jacobi" };
