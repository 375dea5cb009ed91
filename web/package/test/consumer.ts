/** Code of a user of the package. The tests compile it against the published types. */

import { type BindResult, bind, deform, generateCage, reshape } from "@cagework/core";
import type { CageDeformerElement } from "@cagework/core/element";
import { CageDeformer, type Geometry } from "@cagework/core/three";
import type { BufferGeometry } from "three";

export async function follow(glb: ArrayBuffer, positions: number[], triangles: Uint16Array): Promise<number> {
  const cage = await generateCage({ positions, triangles }, { target: 60, quads: false });
  const { weights, report }: BindResult = await bind(positions, cage, {
    grid: 32,
    signal: AbortSignal.timeout(1000),
  });
  const posed: Float32Array = await deform(weights, cage.positions);
  const file: Uint8Array<ArrayBuffer> = await reshape(glb, cage, posed, { joints: "turn" });
  // @ts-expect-error "bend" is not a value of `joints`.
  await reshape(glb, cage, posed, { joints: "bend" });
  return report.iterations + file.length;
}

export function poseOf(element: CageDeformerElement): Float32Array | null {
  return document.querySelector("cage-deformer")?.pose ?? element.pose;
}

export async function turn(geometry: BufferGeometry): Promise<void> {
  const follower = await CageDeformer.create(geometry, { grid: 16 });
  geometry.setIndex(Array.from(follower.edges));
}

export async function widen(geometries: Geometry[], signal: AbortSignal): Promise<number> {
  const follower = await CageDeformer.create(geometries, { grid: 32, signal, cageOptions: { target: 60 } });
  follower.pose.set(follower.pose.map((x, k) => (k % 3 === 0 ? 2 * x : x)));
  await follower.update();
  // @ts-expect-error A cage is not an option of `bind`.
  await CageDeformer.create(geometries, { target: 60 });
  return follower.edges.length + follower.report.iterations;
}
