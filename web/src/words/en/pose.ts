/** Sentences of step Pose and about pulling, and labels of undo steps. */

import { plural } from "../../format";

export const pose = {
  title: "Pose it",
  sentence: "Pull the model itself, or drag the handles of its cage.",
  cage: "The cage",
  none: "Nothing selected. Click a handle in the view, or press ] to step through them.",
  noneHidden: "Nothing selected. The cage is hidden: show it in the See panel.",
  noneTouch: "Nothing selected. Tap a handle in the view.",
  vertex: (i: number) => `Vertex ${i} of the cage`,
  inner: (i: number) => `Control ${i} inside`,
  vertexAtRest: (i: number) => `Vertex ${i} of the cage at rest`,
  middle: (n: number) => `Middle of ${plural(n, "vertex", "vertices")}`,
  axis: (axis: string) => `Selection, ${axis}`,
  help: "Move options",
  mirror: "Mirror across X",
  mirrorSentence: "The other side moves in mirror image.",
  unmatched: (n: number) =>
    `${plural(n, "vertex has", "vertices have")} no mirror image and ${n === 1 ? "moves" : "move"} alone.`,
  proportional: "Proportional editing",
  proportionalSentence:
    "Nearby vertices follow, less with distance. While dragging, the wheel sets the reach.",
  proportionalTouch: "Nearby vertices follow, less with distance.",
  far: "Reach",
  ofCage: (share: string) => `${share} of the cage`,
  pivot: "Turn and scale about",
  pivots: { middle: "Middle", border: "Border", last: "Last" },
  pivotTips: {
    middle: "The middle of the selection",
    border: "The border of the selection: a lower leg turns about its knee",
    last: "The last selected vertex",
  },
  poses: "Poses",
  empty:
    "No poses yet. Drag the cage, then save the pose. Saved poses can be blended, played and exported as morph targets.",
  save: "Save this pose",
  blend: "Blend",
  blendOf: (name: string) => `Blend of ${name}`,
  nameOf: (name: string) => `Name of ${name}`,
  show: "Show",
  showTip: (name: string, undo: string) => `Show ${name}; ${undo} returns to the current pose`,
  delete: (name: string) => `Delete ${name}`,
  play: "Play",
  stop: "Stop",
  reset: "Reset",
  resetTip: (key: string) => `Back to the rest pose (${key})`,
  waiting: (n: number) =>
    `${plural(n, "pose belongs", "poses belong")} to another cage and ${n === 1 ? "returns" : "return"} with it.`,
  backToCage: "Back to that cage",
  carry: "Carry over",
  saved: (name: string) => `Saved as "${name}".`,
  savedRest: (name: string) => `Saved as "${name}". It is the rest pose.`,
  saveFirst: "Save a pose first, then play it.",
  selectFirst: "Select something first: click a handle of the cage, or press A to select all.",
};

export const pull = {
  title: "Pull the model",
  tool: "Pull the model",
  sentence: (pin: string) =>
    `Drag any point of the model. Grey areas stay in place; the wheel sets how far the pull reaches. To pin a point, Shift-click it, press it long, or press ${pin} over it.`,
  sentenceTouch: "Drag any point of the model with a finger. Grey areas stay. A long press pins a point.",
  off: "Only handles can be dragged now. To pull the model, choose the tool Pull the model.",
  whole: "The whole model follows",
  wholeSentence: "Only pins stay in place: good for turning a body with its feet pinned.",
  pins: (n: number) => `${plural(n, "pin")} on the model`,
  unpinAll: "Remove all pins",
  pulling: "Pulling; Esc cancels",
  nothingThere:
    "There is no model in the middle of the view. Drag a point of the model first, then press the arrow keys.",
};

/** Status line during a gesture. `by`: amounts of the gesture, formatted. */
export const gesture = {
  grab: (by: string) => `Move ${by}`,
  rotate: (by: string) => `Rotate ${by}°`,
  scale: (by: string) => `Scale × ${by}`,
  along: (what: string, axis: string) => `${what} along ${axis}`,
  around: (what: string, axis: string) => `${what} around ${axis}`,
  within: (what: string, plane: string) => `${what} in ${plane}`,
};

/** Labels of undo steps. */
export const did = {
  forgotten: "The oldest steps can no longer be undone: the history is limited to 256 MB.",
  carry: "Carry poses over",
  pull: "Pull",
  pin: "Pin",
  unpin: "Remove pins",
  grab: "Move",
  rotate: "Rotate",
  scale: "Scale",
  vertices: (verb: string, n: number) => `${verb} ${plural(n, "vertex", "vertices")}`,
  nudge: "Nudge",
  ofCage: (what: string) => `${what} of the cage`,
  type: "Type a position",
  edits: {
    split_edge: "Split edge",
    collapse_edge: "Collapse edge",
    extrude_face: "Extrude face",
    delete_vertex: "Delete vertices",
    delete_face: "Delete faces",
  },
  pose: (name: string) => `Pose "${name}"`,
  reset: "Reset the pose",
  save: "Save a pose",
  rename: "Rename a pose",
  delete: "Delete a pose",
  blend: "Blend poses",
  makeCage: "Make a cage",
  loadCage: "Load a cage",
  smooth: (steps: number) => (steps > 0 ? "Smooth the cage" : "Plain cage"),
  controls: { point: "Put a point inside", line: "Put a bone inside", face: "Put a sheet inside" },
  radius: "Change the radius inside",
  removeControls: "Delete controls inside",
  loadControls: "Load controls inside",
  repairCage: "Repair the cage",
  addModels: (n: number) => (n === 1 ? "Add a model" : `Add ${n} models`),
  binModel: (name: string) => `Remove ${name}`,
  parts: (name: string) => `Change how ${name} follows the cage`,
  paint: "Paint fixed areas",
  erase: "Erase fixed areas",
  clearPaint: "Clear painted areas",
  poseName: (n: number) => `Pose ${n}`,
};
