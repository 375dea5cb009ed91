/** Defaults and ranges of options, generated from Rust, which documents the reasons. */

import { BIND_DEFAULTS, type BindOptions, CAGE_DEFAULTS } from "@cagework/core/contract/generated";

export {
  BIND_DEFAULTS,
  CAGE_DEFAULTS,
  COMPANION_ENDINGS,
  COORDINATES,
  MODEL_ENDINGS,
  MODEL_TYPES,
  RANGES,
  RIG_DEFAULTS,
  SCENE_DEFAULTS,
  SHAPE_FORMATS,
} from "@cagework/core/contract/generated";

/** `detail` at the right end of the slider *Closeness*. */
export const FINEST_DETAIL = CAGE_DEFAULTS.detail / 4;

/** The published method. */
export const PAPER_DEFAULTS: BindOptions = { ...BIND_DEFAULTS, method: "classic", solver: "jacobi" };
