/** Launch options of Debian's Chromium, in which the tests run. */

const QUIET_FLAGS = [
  "--headless=new",
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

/**
 * Software rendering: Mesa draws the page and WebGL, in a quarter of the processor time that SwiftShader takes for
 * WebGL. WebGPU runs on SwiftShader, the only adapter that Chromium offers without a graphics card.
 */
const SOFTWARE = ["--use-angle=gl-egl", "--ignore-gpu-blocklist"];

const launch = (args: readonly string[]) => ({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: [...args, ...SOFTWARE, ...QUIET_FLAGS],
});

/** Launch options of Chromium with WebGPU. */
export const WEBGPU_LAUNCH = launch(["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]);

/** Launch options of Chromium with WebGL2. The processor composes the page, and WebGPU canvases are not supported. */
export const WEBGL_LAUNCH = launch(["--disable-gpu-compositing"]);
