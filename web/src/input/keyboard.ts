/** Keys: looks them up in the table of shortcuts and runs what they stand for. */

import type { App } from "../app";
import { type Command, commandOf } from "./shortcuts";

/** Elements that want their keys themselves. */
function isTyping(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement) return !["checkbox", "radio", "range"].includes(target.type);
  return (
    target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement || target.isContentEditable
  );
}

/** Keys that controls use: arrows on sliders and radio buttons, space and enter on buttons. */
function isControlKey(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest("dialog")) return true;
  const input = target instanceof HTMLInputElement;
  if (input && /^(Arrow|Home|End|Page| )/.test(key)) return true;
  const pressable = target.closest("button, summary, a, label") !== null;
  return pressable && (key === " " || key === "Enter");
}

export interface KeyboardOptions {
  viewport: HTMLElement;
  app: App;
  run: (command: Command) => void;
  /** Space is held or let go. */
  original: (on: boolean) => void;
}

export function attachKeyboard({ viewport, app, run, original }: KeyboardOptions): void {
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.isComposing || isTyping(event.target)) return;
    const gesture = app.edit.active();
    // While something moves, Enter keeps it, whichever button was pressed last.
    const mod = event.ctrlKey || event.metaKey;
    if (!gesture && !mod && isControlKey(event.target, event.key)) return;
    if (mod && event.target instanceof HTMLElement && event.target.closest("dialog")) return;
    const { editingRest, busy, cancelBusy, model, tour } = app.store.get();
    if (event.key === "Escape" && cancelBusy && !document.querySelector("dialog[open]")) {
      cancelBusy();
      return;
    }
    if (gesture && !mod && app.edit.type(event.key)) {
      event.preventDefault();
      return;
    }
    if (event.key === "Enter" && !mod && app.store.get().placing) {
      event.preventDefault();
      app.controls.finish();
      return;
    }
    const command = commandOf(event, { gesture, rest: editingRest, tour: tour !== null });
    if (!command) return;
    // Tab moves between modes only after a click into the view; who arrived by Tab leaves by it.
    if (command === "restMode") {
      const clicked = document.activeElement === viewport && !viewport.matches(":focus-visible");
      if (!clicked || event.shiftKey) return;
    }
    if (command === "original") {
      if (!event.repeat) original(true);
      event.preventDefault();
      return;
    }
    const always = command === "sheet" || command === "open";
    if (!always && (busy !== null || model === null)) return;
    event.preventDefault();
    run(command);
  });
  document.addEventListener("keyup", (event) => {
    if (event.key === " ") original(false);
  });
  window.addEventListener("blur", () => original(false));
}
