/** What will happen to files that hover over the window. */

import type { App } from "../app";
import { hoverSentence } from "../drop";
import { T } from "../words";
import { Icon } from "./icons";

export function Hover({ app }: { app: App }) {
  const { hovering, model, step } = app.store.get();
  if (!hovering) return null;
  const { files, asCage } = hovering;
  return (
    <div class="drop-overlay" data-panel={asCage ? "" : undefined} aria-hidden="true">
      <div class="drop-card">
        <Icon name="upload" />
        <strong>{asCage ? T.opening.dropAsCage : T.opening.dropToOpen}</strong>
        <p>{asCage ? T.opening.asCage : hoverSentence(files, model !== null, step === "cage")}</p>
      </div>
    </div>
  );
}
