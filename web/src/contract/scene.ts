/** What is shown. */

export interface SceneOptions {
  readonly theme: "light" | "dark";
  readonly model: boolean;
  /** Wireframe of the undeformed model over the posed one (the paper's figures). */
  readonly base_wireframe: boolean;
  readonly cage: boolean;
  readonly floor: boolean;
  /** Show the model and the cage at rest (Space held). */
  readonly original: boolean;
  /** "weight": heat map of the vertex selected last; "error": rest error, log. */
  readonly colour: "material" | "clay" | "weight" | "error";
  /** Plane loaded by `loadSlice`; "value": coordinate of the vertex selected last. */
  readonly slice: "off" | "kinds" | "value";
  readonly gizmo: "none" | "move" | "rotate" | "scale";
  /** Left half harmonic, right half mean value, same pose. */
  readonly compare: boolean;
  /** Mark the cage's problems. */
  readonly problems: boolean;
}

/** What colours mean at the moment. */
export interface Legend {
  readonly low: number;
  readonly high: number;
  readonly logarithmic: boolean;
  readonly map: "viridis" | "error" | "kinds";
}

export interface Pose {
  readonly name: string;
  readonly positions: Float32Array;
}
export type SelectMode = "replace" | "add" | "remove" | "toggle";
export type Element = "vertex" | "edge" | "face";
export type Gesture = "grab" | "rotate" | "scale";
/** Axis, plane (normal to the axis) or the whole. */
export type GizmoHandle = "x" | "y" | "z" | "plane_x" | "plane_y" | "plane_z" | "all";
