/** The worker of the build without files and drawing. */

import * as pkg from "./pkg-compute/cagework_compute";
import type { Package } from "./session/artifact";
import { serve } from "./session/serve";

serve(pkg as unknown as Package);
