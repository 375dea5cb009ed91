/** The status line of the view, in words. */

import { plural } from "../format";
import { type AppState, cageBroken } from "../state";
import { STAGES } from "../strings";

/** The status line: what is going on, said once. How far it is the panel and the title say. */
export function statusOf(state: AppState): string {
  return underWay(state) ?? settled(state);
}

/** What is going on, or must not be missed; null if nothing. */
export function underWay(state: AppState): string | null {
  if (state.busy) return `${state.busy}…`;
  if (state.gesture) return state.gesture;
  if (state.scene.original) return "The original, while Space is held";
  if (state.cageProgress !== null) return STAGES.simplify;
  if (state.bindRun) return STAGES[state.bindRun.stage];
  if (state.boxArmed) return "Drag a box around what you want to select";
  if (state.playing) return "Playing the poses";
  if (cageBroken(state)) return "The cage has faults; the Cage step says which";
  return null;
}

function settled(state: AppState): string {
  const { count, last } = state.selected;
  if (count === 1) return `Cage vertex ${last} selected`;
  if (count > 1) return `${plural(count, "cage vertex", "cage vertices")} selected`;
  if (state.editingRest) return "Reshaping the cage";
  if (state.bound) return "Ready";
  return state.model ? "Not bound yet" : "";
}
