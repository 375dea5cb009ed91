/** What follows from the state of the page. */

import type { BindOptions, Element as CageElement, PoseView, RigOptions, SceneOptions } from "./contract";
import type { AppState } from "./state";

/** What becomes of the rig of the model that is open. */
export function rigOf({ model, rigOptions }: AppState): RigOptions {
  // A project may be of another model by now.
  const rigid = rigOptions.rigid.filter((name) => model?.props.includes(name));
  return { ...rigOptions, rigid, dynamic: rigOptions.dynamic && (model?.clips.length ?? 0) > 0 };
}

/** Whether the cage's faults forbid a bind. */
export function cageBroken(state: AppState): boolean {
  return state.cage !== null && !state.cage.usable;
}

/** What is drawn: faults are marked where they can be mended, or when they stop the bind. */
export function drawn(state: AppState): SceneOptions {
  const { scene, step, rigOptions } = state;
  return {
    ...scene,
    problems: scene.problems && (step === "cage" || cageBroken(state)),
    joints: scene.joints && rigOptions.joints,
  };
}

/** Vertices of the cage and controls inside. */
export function controlCount({ cage }: Pick<AppState, "cage">): number {
  return cage ? cage.info.vertices + cage.controls.inner : 0;
}

/** Saved poses of the cage that is open. */
export function fittingPoses(state: AppState): readonly PoseView[] {
  return state.poses.filter((pose) => pose.fits);
}

/** What clicks select: pulling takes single vertices, whatever is selected while reshaping. */
export function elementInUse({ element, scene, editingRest }: AppState): CageElement {
  return scene.pull && !editingRest ? "vertex" : element;
}

/** The options of a bind that follows a changed cage, and of a saved project: chosen ones count once a bind has used them. */
export function optionsInUse({ appliedOptions, bindOptions }: AppState): BindOptions {
  return appliedOptions ?? bindOptions;
}

/** Whether options were chosen that no bind has used yet. */
export function hasUnappliedOptions({ appliedOptions: applied, bindOptions: chosen }: AppState): boolean {
  if (applied === null) return false;
  return (Object.keys(chosen) as (keyof BindOptions)[]).some((key) => chosen[key] !== applied[key]);
}
