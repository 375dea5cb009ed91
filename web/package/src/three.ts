/** Deforms geometries of three.js by a cage. Does not import three.js, so any version of it can be used. */

import { bind, deform, generateCage } from "@cagework/core";
import type { BindReport } from "./contract/generated";
import { named } from "./session/client";
import type { BindCallOptions, Cage, CageCallOptions, Weights } from "./types";

/** Members of three.js's `BufferAttribute` that are used here. Interleaved and quantised attributes have them too. */
export interface Attribute {
  readonly count: number;
  getX(index: number): number;
  getY(index: number): number;
  getZ(index: number): number;
  setXYZ(index: number, x: number, y: number, z: number): unknown;
  readonly array: ArrayLike<number>;
  clone(): unknown;
  set needsUpdate(value: boolean);
}

/** Members of three.js's `BufferGeometry` that are used here. */
export interface Geometry {
  getAttribute(name: "position" | "normal"): unknown;
  setAttribute(name: "position", attribute: never): unknown;
  getIndex(): { readonly count: number; getX(index: number): number } | null;
  computeBoundingSphere(): void;
  computeBoundingBox(): void;
}

/** Members of three.js's `Vector3` that are used here. */
interface Vector {
  readonly x: number;
  readonly y: number;
  readonly z: number;
  clone(): Vector;
  set(x: number, y: number, z: number): Vector;
  add(other: Vector): Vector;
  sub(other: Vector): Vector;
  copy(other: Vector): Vector;
  applyMatrix4(matrix: Matrix): Vector;
  setFromMatrixPosition(matrix: Matrix): Vector;
}

/** Members of three.js's `Matrix4` that are used here. */
interface Matrix {
  clone(): Matrix;
  copy(other: Matrix): Matrix;
  invert(): Matrix;
  multiply(other: Matrix): Matrix;
  setPosition(x: Vector | number, y?: number, z?: number): Matrix;
}

/** Members of three.js's `Bone` that are used here. */
interface Joint {
  readonly parent: unknown;
  readonly position: unknown;
  readonly matrix: unknown;
  updateMatrix(): void;
}

/** Members of three.js's `SkinnedMesh` that are used here. */
export interface Skinned {
  readonly geometry: Geometry;
  readonly bindMatrix: unknown;
  readonly bindMatrixInverse: unknown;
  readonly skeleton: { readonly bones: readonly Joint[]; readonly boneInverses: readonly unknown[] };
}

/**
 * `cage`: the cage to bind to. `cageOptions`: options of `generateCage`, which makes a cage if there is no `cage`. All
 * other options are those of `bind`.
 */
export type DeformerOptions = BindCallOptions & {
  readonly cage?: Cage | undefined;
  readonly cageOptions?: CageCallOptions | undefined;
};

/**
 * One geometry, whose vertices are numbered from `first`. `group[v]` is the number of the first vertex that shares the
 * normal of vertex `first + v`.
 */
interface Part {
  readonly geometry: Geometry;
  readonly first: number;
  position: Attribute;
  readonly normal: Attribute | undefined;
  readonly group: Uint32Array;
}

/** A joint of a skinned mesh at rest. Linear parts are matrices without translation. */
interface RestJoint {
  readonly position: Vector;
  /** Index of the parent among the joints; -1 for none. */
  readonly parent: number;
  readonly inverse: Matrix;
  /** From the joint to the space in which the skeleton was bound, at rest. */
  readonly world: Matrix;
  readonly origin: Vector;
  /** Linear part from the geometry to the space in which the skeleton was bound. */
  readonly toWorld: Matrix;
  /** Linear part from the space in which the skeleton was bound to the parent of the joint. */
  readonly toParent: Matrix;
  /** Displacement that was added to `position`. */
  readonly added: Vector;
}

/**
 * Moves the vertices of geometries with a cage. The geometries and the cage must have the same coordinate system, such
 * as the local space of one mesh. The joints of a `SkinnedMesh` follow, as with `joints: "follow"` of `reshape`: they keep
 * their directions, and the skin stays as it is at rest. The skeleton must be at rest when the deformer is created.
 * Animations that set the position of a joint, not only its rotation, put it back.
 *
 *     const deformer = await CageDeformer.create(mesh.geometry, { grid: 64 });
 *     deformer.pose[1] += 0.5;
 *     await deformer.update();
 */
export class CageDeformer {
  /** The cage at rest. */
  readonly cage: Cage;
  /** Positions of the cage's vertices, `[n_cage, 3]`. Change them, then call `update`. */
  readonly pose: Float32Array;
  /** Pairs of vertices of the cage, for the index of `LineSegments`. */
  readonly edges: Uint32Array;
  readonly report: BindReport;
  readonly weights: Weights;
  readonly #parts: readonly Part[];
  readonly #triangles: Uint32Array;
  readonly #joints: readonly RestJoint[];
  #updating: Promise<void> | undefined;
  #isOutdated = false;

