/** The browser that all tests run in: Debian's Chromium. */

const QUIET = [
  "--headless=new",
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

/** Graphics made of processor cores, which needs no graphics card. */
const SOFTWARE = ["--use-angle=swiftshader", "--ignore-gpu-blocklist"];

const launch = (args: readonly string[]) => ({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: [...args, ...SOFTWARE, ...QUIET],
});

/** With a real WebGPU device. */
export const WITH_WEBGPU = launch([
  "--enable-unsafe-webgpu",
  "--enable-features=Vulkan",
  "--use-vulkan=swiftshader",
  "--use-webgpu-adapter=swiftshader",
]);

/** With WebGL2, and nothing that would bring WebGPU. */
export const WITH_WEBGL = launch(["--enable-unsafe-swiftshader"]);
