/** The view, and what is said beneath it. */

import { plural } from "../../format";

export const view = {
  name: "3-D view",
  help: "Square brackets go from one cage vertex to the next, arrow keys move it, question mark lists all keys. Tab leaves the view.",
  tools: "Tools",
  looks: "View",
  mode: "What dragging changes",
  modes: { pose: "Pose", rest: "Reshape" },
  modeTip: (key: string) => `Pose the model, or reshape its cage (${key})`,
  gizmos: {
    none: "Select and drag",
    move: "Move gizmo",
    rotate: "Rotate gizmo",
    scale: "Scale gizmo",
  },
  elements: { vertex: "Select vertices", edge: "Select edges", face: "Select faces" },
  box: "Select by a box",
  add: "Add to the selection",
  addKey: "Shift+click",
  see: "See: colours, grid, comparison",
  frame: "Frame everything",
  ofPlain: (coordinates: string) => `${coordinates}, plain cage`,
  done: "Done",
  cancel: "Cancel",
};

export const status = {
  original: "The original, while Space is held",
  boxArmed: "Drag a box around what you want to select",
  playing: (pose: string) => `Playing: ${pose}`,
  rest: "the rest pose",
  broken: "The cage has faults; the Cage step says which",
  selected: (last: number) => `Cage vertex ${last} selected`,
  innerSelected: (last: number) => `Control ${last} inside selected`,
  placing: {
    point: "Click into the model to put a point there",
    line: "Click from joint to joint, then Done",
    face: "Click into the model to put a sheet there",
  },
  /** Of the cage, inside it, or both. */
  manySelected: (n: number) => `${plural(n, "handle", "handles")} selected`,
  reshaping: "Reshaping the cage",
  ready: "Ready",
  notBound: "Not bound yet",
};

export const hints = {
  clip: "A clip is shown: drag to turn, scroll to zoom. To pose the model, choose none.",
  noCage: "A model needs a cage around it before it can be posed.",
  placing: "It goes into the middle of the model, under the pointer. Drag to turn the view.",
  restTouch: "Drag a handle to reshape the cage; the model stays still.",
  rest: "Drag a handle to reshape the cage; the model stays still. Tab goes back to posing.",
  binding: "The model is being bound: posing waits until it is.",
  unbound: "Bind the model, then it follows its cage.",
  touch: "Pull the model with a finger. Beside it one finger turns, two move and zoom.",
  pose: "Pull the model, or drag a handle · drag beside it to turn · right-drag to move · scroll to zoom · ? for keys",
};

export const toast = { close: "Close message" };

export const eta = {
  second: "about a second left",
  left: (time: string) => `about ${time} left`,
};
