/** The synchronous side: `Engine` of crates/cagework-web. */

import type { CageState, RestEdit } from "./cage";
import type { Element, Gesture, GizmoHandle, Legend, SceneOptions, SelectMode } from "./scene";

export interface Engine {
  // --- size and camera
  /** CSS pixels and device pixels per CSS pixel (cap it at 2). */
  resize(width: number, height: number, scale: number): void;
  orbit(dx: number, dy: number): void;
  pan(dx: number, dy: number): void;
  /** `factor` above 1 comes nearer. */
  zoomAt(x: number, y: number, factor: number): void;
  /** Frames the selection (all if nothing is selected), or all. */
  frameAll(): void;
  frameSelection(): void;
  axisView(axis: 0 | 1 | 2, negative: boolean): void;
  /** True for parallel projection. */
  toggleOrtho(): boolean;
  /** A point on the canvas: `[x, y, visible ? 1 : 0]`. For labels. */
  project(x: number, y: number, z: number): Float32Array;
  setScene(scene: SceneOptions): void;
  legend(): Legend | undefined;

  // --- cage
  /** Of some of the model's vertices, how many are outside of the cage as it is dragged now. For every movement. */
  strays(): number;
  /** Whether gestures change the rest cage, without the model following. */
  setEditingRest(editing: boolean): void;
  /** Only while editing the rest cage. The selection afterwards is what was made. */
  editRest(edit: RestEdit): CageState;
  /**
   * Takes a cage given as arrays, unchecked (`Session.takeCage` brings its check along). `corners`: for each face its
   * number of corners, then them.
   */
  setCage(positions: Float32Array, corners: Uint32Array): CageState;
  /** Marks what a `Check` of the cage has found. */
  showFaults(
    vertices: Uint32Array,
    edges: Uint32Array,
    faces: Uint32Array,
    points: Float32Array,
    outside: Uint32Array,
  ): void;
  /** The moved rest cage becomes the cage; it has to be bound again. */
  commitRest(): CageState;
  cageState(): CageState | undefined;
  cageCorners(): Uint32Array;
  restPositions(): Float32Array;
  cagePositions(): Float32Array;
  /** Moves the cage, the model follows: undo, reset (with restPositions), poses. */
  setCagePositions(positions: Float32Array): void;
  readonly bound: boolean;

  // --- selection (cage vertices; edges and faces select their corners)
  setElement(element: Element): void;
  /** Vertices of the element under the pointer, empty for none. `radius` for touch: 24, mouse: 10. */
  pick(x: number, y: number, radius: number): Uint32Array;
  hover(vertices: Uint32Array): void;
  select(vertices: Uint32Array, mode: SelectMode): void;
  selectBox(x0: number, y0: number, x1: number, y1: number, mode: SelectMode): void;
  selectAll(): void;
  selectLinked(): void;
  /** Ascending. */
  selection(): Uint32Array;
  /** The vertex selected last, -1 for none: the one whose weights are shown. */
  last(): number;
  /** `[x, y, z]`, empty without a selection. */
  selectionCenter(): Float32Array;
  moveSelectionTo(x: number, y: number, z: number): boolean;
  /** CSS pixels in the view plane. */
  nudge(right: number, up: number): boolean;
  setSymmetry(on: boolean): void;
  /** Cage vertices without a mirror image; also drawn in another colour while symmetry is on. */
  unmatched(): Uint32Array;
  /** Proportional editing: radius as a fraction of the cage's diagonal, 0 = off. */
  setProportional(radius: number): void;

  // --- gestures: begin, then drag/constrain/type, then end. One gesture is one undo step (page keeps positions before).
  beginTransform(gesture: Gesture, x: number, y: number): boolean;
  /** The gizmo's handle under the pointer, or the nearest within `radius` (as for `pick`); undefined for none. */
  gizmoAt(x: number, y: number, radius: number): GizmoHandle | undefined;
  /** Begins the gesture of that handle. */
  beginGizmo(handle: GizmoHandle, x: number, y: number): boolean;
  dragTransform(x: number, y: number): void;
  /** Axis 0 to 2 or the plane without it; -1 frees. */
  constrain(axis: number, plane: boolean): void;
  /** An amount instead of the pointer (object units, degrees, factor); undefined goes back to the pointer. */
  typeTransform(amount: number | undefined): void;
  /** "Move 0.25 along X", for the status line. */
  transformLabel(): string;
  /** True when it moved something and is kept. */
  endTransform(keep: boolean): boolean;

  // --- poses
  blend(poses: readonly Float32Array[], shares: Float32Array): void;
  /** A moment of the animation rest -> poses -> rest, a second each. */
  playAt(poses: readonly Float32Array[], seconds: number): void;
  /** 6 bytes a cage vertex, for the share link. */
  encodePose(): Uint8Array;
  decodePose(bytes: Uint8Array): void;

  // --- export (bytes of a file)
  exportGlb(): Uint8Array;
  exportPoses(names: readonly string[], poses: readonly Float32Array[]): Uint8Array;
  exportCage(): Uint8Array;
  exportWeights(): Uint8Array;
  /** Model, cage, poses and `settings` (JSON of the page) as one GLB. */
  writeProject(names: readonly string[], poses: readonly Float32Array[], settings: string): Uint8Array;
  modelPositions(): Float32Array;
}
