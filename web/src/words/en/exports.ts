/** Step Export. */

import { bytes, list, plural } from "../../format";

export const exports = {
  title: "Export",
  sentence: "Files for Blender, Unity, Unreal, three.js, Python, and for this page.",
  items: {
    glb: ["Posed model", "GLB as you see it. Materials, textures and parts are those of your file."],
    shape: ["Shape alone", "OBJ, PLY, STL or OFF as you see it: for printing, measuring, other programs."],
    poses: [
      "Poses as morph targets",
      "GLB with one morph target a pose and an animation through them. Exact in every blend.",
    ],
    cage: ["Cage", "OBJ of the cage in this pose, for any modelling program."],
    controls: ["Controls inside", "OBJ of points (p), bones (l) and sheets (f) in this pose."],
    weights: ["Weights", "NPZ, which scipy.sparse.load_npz reads: one row a vertex of your file."],
    picture: ["Picture", "PNG of the view."],
    project: ["Project", "Model, cage, poses and settings in one GLB that Cagework opens again."],
  },
  bindFirst: "Bind the model first.",
  cageFirst: "Make a cage first.",
  poseFirst: "Save a pose first, in the step before.",
  modelFirst: "Open a model first.",
  poses: (n: number, sentence: string) => `${plural(n, "pose")}. ${sentence}`,
  format: "Format of the shape",
  size: "Size of the picture",
  sizes: ["As shown", "Twice", "Four times"],
  alone: "The model alone",
  aloneSentence: "Without cage and floor, transparent around it.",
  which: "Which model",
  all: (n: number) => `All ${n}, each to its own file`,
  saved: (files: readonly string[], size: number) =>
    `${list(files)} ${files.length === 1 ? "is" : "are"} in your downloads (${bytes(size)}).`,
  noLink: "Links work for samples only. Save a project to share your own model.",
  noLinkChanged:
    "Links work for samples only in their own cage, where all parts follow it. Save a project to share this one.",
  saveProject: "Save the project",
  copied: "Link copied. Whoever opens it sees this sample in this pose, as you see it.",
  inAddress: "The link is in the address bar; copy it from there.",
};
