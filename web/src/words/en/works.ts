/** Text about work kept in the browser. */

const SAVE_ADVICE = "Save a project file (step Export) before you close the page.";

export const works = {
  title: "Work kept in this browser",
  about: (days: number) =>
    `Your work is kept automatically, for ${days} days after its last change, on this computer only.`,
  sample: "Start with a sample",
  none: "No work is kept yet.",
  where: { here: "open here", elsewhere: "open in another tab", nowhere: "" },
  openCopy: "Open a copy",
  open: "Open",
  delete: "Delete",
  reallyDelete: "Confirm delete",
  stopped: "Cagework stopped the last time this was open.",
  show: "Show kept work",
  full: (name: string) => `This browser has no room left to keep your work on ${name}. ${SAVE_ADVICE}`,
  forbidden: `This browser does not let the page keep your work. ${SAVE_ADVICE}`,
  large: (name: string, reason: string) =>
    `Your work on ${name} is not kept automatically: ${reason}. ${SAVE_ADVICE}`,
  damaged: "Some of the work kept in this browser was damaged and has been deleted.",
  damagedOf: (name: string) =>
    `Your work on ${name}, kept in this browser, was damaged and has been deleted.`,
  elsewhere: (name: string) => `${name} is open in another tab.`,
  notOpened: (name: string) => `Your work on ${name} could not be opened. It is still kept.`,
  left: (name: string) => `Your work on ${name} is kept in this browser.`,
  back: "Bring it back",
  restored: (name: string, ago: string) =>
    `Your work on ${name} is back as you left it ${ago}. Earlier changes cannot be undone.`,
  restoredPart: (name: string, ago: string) =>
    `Your work on ${name} is back as it was kept ${ago}. Your last change after that was not kept.`,
  fresh: "Start fresh",
  moment: "a moment ago",
};
