/** Sentences of step Model, and about opening files. */

import { count, endings, inUnit, percent, plural } from "../../format";

export const model = {
  title: "Choose a model",
  sentence:
    "The model follows its cage, a coarse mesh around it. Pull it anywhere, or drop your own file here.",
  sentenceTouch:
    "The model follows its cage, a coarse mesh around it. Pull it anywhere, or open your own file.",
  drop: "Drop models here",
  dropTouch: "Your own model",
  get kinds() {
    return `${endings("disjunction")}, together with the files they refer to, or a whole folder. Several models share one cage.`;
  },
  openFolder: "Open a folder",
  kept: (n: number) => `Work kept in this browser (${n})`,
  samples: "Samples",
  up: "Up axis",
  upY: "The standard of glTF",
  upZ: "For models that otherwise lie on their back",
  lies: "The model seems to lie on its back.",
  stand: "Stand it up",
  licences: "Licences",
  isOpen: "The model that is open",
  vertices: "Vertices",
  triangles: "Triangles",
  size: "Size",
  materials: "Materials",
  textures: "Textures",
  also: "Also in the file",
  joints: (n: number) => plural(n, "joint"),
  clips: (n: number) => plural(n, "clip"),
  morphTargets: (n: number) => plural(n, "morph target"),
};

/** The built-in models, by identifier: names of model and poses, and what to try. */
export const samples: Readonly<Record<string, Sample>> = {
  rat: {
    name: "Rat",
    poses: ["Tail up, head turned", "Looking round"],
    task: "Drag the rat's nose.",
    tip: "Its head turns, its feet stay in place.",
  },
  humanoid: {
    name: "Legs close together",
    poses: ["A step", "Knee up"],
    task: "Drag the knee up.",
    tip: "Lift a knee: the other leg, a hand's breadth away, stays in place.",
  },
  clamp: {
    name: "Clamp",
    poses: ["Lower jaw open", "Lower jaw pulled down"],
    task: "Drag the lower jaw down.",
    tip: "Pull the lower jaw open, then compare with mean value and Green coordinates.",
  },
  strider: {
    name: "Strider",
    poses: ["Front legs raised", "One leg up"],
    task: "Drag a front foot.",
    tip: "Legs as thin as a grid cell. Pull one foot: the other legs stay in place.",
  },
};

interface Sample {
  readonly name: string;
  readonly poses: readonly string[];
  /** What to do first. */
  readonly task: string;
  readonly tip: string;
}

export const opening = {
  starting: "Starting",
  file: (name: string) => `Opening ${name}`,
  fileOf: (name: string, k: number, n: number) =>
    n > 1 ? `Opening ${name} (${count(k + 1)} of ${count(n)})` : `Opening ${name}`,
  turning: "Turning the model",
  repairing: "Repairing the cage",
  stages: {
    bytes: "Reading the file",
    decompress: "Decompressing",
    geometry: "Finding vertices and faces",
    textures: "Decoding textures",
    check: "Checking the cage",
  },
  far: (stage: string, fraction: number) => (fraction > 0 ? `${stage}, ${percent(fraction)}` : stage),
  anyway: "Open anyway",
  longBind: (name: string, seconds: number) =>
    `The settings in ${name} ask for a solve of about ${inUnit(Math.round(seconds / 60) || 1, "minute")}: the default settings are used instead. Step Bind can change them.`,
  freezes: (vertices: number, ms: number) =>
    `Large model (${plural(vertices, "vertex", "vertices")}): the page will freeze for about ${plural(Math.round(ms / 1000), "second")}.`,
  nothing: "Nothing to open",
  empty: "This file is empty",
  noContent: (name: string) => `${name} has no content. Export it again, or choose another file.`,
  dropped: "Nothing was dropped.",
  get kinds() {
    return `Cagework opens ${endings("conjunction")} files.`;
  },
  companions: "These files belong to a .gltf or .obj file. Open that file together with them.",
  project: (name: string) => `Opens the project ${name}.`,
  plan: (models: string, companions: number, several: boolean, cage: string | undefined) => {
    const what =
      companions > 0 ? `${models} with ${several ? "their" : "its"} ${plural(companions, "file")}` : models;
    return cage
      ? `Opens ${what} and uses ${cage} as the cage.`
      : `Opens ${what} and makes a cage for ${several ? "all of them" : "it"}.`;
  },
  dropTo: {
    page: "Drop to open",
    cage: "Drop to use it as the cage",
    list: "Drop to add it to this cage",
  },
  becomes: {
    cage: "A closed mesh around the model.",
    list: "Clothes, hair, gear: all models in this cage follow it together.",
  },
  asControls: (name: string) => `Puts the controls of ${name} inside the cage.`,
  together: "Models dropped together share one cage. Their textures and a cage file are read too.",
  onCageStep: "It replaces the model. To use it as the cage, drop it on the Cage panel.",
  replaces: "It replaces the open model. To add it instead, drop it on the list of models.",
  getsCage: "It gets a cage and can be posed at once.",
};
