/** The bar of steps, and the button at the foot of each panel. */

export const bar = {
  steps: "Steps",
  names: { model: "Model", cage: "Cage", bind: "Bind", pose: "Pose", export: "Export" },
  running: ", running",
  done: ", done",
  undo: "Undo",
  redo: "Redo",
  undoOf: (what: string | null) => (what ? `Undo: ${what}` : "Nothing to undo"),
  redoOf: (what: string | null) => (what ? `Redo: ${what}` : "Nothing to redo"),
  share: "Copy a link to this pose",
  sheet: "Keyboard shortcuts",
  theme: { auto: "Theme: as the system", dark: "Theme: dark", light: "Theme: light" },
};

export const panel = {
  step: (name: string) => `Step: ${name}`,
  size: "Make the panel larger or smaller",
  open: "Open a file",
  pose: "Pose it",
  next: "Next: the cage",
  bind: "Bind",
  bindFirst: "Bind first",
  bindAgain: "Bind again",
  bindModel: "Bind the model",
  export: "Export",
  savePose: "Save pose",
  download: "Download the GLB",
  downloadAs: "Download as GLB",
  makeCage: "Make a cage",
  newCage: "Make a new cage",
};

/** The way to the tour; what it says itself is in tour.ts. */
export const tour = {
  begin: "Take the tour",
  copied: "Link copied. Whoever opens it begins the tour at this stop.",
};
