/** Keyboard handler: finds the command of a key press in the shortcut table and runs it. */

import type { App } from "../app";
import { type Command, commandOf, SHORTCUTS } from "./shortcuts";

const FILE_COMMANDS: ReadonlySet<Command> = new Set(
  SHORTCUTS.filter(({ group }) => group === "file").map(({ command }) => command),
);

/** Whether the element with the focus handles typed keys itself. */
function isTyping(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement) return !["checkbox", "radio", "range"].includes(target.type);
  return (
    target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement || target.isContentEditable
  );
}

/** Whether the control with the focus uses a key: arrows in sliders and radio buttons, Space and Enter on buttons. */
function isControlKey(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest("dialog")) return true;
  const input = target instanceof HTMLInputElement;
  if (input && /^(Arrow|Home|End|Page| )/.test(key)) return true;
  const pressable = target.closest("button, summary, a, label") !== null;
  return pressable && (key === " " || key === "Enter");
}

export function attachKeyboard(viewport: HTMLElement, app: App): void {
  document.addEventListener("keydown", (event) => {
    const mod = event.ctrlKey || event.metaKey;
    // While the user types, only the commands of files apply: the other keys belong to the field.
    const typing = isTyping(event.target);
    if (event.defaultPrevented || event.isComposing || (typing && !mod)) return;
    const gesture = app.edit.active();
    // During a gesture, Enter ends the gesture even if a button has the focus.
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
    if (!command || (typing && !FILE_COMMANDS.has(command))) return;
    // Tab switches between posing and reshaping only if the view got the focus by a click. If the view got it by
    // keyboard, Tab moves the focus.
    if (command === "restMode") {
      const clicked = document.activeElement === viewport && !viewport.matches(":focus-visible");
      if (!clicked || event.shiftKey) return;
    }
    if (command === "original") {
      if (!event.repeat) app.view.original(true);
      event.preventDefault();
      return;
    }
    const always = command === "sheet" || command === "open";
    if (!always && (busy !== null || model === null)) return;
    event.preventDefault();
    app.run(command);
  });
  document.addEventListener("keyup", (event) => {
    if (event.key === " ") app.view.original(false);
  });
  window.addEventListener("blur", () => app.view.original(false));
}
