/** Sentences of the status line. */

import { cageBroken, isCapture, neededFix, rigOf } from "../derived";
import type { AppState } from "../state";
import { T } from "../words";
import { fixLabel } from "./cage";

/** The status line. It contains no percentages, because the panel and the window's title show them. */
export function statusOf(state: AppState): string {
  return underWay(state) ?? settled(state);
}

/** Sentence about the operation or mode in progress, or about a cage that cannot be bound; null without one. */
export function underWay(state: AppState): string | null {
  if (state.busy) return `${state.busy}…`;
  if (state.gesture) return state.gesture;
  if (state.scene.original) return T.status.original;
  if (state.cageProgress !== null) return T.bind.stages.simplify;
  if (state.bindRun) return T.bind.stages[state.bindRun.stage];
  if (state.placing) return T.status.placing[state.placing];
  if (state.painting) return T.models.painting;
  if (state.boxArmed) return T.status.boxArmed;
  if (state.hoversAlone) return T.pose.movesAlone;
  if (state.playing) return T.status.playing(state.playingPose ?? T.status.rest);
  if (cageBroken(state)) return T.status.broken;
  if (isCapture(state.model) && state.bound && !state.lattice) return T.status.capture;
  return null;
}

function settled(state: AppState): string {
  const { count, last } = state.selected;
  const inner = (last ?? 0) - (state.cage?.info.vertices ?? 0);
  if (count === 1) return inner < 0 ? T.status.selected(last ?? 0) : T.status.innerSelected(inner + 1);
  if (count > 1) return T.status.manySelected(count);
  if (state.editingRest) return T.status.reshaping;
  if (state.bound) return T.status.ready;
  return state.model ? T.status.notBound : "";
}

/** The hint beside the status line. */
export function hintOf(state: AppState, isTouch: boolean): string {
  const { cage, bound, bindRun, editingRest, clip, placing, painting, scene } = state;
  if (placing) return T.hints.placing;
  if (painting) return isTouch ? T.models.hintTouch : T.models.hint;
  if (!cage) return T.hints.noCage;
  const needed = neededFix(state);
  if (needed) return T.hints.broken(fixLabel(needed.fix, needed.count));
  if (clip.clip !== null && clip.playing) return isTouch ? T.hints.clipTouch : T.hints.clip;
  // A clip that the cage deforms after it has moved the model cannot be pulled.
  if (clip.clip !== null)
    return T.hints[isTouch ? "clipPausedTouch" : "clipPaused"](scene.pull && !rigOf(state).dynamic);
  if (editingRest && !scene.cage) return T.hints.restHidden;
  if (editingRest) return T.hints.rest;
  if (!bound) return bindRun ? T.hints.binding : T.hints.unbound;
  const drag = T.hints.drags[dragOf(state)];
  return isTouch ? T.hints.touch(drag) : T.hints.mouse(drag, scene.pull || state.selected.count > 0);
}

function dragOf({ scene, selected }: AppState): keyof typeof T.hints.drags {
  if (scene.pull) return scene.cage ? "pullOrHandle" : "pull";
  if (!scene.cage) return "nothing";
  return scene.gizmo !== null && selected.count > 0 ? "gizmo" : "handle";
}
