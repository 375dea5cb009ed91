/** Titles of errors, labels of their remedies, and messages about lost connections, devices and crashes. */

export const fixes = {
  coarser: "Use a coarser grid",
  cpu: "Use the processor",
  fewer: "Make a cage with fewer vertices",
  file: "Choose another file",
  add: "Add another file",
  regenerate: "Make a new cage",
  reload: "Reload the page",
};

export const failed = {
  start: "Cagework did not start",
  bind: "The bind did not finish",
  slice: "The slice could not be computed",
  pull: "The model cannot be pulled",
  carry: "The poses could not be carried over",
  formula: (name: string) => `${name} coordinates could not be computed`,
  check: "The cage could not be checked",
  clip: "The clip cannot be played",
  noCage: "No cage could be made",
  cageFile: "This cage cannot be used",
  repair: "The repair failed",
  shape: "The cage cannot have this shape",
  controls: "The control could not be placed",
  controlsFile: "These controls cannot be used",
  edit: (what: string) => `${what}: not possible here`,
  write: "The file could not be written",
  time: "The time was not changed",
  bone: "The bone was not changed",
  delete: "The kept work could not be deleted",
  sample: "The sample could not be opened",
  open: (name: string) => `${name} could not be opened`,
  turn: "The model could not be turned",
  link: "This link is damaged",
  tour: "The tour could not start",
  sheet: "The shortcuts could not be shown",
};

export const offline = {
  unloaded: "Part of the page could not be loaded. Check the connection and reload; your work is kept.",
  ready: "A new version of this page is ready.",
  reload: "Reload for the new version",
};

/** Messages about faults of a share link. */
export const link = {
  noSample: "It does not say which sample it shows.",
  long: (most: number) => `It is longer than ${most} characters.`,
  unreadable: {
    pose: "Its pose cannot be read.",
    view: "Its view cannot be read.",
    controls: "Its controls cannot be read.",
    clip: "Its clip cannot be read.",
  },
  unknown: (sample: string) => `There is no sample called "${sample}" here.`,
  noClip: (clip: number) => `The sample has no clip ${clip}.`,
};

export const lost = {
  title: "The connection to the graphics card was lost",
  back: "Restoring everything…",
  notBack: "The connection to the graphics card could not be restored",
  kept: "Your work is kept in this browser.",
  again: "The connection to the graphics card was lost again",
  others: "Close other programs that use the graphics card, then try again.",
};

export const crash = {
  title: "Cagework stopped and was restarted",
  again: "Cagework stopped again",
  second: (during: string) => `${during} It was the second time, so your work is not reopened automatically.`,
  fresh: "“Start fresh” opens a sample. Your work is still kept; open it from the list when you want it.",
  report: "Report",
  showReport: "Show the report",
  while: (busy: string) => `It happened while ${busy.charAt(0).toLowerCase()}${busy.slice(1)}.`,
  with: (name: string) => `It happened with ${name} open.`,
  nothing: "Nothing was open yet.",
};
