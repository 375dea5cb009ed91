/** Text of step Export. */

import { bytes, list, plural } from "../../format";

export const exports = {
  title: "Export",
  more: "More files",
  items: {
    glb: ["Posed model", "GLB of the model in this pose, with its parts, materials and textures."],
    shape: [
      "Shape only",
      "The shape alone, without skeleton and clips, for printing, measuring or other programs.",
    ],
    poses: [
      "Poses as morph targets",
      "GLB with one morph target per saved pose and an animation that plays them.",
    ],
    clips: [
      "Clips in other files",
      "Choose GLB files of clips without a mesh. They are fitted to this skeleton and downloaded.",
    ],
    cage: ["Cage", "OBJ of the cage in this pose, for any modelling program."],
    controls: ["Controls inside", "OBJ of points (p), bones (l) and sheets (f) in this pose."],
    weights: ["Weights", "NPZ for scipy.sparse.load_npz: one row per vertex of your file."],
    picture: ["Picture", "PNG of the view."],
    project: ["Project", "Model, cage, poses and settings in one GLB that Cagework opens again."],
  },
  splats: ["Splats as PLY, SPLAT or SPZ", "The splats as you see them, for viewers and editors of captures."],
  points: ["Points as PLY, OBJ or OFF", "The points as you see them."],
  bindFirst: "Bind the model first.",
  cageFirst: "Make a cage first.",
  poseFirst: "Save a pose first, in step Pose.",
  modelFirst: "Open a model first.",
  poses: (n: number, sentence: string) => `${plural(n, "pose")}. ${sentence}`,
  format: "Format of the shape",
  size: "Size of the picture",
  sizes: { 1: "As shown", 2: "Twice", 4: "Four times" },
  expressions: "Expressions of the VRM",
  expressionsSentence: "Each pose becomes an expression of the same name. No animation is written.",
  alone: "Model only",
  aloneSentence: "Without cage and floor, on a transparent background.",
  which: "Which model",
  all: (n: number) => `All ${n}, one file each`,
  zip: (n: number) => `All ${n}, in one .zip file`,
  moment: "Shape to export",
  frame: "This frame",
  restShape: "The rest shape",
  saved: (files: readonly string[], size: number) =>
    `${list(files)} ${files.length === 1 ? "is" : "are"} in your downloads (${bytes(size)}).`,
  noLink: "Links work for samples only. Save a project to share your own model.",
  noLinkChanged:
    "Links work only for samples whose cage and parts you have not changed. Save a project to share this one.",
  saveProject: "Save the project",
  copied: "Link copied. It opens this sample in this pose and view.",
  inAddress: "The link is in the address bar; copy it from there.",
};
