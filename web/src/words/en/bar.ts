/** Text of the step bar, and of the buttons at the bottom of each panel. */

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
  theme: { auto: "Theme: system", dark: "Theme: dark", light: "Theme: light" },
};

export const panel = {
  step: (name: string) => `Step: ${name}`,
  size: "Resize the panel",
  open: "Open a file",
  pose: "Pose it",
  next: "Next: the cage",
  bind: "Bind",
  bindFirst: "Bind first",
  bindAgain: "Bind again",
  bindModel: "Bind the model",
  export: "Export",
  savePose: "Save pose",
  download: (format: string) => `Download the ${format}`,
  downloadAs: (format: string) => `Download as ${format}`,
  makeCage: "Make a cage",
  newCage: "Make a new cage",
};

/** Text about the tour outside its card; the text of the card is in tour.ts. */
export const tour = {
  begin: "Take the tour",
  copied: "Link copied. It opens the tour at this stop.",
};
