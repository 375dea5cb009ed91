/** Text of the view and of its status line. */

import { plural } from "../../format";

export const view = {
  name: "3-D view",
  help: "Square brackets select the previous and next cage vertex, arrow keys move it, the question mark lists all keys. Tab leaves the view.",
  tools: "Tools",
  looks: "View",
  axes: "Axes",
  cue: "Drag here",
  /** Labels of the buttons that look along an axis: from its positive end, then from its negative end. */
  from: [
    "From the right (+X)",
    "From the left (−X)",
    "From above (+Y)",
    "From below (−Y)",
    "From the front (+Z)",
    "From the back (−Z)",
  ],
  mode: "What dragging changes",
  modes: { pose: "Pose", rest: "Edit cage" },
  modeTip: (key: string) =>
    `Pose: cage and model move together. Edit cage: change the cage at rest, the model stays (${key})`,
  gizmos: {
    none: "Select and drag",
    move: "Move gizmo",
    rotate: "Rotate gizmo",
    scale: "Scale gizmo",
  },
  elements: { vertex: "Select vertices", edge: "Select edges", face: "Select faces" },
  box: "Select with a box",
  add: "Add to the selection",
  see: "See: colours, grid, comparison",
  frame: "Frame everything",
  ofPlain: (coordinates: string) => `${coordinates}, cage only`,
  done: "Done",
  cancel: "Cancel",
};

export const status = {
  original: "Showing the model at rest while Space is held",
  boxArmed: "Drag a box to select",
  playing: (pose: string) => `Playing: ${pose}`,
  rest: "the rest pose",
  broken: "The cage has faults; step Cage lists them",
  capture: "Preparing the capture to follow the cage",
  selected: (last: number) => `Cage vertex ${last} selected`,
  innerSelected: (last: number) => `Control ${last} inside the cage selected`,
  placing: {
    point: "Click the model to put a point there",
    line: "Click each corner of the bone, then Done",
    face: "Click the model to put a sheet there",
  },
  /** Handles are cage vertices and inner controls. */
  manySelected: (n: number) => `${plural(n, "handle", "handles")} selected`,
  reshaping: "Editing the cage",
  ready: "Ready",
  notBound: "Not bound yet",
};

export const hints = {
  clip: "A clip is playing: drag to turn, scroll to zoom. Pause to pose it with the cage.",
  clipTouch: "A clip is playing: one finger turns, two move and zoom. Pause to pose it with the cage.",
  clipPaused: (pulls: boolean) =>
    `${pulls ? "Pull the model or a handle" : "Drag a handle of the cage"} to pose the whole clip · drag elsewhere to turn · scroll to zoom`,
  clipPausedTouch: (pulls: boolean) =>
    `${pulls ? "Pull the model or a handle" : "Drag a handle of the cage"} to pose the whole clip. Elsewhere, one finger turns, two move and zoom.`,
  noCage: "A model needs a cage around it before it can be posed.",
  placing:
    "The control is placed under the pointer, halfway between the model's front and back. Drag to turn the view.",
  restHidden: "The cage is hidden: show it in the See panel, then drag its handles.",
  rest: "Drag a handle to edit the cage; the model stays still. Pose, at the top, returns to posing.",
  binding: "The model is being bound. You can pose it afterwards.",
  unbound: "Bind the model so that it follows its cage.",
  broken: (fix: string) => `Before the model can be bound, the cage needs “${fix}”.`,
  /** What a drag does. It depends on the tool and on whether the cage is visible. */
  drags: {
    pull: "Pull the model",
    pullOrHandle: "Pull the model or a handle",
    handle: "Drag a handle",
    gizmo: "Drag the gizmo or a handle",
    nothing: "The cage is hidden: show it in the See panel, or choose Pull",
  },
  touch: (drag: string) => `${drag}. On the background, one finger turns, two move and zoom.`,
  /** `arrows`: whether the arrow keys move what a drag moves. */
  mouse: (drag: string, arrows: boolean) =>
    `${drag}${arrows ? " (arrow keys too)" : ""} · drag elsewhere to turn · right-drag to move · scroll to zoom · ? for keys`,
};

export const toast = { close: "Close message" };

export const eta = {
  second: "about a second left",
  left: (time: string) => `about ${time} left`,
};

/** Labels of keys. */
export const keys = {
  mod: "Ctrl",
  shift: "Shift",
  alt: "Alt",
  " ": "Space",
  escape: "Esc",
  enter: "Enter",
  tab: "Tab",
  home: "Home",
  delete: "Del",
  backspace: "Backspace",
  pagedown: "PgDn",
  pageup: "PgUp",
};
