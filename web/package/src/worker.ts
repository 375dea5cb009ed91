/** The worker of the build for WebGPU. */

import * as pkg from "./pkg/cagework";
import { serve } from "./session/serve";

serve(pkg);
