/** Text of step Cage. */

import { count, endings, plural } from "../../format";

export const cage = {
  title: "Put a cage around it",
  sentence: "A cage is a coarse closed mesh around the model. Move its few vertices, and the model follows.",
  how: "Kind of cage",
  sources: { auto: "Automatic", hull: "Hull", box: "Box", file: "File" },
  about: {
    auto: "Follows the limbs of the model and encloses every vertex. It is checked before you see it.",
    hull: "A rough hull of about 24 vertices: good for bodies without limbs, and quick to pose.",
    box: "A box around the model. Its sides are divided into quads, as in free-form deformation.",
    get file() {
      return `A closed mesh that you made around the model, as a ${endings("disjunction")} file.`;
    },
  },
  follow: "Drawn along",
  follows: { auto: "Either", skeleton: "Skeleton", shell: "Surface" },
  followTips: {
    auto: "Sleeves of four-sided rings along arms, legs and body if they enclose the model well, otherwise its surface",
    skeleton: "Only sleeves along the skeleton; if the model has none, the page says why",
    shell: "The surface of the model",
  },
  sleeves: "Sleeves along the skeleton: a double click on a handle selects its ring.",
  wanted: "Number of vertices",
  closeness: "Closeness",
  within: (share: string) => `within ${share} of the model's size`,
  quads: "Quads",
  quadsSentence: "Four-sided faces where two triangles make a good one.",
  margin: "Margin around the model",
  tight: "as tight as possible",
  ofSize: (share: string) => `${share} of the model's size`,
  gaps: "Gaps left open",
  asVertices: "as small as the number of vertices allows",
  from: (share: string) => `from ${share} of the model's size`,
  symmetry: "Symmetric left and right",
  symmetries: { auto: "If the model is", x: "Yes", none: "No" },
  around: "Enclose",
  aroundRest: "The model at rest and its morph targets",
  perPart: "A cage for each part",
  perPartSentence: "For models made of separate parts. Off: one cage around all of them.",
  divisions: "Quads along the longest edge",
  make: "Make this cage",
  load: "Open a cage file",
  making: "Making the cage",
  result: "The cage",
  smooth: "Smooth cage",
  smoothOn: "Smooth its surface",
  smoothSentence:
    "Binds to a smooth subdivision surface, so that edges of the cage do not show on the model. You still drag the cage's vertices.",
  steps: "Subdivision steps",
  inside: "Controls inside",
  insideSentence:
    "Handles inside the model, for places that the cage does not reach. Each moves the part of the model near it.",
  kinds: { point: "Point", line: "Bone", face: "Sheet" },
  kindTips: {
    point: "A ball that moves the part of the model near it. Click to place it.",
    line: "A line with corners, at which it bends. Click each corner; end with Done, Enter or a second click on the last corner.",
    face: "A wall: the model on one side of it does not follow the model on the other side. Click to place its middle.",
  },
  radius: "Radius",
  count: (points: number, lines: number, faces: number) =>
    [
      points > 0 ? plural(points, "point") : "",
      lines > 0 ? plural(lines, "bone") : "",
      faces > 0 ? plural(faces, "sheet") : "",
    ]
      .filter(Boolean)
      .join(", "),
  removeSelected: "Delete",
  clear: "Delete all",
  openControls: "From a file",
  moveThem: (key: string) =>
    `Drag them like cage vertices. While you edit the cage (${key} in the view), dragging moves their rest position; otherwise it poses the model.`,
  reshape: "Edit the cage",
  reshapeSentence: (key: string) =>
    `Edit the cage itself (${key} in the view). The model stays still and is bound again afterwards.`,
  tools: "Edit the cage",
  growTip: "Grow the cage until it encloses the model",
  edits: {
    split_edge: "Split edge",
    collapse_edge: "Collapse edge",
    extrude_face: "Extrude face",
    delete_vertex: "Delete and fill",
    delete_face: "Delete and fill",
  },
  hints: {
    vertex:
      "Clicks select vertices. To split or collapse, choose edges on the left; to extrude, choose faces.",
    edge: "Click an edge to split it in the middle or to collapse it into one vertex.",
    face: "Click a face to extrude or delete it. The gap left by deleting it is filled.",
  },
  none: "There is no cage yet. Make one with the button below.",
  needsRepair: "Needs repair",
  checking: "Checking…",
  outside: "Vertices outside",
  encloses: "Encloses the model",
  partOutside: "Part of the model is outside.",
  preview: (n: number) => `The view shows a preview with ${plural(n, "vertex", "vertices")}.`,
  vertices: (n: number) => plural(n, "vertex", "vertices"),
  facts: (faces: number, quads: string, edges: number) =>
    `${plural(faces, "face")}, ${quads} of them quads; ${plural(edges, "edge")}`,
  posesWait: (saved: number) =>
    saved > 0
      ? "Saved poses fit only the previous cage. Go back to that cage, or carry them over."
      : "The pose fits only the previous cage. Go back to that cage, or carry it over.",
  bridged: (parts: number, models: number) =>
    `${models > 1 ? "The models have" : "The model has"} ${count(parts)} separate parts; this cage joins them.`,
  sparse: (share: string, wanted: string) =>
    `With fewer vertices than the ${wanted} you asked for, the cage is already within ${share} of the model's size from it. For more, move Closeness to the right.`,
  sparsest: (share: string) =>
    `The cage is within ${share} of the model's size from it, the closest setting.`,
  fineEnough: "The grid you chose is fine enough",
  repairs: {
    weld: () => "Join them",
    drop_degenerate: (n: number) => (n === 1 ? "Remove it" : `Remove all ${n}`),
    mirror: () => "Mirror this half",
    fill_holes: () => "Fill the holes",
    flip: () => "Turn them outward",
    grow: () => "Grow the cage",
  },
  bindFiner: (cells: number) => `Bind with ${cells} cells`,
  more: (made: number, wanted: number) =>
    `The model's shape needs more vertices: ${made} instead of ${wanted}.`,
};
