/** The status line of the view, in words. */

import { type AppState, cageBroken } from "../state";
import { T } from "../words";

/** The status line: what is going on, said once. How far it is the panel and the title say. */
export function statusOf(state: AppState): string {
  return underWay(state) ?? settled(state);
}

/** What is going on, or must not be missed; null if nothing. */
export function underWay(state: AppState): string | null {
  if (state.busy) return `${state.busy}…`;
  if (state.gesture) return state.gesture;
  if (state.scene.original) return T.status.original;
  if (state.cageProgress !== null) return T.bind.stages.simplify;
  if (state.bindRun) return T.bind.stages[state.bindRun.stage];
  if (state.boxArmed) return T.status.boxArmed;
  if (state.playing) return T.status.playing(state.playingPose ?? T.status.rest);
  if (cageBroken(state)) return T.status.broken;
  return null;
}

function settled(state: AppState): string {
  const { count, last } = state.selected;
  if (count === 1) return T.status.selected(last);
  if (count > 1) return T.status.manySelected(count);
  if (state.editingRest) return T.status.reshaping;
  if (state.bound) return T.status.ready;
  return state.model ? T.status.notBound : "";
}

/** What the status line suggests when nothing else is going on. */
export function hintOf({ cage, bound, bindRun, editingRest }: AppState, isTouch: boolean): string {
  if (!cage) return T.hints.noCage;
  if (editingRest) return isTouch ? T.hints.restTouch : T.hints.rest;
  if (!bound) return bindRun ? T.hints.binding : T.hints.unbound;
  return isTouch ? T.hints.touch : T.hints.pose;
}
