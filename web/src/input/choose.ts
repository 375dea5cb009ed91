/** The browser's file dialog. */

import { named } from "../actions/exports";
import type { NamedFile } from "../contract";

/** The input of the last dialog. Without this reference, garbage collection may drop it and its "change" event. */
let lastInput: HTMLInputElement | undefined;

/** Opens the file dialog for the given file types, or for a folder. Calls `then` with the chosen files. */
export function choose(accept: string, folder: boolean, then: (files: NamedFile[]) => void): void {
  const input = document.createElement("input");
  lastInput = input;
  input.type = "file";
  input.multiple = true;
  input.accept = accept;
  if (folder) input.webkitdirectory = true;
  input.addEventListener("change", () => {
    const list = named(input.files ?? []);
    if (list.length > 0) then(list);
    if (lastInput === input) lastInput = undefined;
  });
  input.click();
}
