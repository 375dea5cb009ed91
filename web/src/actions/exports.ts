/** Exports files, pictures and links. */

import { extension } from "@cagework/core/names";
import type { ModelInfo, NamedFile } from "../contract";
import { EXPORT_TYPES, MAX_PICTURE } from "../defaults";
import { animationName, exportsAnimation, isCapture, rigOf, shapeFormatOf } from "../derived";
import { exportStem } from "../format";
import { sentence } from "../strings";
import { T } from "../words";
import { loadLattice } from "./clips";
import { attempt, type Context } from "./context";
import type { Project } from "./project";
import type { Pulling } from "./pull";

export type ExportKind = keyof typeof T.exports.items;

/** A file to download. */
interface ExportedFile {
  readonly name: string;
  readonly bytes: Uint8Array<ArrayBuffer>;
}

/** Pause between two downloads, ms. Browsers drop downloads that start at the same time. */
const DOWNLOAD_PAUSE_MS = 250;

/** Media type for formats that have no registered type. */
const OCTETS = "application/octet-stream";

export function createExports(ctx: Context, project: Project, pull: Pick<Pulling, "released">) {
  const { engine } = ctx;
  const rig = () => rigOf(ctx.store.get());
  const format = () => shapeFormatOf(ctx.store.get());

  /** Exports that write one file for each model. */
  const own = {
    glb: (id: number) =>
      exportsAnimation(ctx.store.get())
        ? engine().exportPoses(id, rig(), true, animationName(ctx.store.get()))
        : engine().exportGlb(id, rig(), ctx.store.get().clip.clip ?? 0),
    shape: (id: number) => engine().exportShape(id, format(), ctx.store.get().shapeMoment === "frame"),
    poses: (id: number) => engine().exportPoses(id, rig(), false, animationName(ctx.store.get())),
    weights: (id: number) => engine().exportWeights(id),
  };
  const isOwn = (kind: string): kind is keyof typeof own => kind in own;
  const shared = {
    cage: () => engine().exportCage(),
    controls: () => engine().exportControls(),
    project: () => project.write(),
  };

  const suffix = (kind: Exclude<ExportKind, "project" | "clips">): string =>
    kind === "shape" ? `-posed.${format()}` : SUFFIX[kind];

  /** Downloads one file for each model to export, or all of them in a zip archive. */
  const saveOwn = async (kind: keyof typeof own, model: ModelInfo) => {
    if (kind === "glb" || isCapture(model)) await loadLattice(ctx);
    const { members } = model;
    const { exportOnly } = ctx.store.get();
    const chosen = members.filter(({ id }) => id === exportOnly);
    const notices = new Set<string>();
    const files: ExportedFile[] = [];
    for (const member of chosen.length > 0 ? chosen : members) {
      // A single model may be shown under the name of its sample or project.
      const source = members.length === 1 ? model.name : member.name;
      const full = `${exportStem(source)}${suffix(kind)}`;
      // A VRM is a GLB with its own extension.
      const isVrm = /\.vrm$/i.test(source) && (kind === "glb" || kind === "poses");
      const name = other(isVrm ? full.replace(/glb$/, "vrm") : full, files);
      files.push({ name, bytes: own[kind](member.id) as Uint8Array<ArrayBuffer> });
      for (const notice of engine().rigNotices()) notices.add(notice);
    }
    // The panel shows what a format loses before the export.
    if (kind === "shape") for (const lost of engine().lostIn(format())) notices.delete(lost);
    const [first] = files;
    if (exportOnly === "zip" && first && files.length > 1) {
      const name = first.name.replace(/\.\w+$/, ".zip");
      files.splice(0, files.length, { name, bytes: ctx.session().zip(files) as Uint8Array<ArrayBuffer> });
    }
    await deliver(files, notices);
  };

  /** Downloads files, then shows the notices, and last the names of the files: only the latest messages stay visible. */
  const deliver = async (files: readonly ExportedFile[], notices: ReadonlySet<string>) => {
    for (const [k, { name, bytes }] of files.entries()) {
      if (k > 0) await new Promise((resolve) => setTimeout(resolve, DOWNLOAD_PAUSE_MS));
      download(blobOf(name, bytes), name);
    }
    const size = files.reduce((sum, { bytes }) => sum + bytes.length, 0);
    const names = files.map(({ name }) => name);
    for (const notice of notices) ctx.tell.say(sentence(notice));
    ctx.tell.say(T.exports.saved(names, size));
  };

  const picture = () => {
    const { width, height } = ctx.viewport();
    const { pictureScale, pictureAlone } = ctx.store.get();
    const fit = Math.min(pictureScale, MAX_PICTURE / Math.max(width, height, 1));
    return ctx.session().picture(Math.round(width * fit), Math.round(height * fit), pictureAlone);
  };

  const exports = {
    async save(kind: Exclude<ExportKind, "clips">) {
      const { model } = ctx.store.get();
      await attempt(ctx, T.failed.write, async () => {
        await pull.released();
        // Right after a bind, its weights may still be uploading to the GPU.
        await engine().ready();
        if (isOwn(kind)) return model ? saveOwn(kind, model) : undefined;
        const name = exportStem(model?.name ?? "model");
        const file = kind === "project" ? project.fileName() : `${name}${suffix(kind)}`;
        const blob =
          kind === "picture" ? await picture() : blobOf(file, shared[kind]() as Uint8Array<ArrayBuffer>);
        download(blob, file);
        ctx.tell.say(T.exports.saved([file], blob.size));
      });
    },
    /** Fits the clips of files without a mesh to the posed skeleton, and downloads a GLB for each file. */
    async clips(chosen: readonly NamedFile[]) {
      await attempt(ctx, T.failed.write, async () => {
        await pull.released();
        await engine().ready();
        const notices = new Set<string>();
        const files: ExportedFile[] = [];
        for (const { name, file } of chosen) {
          const bytes = new Uint8Array(await file.arrayBuffer());
          files.push({
            name: other(`${exportStem(name)}-posed.glb`, files),
            bytes: engine().exportClips(name, bytes, rig()) as Uint8Array<ArrayBuffer>,
          });
          for (const notice of engine().rigNotices()) notices.add(notice);
        }
        await deliver(files, notices);
      });
    },
    /** Copies a link to the open work, or offers to save a project if a link cannot contain it. */
    async share() {
      const link = await project.link();
      if (!link) {
        const { sample } = ctx.store.get();
        ctx.tell.say(sample ? T.exports.noLinkChanged : T.exports.noLink, {
          label: T.exports.saveProject,
          run: () => void exports.save("project"),
        });
        return;
      }
      await copyLink(ctx, link, T.exports.copied);
    },
  };
  return exports;
}

