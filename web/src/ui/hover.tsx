/** Overlay that says, while files are dragged over the window, what dropping them does. */

import type { App } from "../app";
import { hoverSentence } from "../drop";
import { T } from "../words";
import { Icon } from "./icons";

export function Hover({ app }: { app: App }) {
  const { hovering, model, step } = app.store.get();
  if (!hovering) return null;
  const { files, to } = hovering;
  return (
    <div class="drop-overlay" data-panel={to === "page" ? undefined : ""} aria-hidden="true">
      <div class="drop-card">
        <Icon name="upload" />
        <strong>{T.opening.dropTo[to]}</strong>
        <p>{to === "page" ? hoverSentence(files, model !== null, step === "cage") : T.opening.becomes[to]}</p>
      </div>
    </div>
  );
}
