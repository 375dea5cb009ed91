/** Files out of the page. */

import type { ModelFormat, NamedFile } from "../contract";
import { stem } from "../format";
import { fittingPoses, rigOf } from "../state";
import { sentence } from "../strings";
import { T } from "../words";
import { loadLattice } from "./clips";
import { attempt, type Context } from "./context";
import type { Project } from "./project";

export type ExportKind = "glb" | "shape" | "poses" | "cage" | "controls" | "weights" | "picture" | "project";

/** Formats of a shape without anything else. */
export const SHAPE_FORMATS = ["obj", "ply", "stl"] as const satisfies readonly ModelFormat[];
export type ShapeFormatName = (typeof SHAPE_FORMATS)[number];

export interface Exports {
  save(kind: ExportKind): Promise<void>;
  /** A link to what is open, on the clipboard if it may be. */
  share(): Promise<void>;
  /** Pixels of the picture for each of the view, and whether it shows the model alone. */
  pictureOf(scale: number, alone: boolean): void;
  /** The format of the next shape. */
  shapeIn(format: ShapeFormatName): void;
}

/** Largest side of a picture, pixels. */
const LONGEST_SIDE = 8192;

export function createExports(ctx: Context, project: Project): Exports {
  let scale = 2;
  let alone = false;
  let format: ShapeFormatName = SHAPE_FORMATS[0];

  const bytesOf = (kind: Exclude<ExportKind, "picture">): Uint8Array => {
    const { engine } = ctx.session();
    switch (kind) {
      case "glb":
        return engine.exportGlb(rigOf(ctx.store.get()), ctx.store.get().clip.clip ?? 0);
      case "shape":
        return engine.exportShape(format);
      case "poses": {
        const poses = fittingPoses(ctx.store.get());
        return engine.exportPoses(
          poses.map((pose) => pose.name),
          poses.map((pose) => pose.positions),
          rigOf(ctx.store.get()),
        );
      }
      case "cage":
        return engine.exportCage();
      case "controls":
        return engine.exportControls();
      case "weights":
        return engine.exportWeights();
      case "project":
        return project.write();
      default:
        return kind satisfies never;
    }
  };

  const suffix = (kind: Exclude<ExportKind, "project">): string =>
    kind === "shape" ? `-posed.${format}` : SUFFIX[kind];

  const picture = () => {
    const { width, height } = ctx.viewport();
    const fit = Math.min(scale, LONGEST_SIDE / Math.max(width, height, 1));
    return ctx.session().picture(Math.round(width * fit), Math.round(height * fit), alone);
  };

  const exports: Exports = {
    async save(kind) {
      const name = stem(ctx.store.get().model?.name ?? "model");
      await attempt(ctx, T.failed.write, async () => {
        if (kind === "glb") await loadLattice(ctx);
        // The moment after a bind its weights are still on the way to the GPU.
        await ctx.session().engine.ready();
        const blob = kind === "picture" ? await picture() : new Blob([new Uint8Array(bytesOf(kind))]);
        const full = kind === "project" ? project.fileName() : `${name}${suffix(kind)}`;
        // A VRM stays one.
        const isVrm =
          /\.vrm$/i.test(ctx.store.get().model?.name ?? "") && (kind === "glb" || kind === "poses");
        const file = isVrm ? full.replace(/glb$/, "vrm") : full;
        download(blob, file);
        ctx.tell.say(T.exports.saved(file, blob.size));
        if (kind === "glb")
          for (const notice of ctx.session().engine.rigNotices()) ctx.tell.say(sentence(notice));
      });
    },
    async share() {
      const link = await project.link();
      if (!link) {
        ctx.tell.say(T.exports.noLink, {
          label: T.exports.saveProject,
          run: () => void exports.save("project"),
        });
        return;
      }
      await copyLink(ctx, link, T.exports.copied);
    },
    pictureOf(size, isAlone) {
      [scale, alone] = [size, isAlone];
    },
    shapeIn(chosen) {
      format = chosen;
    },
  };
  return exports;
}

/** Puts a link in the clipboard. */
export async function copyLink(ctx: Context, link: string, done: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(link);
    ctx.tell.say(done);
  } catch {
    // No access to the clipboard: the address bar can be copied by hand.
    window.history.replaceState(null, "", link);
    ctx.tell.say(T.exports.inAddress);
  }
}

const SUFFIX: Record<Exclude<ExportKind, "project" | "shape">, string> = {
  glb: "-posed.glb",
  poses: "-poses.glb",
  cage: "-cage.obj",
  controls: "-controls.obj",
  weights: "-weights.npz",
  picture: ".png",
};

/** Hands a file to the browser's downloads. */
function download(blob: Blob, name: string): void {
  const url = URL.createObjectURL(blob);
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  // The download has its own hold on the data once the click has been handled.
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** Files of a file button. */
export function named(files: Iterable<File>): NamedFile[] {
  return Array.from(files, (file) => ({ name: file.name, path: file.webkitRelativePath || file.name, file }));
}
