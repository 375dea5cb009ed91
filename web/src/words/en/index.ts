/** All text of the page in English, one file per panel. */

import { bar, panel, tour } from "./bar";
import { bind, report } from "./bind";
import { cage } from "./cage";
import { clips } from "./clips";
import { crash, failed, fixes, link, lost, offline } from "./errors";
import { exports } from "./exports";
import { model, opening, samples } from "./model";
import { models } from "./models";
import { did, gesture, pose, pull } from "./pose";
import { proportions } from "./proportions";
import { legend, see } from "./see";
import { timeline } from "./timeline";
import { eta, hints, keys, status, toast, view } from "./view";
import { walk } from "./walk";
import { without } from "./without";
import { works } from "./works";

const words = {
  product: "Cagework",
  privacy: "Your files never leave this computer: everything is computed in this page.",
  close: "Close",
  more: "More",
  percentOf: (what: string) => `${what}, percent`,
  cancel: "Cancel",
  tryAgain: "Try again",
  reload: "Reload the page",
  axes: ["X", "Y", "Z"],
  coordinates: { harmonic: "Harmonic", mean_value: "Mean value", green: "Green" },
  somethingWrong: "Something went wrong.",
  fixes,
  failed,
  walk,
  without,
  link,
  lost,
  offline,
  crash,
  bar,
  panel,
  model,
  models,
  opening,
  samples,
  works,
  cage,
  bind,
  report,
  clips,
  pose,
  pull,
  proportions,
  did,
  gesture,
  exports,
  see,
  legend,
  view,
  status,
  hints,
  toast,
  eta,
  keys,
  tour,
  timeline,
};

export const EN = {
  /** Language tag of the page, which also determines how numbers, units and lists are written. */
  locale: "en",
  words,
  /** Downloads the texts of the tour. They are needed only if the tour is started. */
  tourWords: async () => (await import("./tour")).tourWords,
  /** Downloads the texts of the shortcut sheet. */
  sheetWords: async () => (await import("./sheet")).sheetWords,
  /** Downloads the texts of the gallery. */
  galleryWords: async () => (await import("./gallery")).galleryWords,
};
