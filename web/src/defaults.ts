/** What is chosen before anybody chose anything, and what can be: Rust's. The reasons are there, next to each option. */

import { BIND_DEFAULTS, type BindOptions } from "@cagework/core/contract/generated";

export {
  BIND_DEFAULTS,
  CAGE_DEFAULTS,
  MODEL_ENDINGS,
  RANGES,
  RIG_DEFAULTS,
  SCENE_DEFAULTS,
  SHAPE_FORMATS,
} from "@cagework/core/contract/generated";

/** What the paper did. */
export const PAPER_DEFAULTS: BindOptions = { ...BIND_DEFAULTS, method: "classic", solver: "jacobi" };
