/** The worker of the build for WebGL2, which computes everything on the processor. */

import * as pkg from "./pkg-webgl/cagework_webgl";
import type { Package } from "./session/artifact";
import { serve } from "./session/serve";

serve(pkg as unknown as Package);
