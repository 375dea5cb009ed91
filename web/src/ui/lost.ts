/** What the page shows when the graphics device is lost, and the way back. */

import type { Session } from "../contract";
import { sentence } from "../strings";
import { button } from "./controls";
import { fill, h } from "./dom";
import { icon } from "./icons";

/** Twice within this time, ms, and the page asks before it tries again: the device may be broken for good. */
const AGAIN_MS = 10_000;

export function attachLost(options: {
  stage: HTMLElement;
  session: Session;
  freshCanvas: () => HTMLCanvasElement;
  recovered: () => void;
}): void {
  const { session, stage } = options;
  const box = h("div", { class: "lost", hidden: true, attrs: { role: "alert" } });
  stage.append(box);
  let last = Number.NEGATIVE_INFINITY;

  const show = (title: string, text: string, retry: boolean) => {
    fill(
      box,
      h(
        "div",
        { class: "lost-card" },
        icon("warning"),
        h("strong", { text: title }),
        h("p", { text }),
        retry
          ? h(
              "div",
              { class: "row" },
              button("Try again", () => void recover(), { kind: "primary" }),
              button("Reload the page", () => location.reload()),
            )
          : null,
      ),
    );
    box.hidden = false;
  };

  const recover = async () => {
    show("The graphics device was lost", "Bringing everything back…", false);
    try {
      await session.recover(options.freshCanvas());
      box.hidden = true;
      options.recovered();
    } catch (error) {
      const reason = sentence(error instanceof Error ? error.message : String(error));
      show("The graphics device did not come back", `${reason} Your work is kept in this browser.`, true);
    }
  };

  session.onLost((reason) => {
    const now = performance.now();
    const again = now - last < AGAIN_MS;
    last = now;
    if (again) {
      show(
        "The graphics device was lost again",
        `${sentence(reason)} Close other programs that use it, then try again.`,
        true,
      );
    } else {
      void recover();
    }
  });
}
