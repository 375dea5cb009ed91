/** Code of a user of the package. The tests compile it against the published types. */

import { type Bound, bind, deform, generateCage, reshape } from "@cagework/core";
import type { CageDeformer } from "@cagework/core/element";

export async function follow(glb: ArrayBuffer, positions: number[], triangles: Uint16Array): Promise<number> {
  const cage = await generateCage({ positions, triangles }, { vertices: 60, quads: false });
  const { weights, report }: Bound = await bind(positions, cage, {
    grid: 32,
    signal: AbortSignal.timeout(1000),
  });
  const posed: Float32Array = await deform(weights, cage.positions);
  const file: Uint8Array<ArrayBuffer> = await reshape(glb, cage, posed, { joints: "turn" });
  // @ts-expect-error "bend" is not a value of `joints`.
  await reshape(glb, cage, posed, { joints: "bend" });
  return report.iterations + file.length;
}

export function poseOf(element: CageDeformer): Float32Array | null {
  return document.querySelector("cage-deformer")?.pose ?? element.pose;
}
