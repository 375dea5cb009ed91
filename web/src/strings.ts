/** Sentences that more than one place says, or that belong to data. */

import type { ErrorName, Stage } from "./contract";
import { percent } from "./format";

export const PRODUCT = "Cagework";

/** What is different without WebGPU. */
export const WITHOUT_WEBGPU =
  "The page draws with WebGL2 and computes on the processor instead: everything works, binding takes longer.";

export const PRIVACY = "Your files never leave this computer: everything is computed in this page.";

/** What to try with each sample, and an icon until its picture is there. Unknown samples have none. */
export const SAMPLES: Record<string, { sentence: string; icon: "spark" | "pose" | "bind" | "model" }> = {
  rat: { sentence: "The paper's rat. Drag its tail, or turn its head: the feet stay.", icon: "spark" },
  humanoid: { sentence: "Lift one knee: the other leg, a hand's breadth away, stays.", icon: "pose" },
  clamp: { sentence: "Open the jaw, then compare with mean value coordinates.", icon: "bind" },
  strider: { sentence: "Legs as thin as a grid cell. Bend one, the others keep still.", icon: "model" },
};

export const STAGES: Readonly<Record<Stage, string>> = {
  simplify: "Making a cage",
  voxelize: "Sorting grid cells",
  solve: "Solving for the coordinates",
  sample: "Reading weights",
};

const READING = {
  bytes: "Reading the file",
  decompress: "Decompressing it",
  geometry: "Finding vertices and faces",
  textures: "Decoding textures",
  check: "Checking the cage",
} as const;

/** What a worker does with a file. */
export function sayReading(stage: keyof typeof READING, fraction: number): string {
  return fraction > 0 ? `${READING[stage]}, ${percent(fraction)}` : READING[stage];
}

export const GESTURES = { grab: "Move", rotate: "Rotate", scale: "Scale" } as const;

export const REST_EDITS = {
  split_edge: "Split edge",
  collapse_edge: "Collapse edge",
  extrude_face: "Extrude face",
  delete_vertex: "Delete vertices",
  delete_face: "Delete faces",
} as const;

export const AXES = ["X", "Y", "Z"] as const;

/** What the status line suggests when nothing else is going on. */
export function hintFor(options: {
  touch: boolean;
  hasCage: boolean;
  bound: boolean;
  binding: boolean;
  rest: boolean;
}): string {
  if (!options.hasCage) return "A model needs a cage around it before it can be posed.";
  if (options.rest) {
    return options.touch
      ? "Drag a handle to reshape the cage; the model stays still."
      : "Drag a handle to reshape the cage; the model stays still. Tab goes back to posing.";
  }
  if (!options.bound) {
    return options.binding
      ? "The model is being bound: posing waits until it is."
      : "Bind the model, then it follows its cage.";
  }
  return options.touch
    ? "Drag a handle to pose. One finger turns, two move and zoom."
    : "Drag a handle to pose · drag beside it to turn · right-drag to move · scroll to zoom · ? for keys";
}

/** A sentence from Rust starts lower case and may lack its full stop. */
export function sentence(text: string): string {
  const trimmed = text.trim();
  if (trimmed === "") return "Something went wrong.";
  // Names of files keep their letters.
  const isName = /^\S*\.\w/.test(trimmed);
  const first = isName ? trimmed : trimmed.charAt(0).toUpperCase() + trimmed.slice(1);
  return /[.!?:]$/.test(first) ? first : `${first}.`;
}

export interface Explained {
  /** Headline: what did not work. */
  title: string;
  message: string;
  /** What the page can do about it. */
  fix?: "coarser" | "cpu" | "file" | "regenerate" | "reload";
}

const FIXES: Readonly<Partial<Record<ErrorName | "Empty", NonNullable<Explained["fix"]>>>> = {
  Memory: "coarser",
  Gpu: "cpu",
  NoAdapter: "cpu",
  Format: "file",
  Empty: "file",
  Missing: "file",
  Outside: "regenerate",
  NoneInside: "regenerate",
  DeviceLost: "reload",
};

export const FIX_LABELS: Record<NonNullable<Explained["fix"]>, string> = {
  coarser: "Use a coarser grid",
  cpu: "Use the processor",
  file: "Choose another file",
  regenerate: "Make a new cage",
  reload: "Reload the page",
};

/** An error as the page says it. */
export function explain(error: unknown, title: string): Explained {
  const name = error instanceof Error ? error.name : "";
  const message = sentence(error instanceof Error ? error.message : String(error));
  const fix = FIXES[name as ErrorName];
  return fix ? { title, message, fix } : { title, message };
}

/** Whether an error only says that the user cancelled. */
export function isCancelled(error: unknown): boolean {
  return error instanceof Error && error.name === "Cancelled";
}
