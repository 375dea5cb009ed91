/** Text for browsers without WebGPU. */

export const without = {
  different:
    "The page draws with WebGL2 and computes on the processor instead. Everything works, but very fine grids take longer to bind, and very large models follow with a delay.",
  short: {
    NoWebGPU: "No WebGPU here",
    NoAdapter: "WebGPU found no graphics card",
    NoDevice: "WebGPU did not start",
  },
  reasons: {
    NoWebGPU: "This browser does not offer WebGPU, or it is switched off.",
    NoAdapter: "This browser has WebGPU but found no graphics card that it may use.",
    NoDevice: "The graphics card was found but did not start.",
  },
  insecure: "Browsers offer WebGPU only to pages that are opened over https or from localhost.",
  notice: (short: string) => `${short}: drawn with WebGL2, computed on the processor. `,
  how: "How to switch it on",
  title: "How to switch WebGPU on",
  steps: "Steps",
  closeNotice: "Close this notice",
  needs: "Cagework needs WebGPU or WebGL2",
  noWebGl: (why: string) => `${why} WebGL2 is missing as well. These steps switch WebGPU on:`,
  command:
    " If no browser works, use the command line: it can make cages, bind and deform, without a view. See the project's README.",
  others: "Other browsers",
  thatWork: "Browsers that work",
  ways: {
    chrome: {
      title: "Chrome or Chromium on Windows, macOS, ChromeOS or Android",
      steps: [
        "Update to version 121 or newer: menu, Help, About.",
        'Open chrome://settings/system and switch on "Use graphics acceleration when available".',
        "Close the browser and open this page again. If it still fails, chrome://gpu shows what is wrong with WebGPU.",
      ],
    },
    chromeLinux: {
      title: "Chrome or Chromium on Linux",
      steps: [
        "Update to version 144 or newer; on newer Intel graphics that is enough.",
        "Otherwise close it and start it from a terminal with: google-chrome --enable-unsafe-webgpu --enable-features=Vulkan",
        "Chromium as a snap may not reach Vulkan: use your distribution's package, or Google's .deb.",
      ],
    },
    edge: {
      title: "Edge",
      steps: [
        "Update to version 121 or newer: menu, Help and feedback, About.",
        'Open edge://settings/system and switch on "Use graphics acceleration when available".',
        "Close the browser and open this page again.",
      ],
    },
    firefox: {
      title: "Firefox on Windows or macOS",
      steps: [
        "Update to version 147 or newer: menu, Help, About Firefox.",
        "Open this page again. On a Mac with an Intel processor, use Chrome.",
      ],
    },
    firefoxLinux: {
      title: "Firefox on Linux",
      steps: [
        "Open about:config and accept the warning.",
        "Search for dom.webgpu.enabled and set it to true.",
        "Search for gfx.webgpu.ignore-blocklist and set it to true.",
        "Restart Firefox and open this page again.",
      ],
    },
    safari: {
      title: "Safari on a Mac, iPhone or iPad",
      steps: [
        "Update to macOS 26, iOS 26 or iPadOS 26, which bring Safari 26.",
        "Open this page again. On older systems, use Chrome on the Mac.",
      ],
    },
  },
};
