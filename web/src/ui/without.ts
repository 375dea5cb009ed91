/** Where WebGPU is missing and WebGL2 stands in: a notice, once, and how to switch WebGPU on. */

import type { Lack } from "../contract";
import { hasSeen, markSeen } from "../store";
import { WITHOUT_WEBGPU } from "../strings";
import { iconButton } from "./controls";
import { h } from "./dom";
import { icon } from "./icons";
import { sayLack, ways } from "./unsupported";

const NOTICE = "without-webgpu";

const SHORT: Record<Lack, string> = {
  NoWebGPU: "No WebGPU here",
  NoAdapter: "WebGPU found no graphics card",
  NoDevice: "WebGPU did not start",
};

export interface Without {
  readonly element: HTMLDialogElement;
  /** Opens the steps. */
  show(lack: Lack): void;
  /** What is different, in a line; nothing once that has been read and closed in this browser. */
  notice(lack: Lack): HTMLElement | null;
}

export function createWithout(agent: string, secure: boolean): Without {
  const why = h("p");
  const element = h("dialog", { class: "sheet ways", attrs: { "aria-labelledby": "ways-title" } });
  element.append(
    h(
      "div",
      { class: "row sheet-head" },
      h("h2", { class: "grow", id: "ways-title", text: "How to switch WebGPU on" }),
      iconButton("close", "Close", () => element.close()),
    ),
    h(
      "div",
      { class: "sheet-body", attrs: { tabindex: "0", role: "group", "aria-label": "Steps" } },
      why,
      ...ways(agent),
    ),
  );
  element.addEventListener("click", (event) => {
    if (event.target === element) element.close();
  });
  const show = (lack: Lack) => {
    why.textContent = `${sayLack(lack, secure)} ${WITHOUT_WEBGPU}`;
    element.showModal();
  };
  return {
    element,
    show,
    notice(lack) {
      if (hasSeen(NOTICE)) return null;
      const line = h("div", { class: "notice", attrs: { role: "status" } });
      const close = () => {
        line.remove();
        markSeen(NOTICE);
      };
      line.append(
        icon("info"),
        h(
          "p",
          {},
          `${SHORT[lack]}: drawn with WebGL2, computed on the processor. `,
          h("button", {
            class: "as-link",
            attrs: { type: "button" },
            on: { click: () => show(lack) },
            text: "How to switch it on",
          }),
        ),
        iconButton("close", "Close this notice", close, { kind: "small" }),
      );
      return line;
    },
  };
}
