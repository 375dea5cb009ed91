/** Browsers without WebGPU: what is missing, and the exact steps for the browser at hand. */

import type { Lack } from "../contract";
import { PRODUCT } from "../strings";
import { button } from "./controls";
import { h } from "./dom";
import { icon, mark } from "./icons";

export type Browser = "chrome" | "edge" | "firefox" | "safari" | "other";
export type System = "windows" | "mac" | "linux" | "android" | "ios" | "other";

/** Which browser and system a user agent names; only to choose which steps are open first. */
export function recognise(agent: string): { browser: Browser; system: System } {
  const system: System = /android/i.test(agent)
    ? "android"
    : /iphone|ipad/i.test(agent)
      ? "ios"
      : /windows/i.test(agent)
        ? "windows"
        : /mac os/i.test(agent)
          ? "mac"
          : /linux|x11|cros/i.test(agent)
            ? "linux"
            : "other";
  const browser: Browser = /edg\//i.test(agent)
    ? "edge"
    : /firefox|fxios/i.test(agent)
      ? "firefox"
      : /chrome|chromium|crios/i.test(agent)
        ? "chrome"
        : /safari/i.test(agent)
          ? "safari"
          : "other";
  return { browser, system };
}

interface Way {
  browser: Browser;
  system?: System;
  title: string;
  steps: readonly string[];
}

const WAYS: readonly Way[] = [
  {
    browser: "chrome",
    title: "Chrome or Chromium on Windows, macOS, ChromeOS or Android",
    steps: [
      "Update to version 121 or newer: menu, Help, About.",
      'Open chrome://settings/system and switch on "Use graphics acceleration when available".',
      "Close the browser and open this page again. If it still fails, chrome://gpu says what is wrong with WebGPU.",
    ],
  },
  {
    browser: "chrome",
    system: "linux",
    title: "Chrome or Chromium on Linux",
    steps: [
      "Update to version 144 or newer; on newer Intel graphics that is enough.",
      "Otherwise close it and start it from a terminal with: google-chrome --enable-unsafe-webgpu --enable-features=Vulkan",
      "Chromium as a snap may not reach Vulkan: use your distribution's package, or Google's .deb.",
    ],
  },
  {
    browser: "edge",
    title: "Edge",
    steps: [
      "Update to version 121 or newer: menu, Help and feedback, About.",
      'Open edge://settings/system and switch on "Use graphics acceleration when available".',
      "Close the browser and open this page again.",
    ],
  },
  {
    browser: "firefox",
    title: "Firefox on Windows or macOS",
    steps: ["Update to version 147 or newer: menu, Help, About Firefox.", "Open this page again."],
  },
  {
    browser: "firefox",
    system: "linux",
    title: "Firefox on Linux",
    steps: [
      "Open about:config and accept the warning.",
      "Search for dom.webgpu.enabled and set it to true.",
      "Search for gfx.webgpu.ignore-blocklist and set it to true.",
      "Restart Firefox and open this page again.",
    ],
  },
  {
    browser: "safari",
    title: "Safari on a Mac, iPhone or iPad",
    steps: [
      "Update to macOS 26, iOS 26 or iPadOS 26, which bring Safari 26.",
      "Open this page again. On older systems, use Chrome on the Mac.",
    ],
  },
];

const REASONS: Record<Lack, string> = {
  NoWebGPU: "This browser does not offer WebGPU, or it is switched off.",
  NoAdapter: "This browser has WebGPU, but found no graphics card that it may use.",
  NoDevice: "The graphics card was found, but did not start.",
};

/** Whether the address is one at which browsers offer WebGPU at all. */
const INSECURE = "This page was not opened over https or from localhost; browsers offer WebGPU only there.";

/** Why there is no WebGPU, as a sentence. */
export function sayLack(lack: Lack, secure: boolean): string {
  return lack === "NoWebGPU" && !secure ? INSECURE : REASONS[lack];
}

/** The steps for the browser at hand, those for others folded. */
export function ways(agent: string): HTMLElement[] {
  const { browser, system } = recognise(agent);
  const fits = (way: Way) =>
    way.browser === browser && (way.system ?? "") === (system === "linux" ? "linux" : "");
  const mine = WAYS.find(fits) ?? WAYS.find((way) => way.browser === browser);
  const others = WAYS.filter((way) => way !== mine).map((way) =>
    h(
      "details",
      { class: "fold" },
      h("summary", { text: way.title }),
      h("div", { class: "stack" }, steps(way)),
    ),
  );
  const rest = h("h2", { class: "way-title others", text: mine ? "Other browsers" : "Browsers that work" });
  if (!mine) return [rest, ...others];
  return [
    h("section", { class: "card stack" }, h("h2", { class: "way-title", text: mine.title }), steps(mine)),
    rest,
    ...others,
  ];
}

/** The whole page where there is no WebGL2 to draw with either. */
export function createUnsupported(lack: Lack, agent: string, secure: boolean): HTMLElement {
  return h(
    "main",
    { class: "unsupported" },
    h(
      "div",
      { class: "unsupported-card" },
      h("div", { class: "row" }, mark(), h("strong", { text: PRODUCT })),
      h("h1", { text: "Cagework needs WebGPU" }),
      h("p", {
        text: `${sayLack(lack, secure)} WebGL2, which would do instead, is missing as well. It takes a minute to put right:`,
      }),
      ...ways(agent),
      h(
        "p",
        { class: "hint" },
        icon("info"),
        " Without a browser that works: the cagework command does the same on the processor, see the project's README.",
      ),
      button("Try again", () => location.reload(), { kind: "primary", icon: "reset" }),
    ),
  );
}

function steps(way: Way): HTMLElement {
  return h("ol", { class: "numbered" }, ...way.steps.map((step) => h("li", { text: step })));
}
