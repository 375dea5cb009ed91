/** Every sentence of the page in English, one file per panel. To add a language, copy this folder and list it in ../index.ts and
 * ../tour.ts. */

import { bar, panel, tour } from "./bar";
import { bind, report } from "./bind";
import { cage } from "./cage";
import { clips } from "./clips";
import { crash, failed, fixes, lost, offline } from "./errors";
import { exports } from "./exports";
import { model, opening } from "./model";
import { models } from "./models";
import { did, pose, pull } from "./pose";
import { legend, see } from "./see";
import { sheet } from "./sheet";
import { eta, hints, status, toast, view } from "./view";
import { without } from "./without";
import { works } from "./works";

export const EN = {
  product: "Cagework",
  privacy: "Your files never leave this computer: everything is computed in this page.",
  close: "Close",
  cancel: "Cancel",
  tryAgain: "Try again",
  reload: "Reload the page",
  axes: ["X", "Y", "Z"],
  coordinates: { harmonic: "Harmonic", mean_value: "Mean value", green: "Green" },
  somethingWrong: "Something went wrong.",
  fixes,
  failed,
  without,
  lost,
  offline,
  crash,
  bar,
  panel,
  model,
  models,
  opening,
  works,
  cage,
  bind,
  report,
  clips,
  pose,
  pull,
  did,
  exports,
  see,
  legend,
  view,
  status,
  hints,
  toast,
  eta,
  sheet,
  tour,
};

/** The keys that each language must define. */
export type Words = typeof EN;
