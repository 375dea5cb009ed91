/** Step Pose, pulling, and the steps of the history. */

import { plural } from "../../format";

export const pose = {
  title: "Pose it",
  sentence: "Take the model by the hand, or drag the handles of its cage.",
  cage: "The cage",
  none: "Nothing selected. Click a handle in the view, or press ] to go from one to the next.",
  vertex: (i: number) => `Vertex ${i} of the cage`,
  inner: (i: number) => `Control ${i} inside`,
  vertexAtRest: (i: number) => `Vertex ${i} of the cage at rest`,
  middle: (n: number) => `Middle of ${plural(n, "vertex", "vertices")}`,
  axis: (axis: string) => `Selection, ${axis}`,
  help: "Help with moving",
  mirror: "Mirror across X",
  mirrorSentence: "What you move on one side moves on the other.",
  unmatched: (n: number) =>
    `${plural(n, "vertex has", "vertices have")} no mirror image and ${n === 1 ? "moves" : "move"} alone.`,
  proportional: "Proportional editing",
  proportionalSentence:
    "Vertices nearby follow, less the farther they are. While dragging, the wheel sets how far.",
  far: "How far",
  ofCage: (share: string) => `${share} of the cage`,
  pivot: "Turn and scale about",
  pivots: { middle: "Middle", border: "Border", last: "Last" },
  pivotTips: {
    middle: "The middle of what is selected",
    border: "Where the selection meets the rest: a knee turns about it",
    last: "The vertex that was selected last",
  },
  poses: "Poses",
  empty:
    "No poses yet. Drag the cage, then save what you see; saved poses can be mixed, played and exported as morph targets.",
  save: "Save this pose",
  blend: "Blend",
  blendOf: (name: string) => `Blend of ${name}`,
  nameOf: (name: string) => `Name of ${name}`,
  show: "Show",
  showTip: (name: string, undo: string) => `Show ${name}; ${undo} brings back what is shown now`,
  delete: (name: string) => `Delete ${name}`,
  play: "Play",
  stop: "Stop",
  reset: "Reset",
  resetTip: (key: string) => `Back to the rest pose (${key})`,
  waiting: (n: number) =>
    `${plural(n, "pose belongs", "poses belong")} to another cage and ${n === 1 ? "waits" : "wait"} for it.`,
  backToCage: "Back to that cage",
  carry: "Carry over",
  saved: (name: string) => `Saved as "${name}".`,
  savedRest: (name: string) => `Saved as "${name}": it is the rest pose.`,
  saveFirst: "Save a pose first; then it can be played.",
  selectFirst: "Select something first: click a handle of the cage, or press A for all.",
};

export const pull = {
  title: "Pull the model",
  tool: "Pull the model: take it by the hand",
  sentence: (pin: string) =>
    `Drag any point of the model. Parts in grey stay; the wheel sets how far the pull reaches. Shift-click, a long press or ${pin} pins a point.`,
  whole: "The whole model follows",
  wholeSentence: "Nothing stays but the pins: good for turning a body with its feet pinned.",
  pins: (n: number) => `${plural(n, "pin")} on the model`,
  unpinAll: "Take all pins away",
  pulling: "Pulling; Esc puts it back",
  nothingThere: "There is no model in the middle of the view: point at it and press an arrow key again.",
};

/** Steps of the history. */
export const did = {
  carry: "Carry the poses over",
  pull: "Pull",
  pin: "Pin",
  unpin: "Take pins away",
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
  poseName: (n: number) => `Pose ${n}`,
};
