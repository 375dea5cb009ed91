/** What this browser keeps. */

import { bytes } from "../../format";

const SAVE_A_FILE = "Save a project file (step Export) before you close the page.";

export const works = {
  title: "Kept in this browser",
  about: (days: number) =>
    `Work is kept by itself as you go, for ${days} days after its last change, on this computer only.`,
  sample: "Start with a sample",
  none: "There is nothing yet.",
  where: { here: "open here", elsewhere: "open in another tab", nowhere: "" },
  openCopy: "Open a copy",
  open: "Open",
  delete: "Delete",
  reallyDelete: "Really delete",
  stopped: "Cagework stopped with it the last time.",
  show: "Show kept work",
  full: (name: string) => `This browser has no room left to keep your work on ${name}. ${SAVE_A_FILE}`,
  forbidden: `This browser does not let the page keep your work. ${SAVE_A_FILE}`,
  large: (name: string, size: number, most: number) =>
    `Your work on ${name} is too large to be kept by itself (${bytes(size)}, of ${bytes(most)} at most). ${SAVE_A_FILE}`,
  damaged: "Some of the work that this browser kept was damaged, and is deleted.",
  damagedOf: (name: string) => `The work on ${name} that this browser kept was damaged, and is deleted.`,
  elsewhere: (name: string) => `${name} is open in another tab.`,
  notOpened: (name: string) => `Your work on ${name} could not be opened. It stays kept.`,
  left: (name: string) => `Your work on ${name} is kept in this browser.`,
  back: "Bring it back",
  restored: (name: string, ago: string) =>
    `Your work on ${name} is back, as you left it ${ago}. Undo history starts here.`,
  fresh: "Start fresh",
  moment: "a moment ago",
};