  private constructor(
    cage: Cage,
    weights: Weights,
    report: BindReport,
    parts: Part[],
    triangles: Uint32Array,
    joints: readonly RestJoint[],
  ) {
    this.cage = cage;
    this.pose = Float32Array.from(cage.positions);
    this.edges = edgesOf(cage);
    this.report = report;
    this.weights = weights;
    this.#parts = parts;
    this.#triangles = triangles;
    this.#joints = joints;
  }

  /** Binds geometries or skinned meshes to the given cage. If there is none, generates a cage around them first. */
  static async create(
    models: Geometry | Skinned | readonly (Geometry | Skinned)[],
    { cage, cageOptions = {}, ...options }: DeformerOptions = {},
  ): Promise<CageDeformer> {
    const all = "length" in models ? models : [models];
    const geometries = all.map((model) => ("skeleton" in model ? model.geometry : model));
    const { parts, positions, triangles } = joined(geometries);
    const joints = jointsOf(all.filter((model) => "skeleton" in model));
    const { signal } = options;
    const around = cage ?? (await generateCage({ positions, triangles }, { signal, ...cageOptions }));
    const points = [...positions, ...joints.flatMap(({ origin: { x, y, z } }) => [x, y, z])];
    const { weights, report } = await bind(Float32Array.from(points), around, options);
    return new CageDeformer(around, weights, report, parts, triangles, joints);
  }

  /**
   * Writes the positions and normals of the current pose into the geometries. If it is called during an update, one
   * more update follows.
   */
  update(): Promise<void> {
    this.#isOutdated = true;
    this.#updating ??= this.#run().finally(() => {
      this.#updating = undefined;
    });
    return this.#updating;
  }

  async #run(): Promise<void> {
    while (this.#isOutdated) {
      this.#isOutdated = false;
      const points = await deform(this.weights, this.pose);
      const normals = normalsOf(points, this.#triangles, this.#parts);
      for (const part of this.#parts) {
        const { geometry, first, normal } = part;
        part.position = asFloats(geometry, part.position);
        write(part.position, points, first);
        if (normal) write(normal, normals, first);
        geometry.computeBoundingSphere();
        geometry.computeBoundingBox();
      }
      moveJoints(this.#joints, points.subarray(points.length - 3 * this.#joints.length));
    }
  }
}

/** Collects the joints of skinned meshes at rest. A skeleton that several meshes share counts once. */
function jointsOf(meshes: readonly Skinned[]): RestJoint[] {
  const joints: RestJoint[] = [];
  const seen = new Set<Skinned["skeleton"]>();
  for (const { skeleton, bindMatrix, bindMatrixInverse } of meshes) {
    if (seen.has(skeleton)) continue;
    seen.add(skeleton);
    const [first, { bones, boneInverses }] = [joints.length, skeleton];
    const linear = (matrix: Matrix) => matrix.clone().setPosition(0, 0, 0);
    for (const [k, bone] of bones.entries()) {
      const [inverse, position] = [boneInverses[k] as Matrix, bone.position as Vector];
      const world = inverse.clone().invert();
      const parent = bones.indexOf(bone.parent as Joint);
      bone.updateMatrix();
      const toParent =
        parent >= 0 ? (boneInverses[parent] as Matrix) : (bone.matrix as Matrix).clone().multiply(inverse);
      joints.push({
        position,
        parent: parent < 0 ? -1 : first + parent,
        inverse,
        world,
        origin: position.clone().setFromMatrixPosition((bindMatrixInverse as Matrix).clone().multiply(world)),
        toWorld: linear(bindMatrix as Matrix),
        toParent: linear(toParent),
        added: position.clone().set(0, 0, 0),
      });
    }
  }
  return joints;
}

/** Moves joints to `points`, in the space of the geometry, and changes their inverse bind matrices accordingly. */
function moveJoints(joints: readonly RestJoint[], points: Float32Array): void {
  const by = joints.map(({ origin, toWorld }, k) => {
    const [x = 0, y = 0, z = 0] = points.subarray(3 * k);
    return origin.clone().set(x, y, z).sub(origin).applyMatrix4(toWorld);
  });
  for (const [k, { position, parent, inverse, world, toParent, added }] of joints.entries()) {
    const own = by[k]?.clone();
    const of = by[parent];
    if (!own) continue;
    const moved = own.clone().setFromMatrixPosition(world).add(own);
    inverse.copy(world).setPosition(moved).invert();
    const local = (of ? own.sub(of) : own).applyMatrix4(toParent);
    position.sub(added).add(local);
    added.copy(local);
  }
}