export type Exports = ReturnType<typeof createExports>;

/** Copies a link to the clipboard and shows `done`. */
export async function copyLink(ctx: Context, link: string, done: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(link);
    ctx.tell.say(done);
  } catch {
    // Without clipboard access, show the link in the address bar to be copied by hand.
    window.history.replaceState(null, "", link);
    ctx.tell.say(T.exports.inAddress);
  }
}

const SUFFIX: Record<Exclude<ExportKind, "project" | "shape" | "clips">, string> = {
  glb: "-posed.glb",
  poses: "-poses.glb",
  cage: "-cage.obj",
  controls: "-controls.obj",
  weights: "-weights.npz",
  picture: ".png",
};

/** Creates a blob with the media type of the file's format. */
function blobOf(name: string, bytes: Uint8Array<ArrayBuffer>): Blob {
  const type = EXPORT_TYPES[extension(name)] ?? (name.endsWith(".zip") ? "application/zip" : OCTETS);
  return new Blob([bytes], { type });
}

/** Appends a number to the name of another file: models from different folders may have the same name. */
function other(name: string, files: readonly ExportedFile[]): string {
  const isTaken = (name: string) => files.some((file) => file.name === name);
  const again = (n: number) => name.replace(/(?=\.\w+$)/, `-${n}`);
  let n = 2;
  while (isTaken(again(n))) n += 1;
  return isTaken(name) ? again(n) : name;
}

/** Downloads a blob as a file called `name`. */
function download(blob: Blob, name: string): void {
  const url = URL.createObjectURL(blob);
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  // The browser keeps the data once the download has started.
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** Converts the files of a file input to files with names and paths. */
export function named(files: Iterable<File>): NamedFile[] {
  return Array.from(files, (file) => ({ name: file.name, path: file.webkitRelativePath || file.name, file }));
}
