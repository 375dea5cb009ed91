/** The browser's file dialog. */

import { named } from "../actions/exports";
import type { NamedFile } from "../contract";
import { h } from "../ui/dom";

/** Asks for files of some kinds, or for a folder. */
export function choose(accept: string, folder: boolean, then: (files: NamedFile[]) => void): void {
  const input = h("input", { attrs: { type: "file", multiple: "", accept } });
  if (folder) input.webkitdirectory = true;
  input.addEventListener("change", () => {
    const list = named(input.files ?? []);
    if (list.length > 0) then(list);
  });
  input.click();
}
