/** Values derived from the state of the page. */

import type {
  BindOptions,
  Element as CageElement,
  ModelInfo,
  PoseView,
  Problem,
  RigOptions,
  SceneOptions,
} from "./contract";
import { SHAPE_FORMATS, SPLAT_FORMATS } from "./defaults";
import { exportStem } from "./format";
import type { AppState, CageSettings, ShapeFormat } from "./state";

/** The rig options that apply to the open model. */
export function rigOf({ model, rigOptions, scaled }: AppState): RigOptions {
  // Options of a project may name parts that the open model does not have.
  const rigid = rigOptions.rigid.filter((name) => model?.props.includes(name));
  const follow = (model?.joints ?? 0) > 0 && rigOptions.joints !== "stay";
  return {
    ...rigOptions,
    rigid,
    ground: (rigOptions.ground || (scaled && !rigOptions.ground_off)) && follow,
    feet: follow ? rigOptions.feet : "free",
    dynamic: rigOptions.dynamic && (model?.clips.length ?? 0) > 0,
  };
}

/** Whether the cage's faults forbid a bind. */
export function cageBroken(state: AppState): boolean {
  return state.cage !== null && !state.cage.usable;
}

/** What a problem card offers: a fix of the check, or to generate another cage. */
export type ProblemFix = Problem["fixes"][number] | { readonly kind: "regenerate" };

/** The best fix of a problem; undefined for a harmless one. */
export function fixOf({ code, severity, fixes: [best] }: Problem): ProblemFix | undefined {
  const needsNewCage = severity === "error" || code === "self_intersection";
  return best ?? (needsNewCage ? { kind: "regenerate" } : undefined);
}

/** The best fix of the first fault that forbids a bind, and the number of places it mends; undefined without a fault. */
export function neededFix(state: AppState): { fix: ProblemFix; count: number } | undefined {
  const found = cageBroken(state) ? state.check?.find(({ severity }) => severity === "error") : undefined;
  const fix = found && fixOf(found);
  return fix && { fix, count: found.count };
}

/** Scene options as drawn: faults are marked only in step Cage, or if they prevent a bind. */
export function drawn(state: AppState): SceneOptions {
  const { scene, step, rigOptions } = state;
  return {
    ...scene,
    problems: scene.problems && (step === "cage" || cageBroken(state)),
    joints: scene.joints && rigOptions.joints,
    ground: rigOf(state).ground,
  };
}

/** Whether the model has no faces: a capture of splats, or a point cloud. */
export function isCapture(model: ModelInfo | null): boolean {
  return model !== null && model.splats + model.points > 0;
}

/** The formats in which the shape of a model can be exported. */
export function shapeFormatsOf(model: ModelInfo | null): readonly ShapeFormat[] {
  if (model?.splats) return SPLAT_FORMATS;
  // STL stores only faces, which a point cloud does not have.
  return model?.points ? SHAPE_FORMATS.filter((format) => format !== "stl") : SHAPE_FORMATS;
}

/** The format in which the shape of the open model is exported. */
export function shapeFormatOf({ model, shapeFormat }: AppState): ShapeFormat {
  const formats = shapeFormatsOf(model);
  const wanted = [shapeFormat, model?.format].map((one) => formats.find((format) => format === one));
  return wanted.find((format) => format !== undefined) ?? formats[0] ?? "obj";
}

/** Number of vertices and inner controls of the cage. */
export function controlCount({ cage }: Pick<AppState, "cage">): number {
  return cage ? cage.info.vertices + cage.controls.inner : 0;
}

/** The settings that determine which cage `make` of actions/cage.ts makes, as a text that can be compared. */
export function cageKey({ cageSource, cageOptions, cageClip, boxDivisions }: CageSettings): string {
  if (cageSource === "auto") return JSON.stringify([cageOptions, cageClip]);
  return cageSource === "box" ? `box ${boxDivisions}` : cageSource;
}

/** The settings of the Cage panel. */
export function cageSettings({ cageSource, cageOptions, cageClip, boxDivisions }: AppState): CageSettings {
  return { cageSource, cageOptions, cageClip, boxDivisions };
}

/** Whether the settings of the Cage panel differ from those with which the current cage was made. */
export function hasUnmadeCage(state: AppState): boolean {
  return state.cage !== null && state.cageMade !== cageKey(state);
}

/** Fraction of the requested number of vertices below which the panel explains why a generated cage has so few. */
const MIN_VERTEX_SHARE = 0.9;

/**
 * Whether a generated cage has far fewer vertices than requested, because fewer already follow the shape closely
 * enough.
 */
export function isCageSparse(state: AppState): boolean {
  const { cage, cageOptions, cageSource, sampleCage } = state;
  const isGenerated = cage !== null && cageSource === "auto" && !sampleCage && !hasUnmadeCage(state);
  return isGenerated && cage.info.vertices < MIN_VERTEX_SHARE * cageOptions.target;
}

/** Whether the page asks the user to pull the sample, because nothing has been changed yet. */
export function asksToPull(state: AppState): boolean {
  const { step, grip, pullReady, posed, undo, gesture, playing, clip, tour, scene } = state;
  const isUntouched = grip !== null && pullReady && !posed && undo === null && step !== "cage";
  return (
    isUntouched &&
    scene.pull &&
    scene.colour === "material" &&
    !gesture &&
    !playing &&
    clip.clip === null &&
    tour === null
  );
}

/** Saved poses that fit the current cage. */
export function fittingPoses(state: AppState): readonly PoseView[] {
  return state.poses.filter((pose) => pose.fits);
}

/** Whether there is an animation of saved poses that the exported GLB can contain. */
export function hasAnimation(state: AppState): boolean {
  return fittingPoses(state).length > 1 && !isCapture(state.model) && !rigOf(state).dynamic;
}

/** Whether the exported GLB contains the animation of the saved poses. */
export function exportsAnimation(state: AppState): boolean {
  return state.withAnimation && hasAnimation(state);
}

/** Name of the animation of the saved poses in exported files. */
export function animationName({ transition, model }: AppState): string {
  return transition.name || exportStem(model?.name ?? "");
}

/** Index of the saved pose that the current pose is, or was before it was changed; undefined for a blend of several. */
export function currentPose({ shares }: AppState): number | undefined {
  const [only, ...others] = [...shares.keys()].filter((k) => shares[k] !== 0);
  return others.length === 0 && only !== undefined && shares[only] === 1 ? only : undefined;
}

/** Kind of element that clicks select. In pull mode these are vertices, unless the cage is being reshaped. */
export function elementInUse({ tools, scene, editingRest }: AppState): CageElement {
  return scene.pull && !editingRest ? "vertex" : tools.element;
}

/**
 * Options of automatic binds and saved projects: the options of the last bind or, before the first bind, the chosen
 * options. Options that were chosen after a bind take effect when the user binds again.
 */
export function optionsInUse({ appliedOptions, bindOptions }: AppState): BindOptions {
  return appliedOptions ?? bindOptions;
}

/** Whether the chosen options differ from those of the last bind. False before the first bind. */
export function hasUnappliedOptions({ appliedOptions: applied, bindOptions: chosen }: AppState): boolean {
  if (applied === null) return false;
  return (Object.keys(chosen) as (keyof BindOptions)[]).some((key) => chosen[key] !== applied[key]);
}
