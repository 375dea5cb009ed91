/** Drag and drop of files and folders on the window. */

import type { App } from "../app";
import type { NamedFile } from "../contract";
import type { DropPlace } from "../state";

/** Maximum number of files that are read from dropped folders, in case a whole disk is dropped. */
const MAX_FILES = 2000;

export function attachDrop(panel: HTMLElement, app: App): void {
  const { store } = app;
  const placeOf = ({ target }: DragEvent): DropPlace => {
    const { step, model } = store.get();
    if (!model || !(target instanceof Element) || !panel.contains(target)) return "page";
    if (target.closest("[data-adds]")) return "list";
    return step === "cage" ? "cage" : "page";
  };
  const hide = () => store.set({ hovering: null });

  window.addEventListener("dragover", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = "copy";
    const files = [...event.dataTransfer.items].filter((item) => item.kind === "file").length;
    store.set({ hovering: { files, to: placeOf(event) } });
  });
  window.addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) hide();
  });
  window.addEventListener("drop", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    hide();
    const to = placeOf(event);
    void collect(event.dataTransfer).then((files) => {
      if (to === "cage") return app.cage.load(files);
      return to === "list" ? app.models.add(files) : app.files.openFiles(files);
    });
  });
}

/**
 * Collects all dropped files, including those in folders. Takes the entries of the list before the first await, because
 * the browser clears the list after the event.
 */
async function collect(data: DataTransfer): Promise<NamedFile[]> {
  const entries = [...data.items]
    .filter((item) => item.kind === "file")
    .map((item) => ({ entry: item.webkitGetAsEntry(), file: item.getAsFile() }));
  const files: NamedFile[] = [];
  for (const { entry, file } of entries) {
    if (entry) await walk(entry, "", files);
    else if (file) files.push({ name: file.name, path: file.name, file });
  }
  return files;
}

async function walk(entry: FileSystemEntry, folder: string, into: NamedFile[]): Promise<void> {
  if (into.length >= MAX_FILES || entry.name.startsWith(".")) return;
  const path = folder === "" ? entry.name : `${folder}/${entry.name}`;
  if (isFile(entry)) {
    const file = await new Promise<File>((resolve, reject) => entry.file(resolve, reject));
    into.push({ name: entry.name, path, file });
  } else if (isFolder(entry)) {
    const reader = entry.createReader();
    for (;;) {
      // readEntries returns the list in batches. An empty batch ends it.
      const portion = await new Promise<FileSystemEntry[]>((resolve, reject) =>
        reader.readEntries(resolve, reject),
      );
      if (portion.length === 0) return;
      for (const child of portion) await walk(child, path, into);
    }
  }
}

function isFile(entry: FileSystemEntry): entry is FileSystemFileEntry {
  return entry.isFile;
}

function isFolder(entry: FileSystemEntry): entry is FileSystemDirectoryEntry {
  return entry.isDirectory;
}