function joined(geometries: readonly Geometry[]) {
  const parts: Part[] = [];
  const positions: number[] = [];
  const triangles: number[] = [];
  for (const geometry of geometries) {
    const position = geometry.getAttribute("position") as Attribute | undefined;
    if (!position?.count) throw named("Missing", "the geometry has no positions");
    const normal = geometry.getAttribute("normal") as Attribute | undefined;
    const first = positions.length / 3;
    for (let v = 0; v < position.count; v++)
      positions.push(position.getX(v), position.getY(v), position.getZ(v));
    const index = geometry.getIndex();
    const corners = index?.count ?? position.count;
    for (let k = 0; k < corners; k++) triangles.push(first + (index?.getX(k) ?? k));
    parts.push({ geometry, first, position, normal, group: groupsOf(position, normal, first) });
  }
  return { parts, positions: Float32Array.from(positions), triangles: Uint32Array.from(triangles) };
}

/**
 * Step to which positions are rounded before they are compared, as a fraction of the largest coordinate: the positions
 * of a vertex on both sides of a seam differ by rounding.
 */
const SAME_POSITION = 1e-6;
/**
 * Step to which components of normals are rounded before they are compared: the normals of a vertex on both sides of a
 * seam differ by rounding and quantisation.
 */
const SAME_NORMAL = 1e-2;

/**
 * Finds, for each vertex, the number of the first vertex with the same position and normal, for example on the other
 * side of a texture seam.
 */
function groupsOf(position: Attribute, normal: Attribute | undefined, first: number): Uint32Array {
  let size = 0;
  for (let v = 0; v < position.count; v++) {
    size = Math.max(size, Math.abs(position.getX(v)), Math.abs(position.getY(v)), Math.abs(position.getZ(v)));
  }
  const key = (of: Attribute, v: number, step: number) =>
    [of.getX(v), of.getY(v), of.getZ(v)].map((x) => Math.round(x / step)).join();
  const seen = new Map<string, number>();
  return Uint32Array.from({ length: position.count }, (_, v) => {
    const place = `${key(position, v, SAME_POSITION * size || 1)} ${normal && key(normal, v, SAME_NORMAL)}`;
    const group = seen.get(place) ?? first + v;
    seen.set(place, group);
    return group;
  });
}

/**
 * Computes unit normals of points. All vertices of a group have the same normal: the sum of the normals of their
 * triangles, weighted by area.
 */
function normalsOf(points: Float32Array, triangles: Uint32Array, parts: readonly Part[]): Float32Array {
  const groups = new Uint32Array(points.length / 3);
  for (const { first, group } of parts) groups.set(group, first);
  const sums = new Float32Array(points.length);
  const at = (v: number, axis: number) => points[3 * v + axis] ?? 0;
  for (let t = 0; t < triangles.length; t += 3) {
    const [a = 0, b = 0, c = 0] = triangles.subarray(t, t + 3);
    const [ux, uy, uz] = [at(b, 0) - at(a, 0), at(b, 1) - at(a, 1), at(b, 2) - at(a, 2)];
    const [vx, vy, vz] = [at(c, 0) - at(a, 0), at(c, 1) - at(a, 1), at(c, 2) - at(a, 2)];
    const normal = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const v of [a, b, c]) {
      const g = 3 * (groups[v] ?? 0);
      for (let axis = 0; axis < 3; axis++) sums[g + axis] = (sums[g + axis] ?? 0) + (normal[axis] ?? 0);
    }
  }
  return Float32Array.from(sums, (_, k) => {
    const g = 3 * (groups[Math.floor(k / 3)] ?? 0);
    const length = Math.hypot(sums[g] ?? 0, sums[g + 1] ?? 0, sums[g + 2] ?? 0);
    return (sums[g + (k % 3)] ?? 0) / (length || 1);
  });
}

/**
 * Returns positions that can hold any pose. Integers wrap around where a pose leaves their range, so a quantised
 * attribute is replaced by a copy in floats.
 */
function asFloats(geometry: Geometry, position: Attribute): Attribute {
  const isHalf = "isFloat16BufferAttribute" in position;
  if (isHalf || position.array instanceof Float32Array || position.array instanceof Float64Array)
    return position;
  // The clone of an interleaved attribute is not interleaved.
  const copy = position.clone() as Attribute;
  Object.assign(copy, { array: new Float32Array(copy.array.length), normalized: false });
  geometry.setAttribute("position", copy as never);
  return copy;
}

function write(attribute: Attribute, values: Float32Array, first: number): void {
  for (let v = 0; v < attribute.count; v++) {
    const k = 3 * (first + v);
    attribute.setXYZ(v, values[k] ?? 0, values[k + 1] ?? 0, values[k + 2] ?? 0);
  }
  attribute.needsUpdate = true;
}

function edgesOf({ corners }: Cage): Uint32Array {
  const edges: number[] = [];
  for (let k = 0; k < corners.length; ) {
    const n = corners[k] ?? 0;
    for (let i = 0; i < n; i++) {
      const [a = 0, b = 0] = [corners[k + 1 + i], corners[k + 1 + ((i + 1) % n)]];
      // Each edge belongs to two faces, in opposite directions.
      if (a < b) edges.push(a, b);
    }
    k += 1 + n;
  }
  return Uint32Array.from(edges);
}
