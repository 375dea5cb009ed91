/** Three models for one cage: a body, a shirt and a buckle, made by formula. */

import { Document, type Material, type Node, NodeIO } from "@gltf-transform/core";
import type { DroppedFile } from "./support";

/** Number of vertices of each model, summed over its primitives. */
export const SIZES = { body: 2 * 13 * 24, shirt: 15 * 24, buckle: 8 } as const;

const N_SECTORS = 24;
/** Largest radius of the body, which is 2 high and closed at both ends. Its lower half has another material. */
const RADIUS = 0.35;
const radiusAt = (y: number) => RADIUS * Math.sqrt(Math.max(0, Math.sin((Math.PI * y) / 2)));

/** Creates a surface of revolution about y, made of `rings` circles between the heights `from` and `to`. */
function sleeve(from: number, to: number, rings: number, radius: (y: number) => number) {
  const positions: number[] = [];
  const indices: number[] = [];
  for (let j = 0; j < rings; j++) {
    const y = from + ((to - from) * j) / (rings - 1);
    for (let i = 0; i < N_SECTORS; i++) {
      const angle = (2 * Math.PI * i) / N_SECTORS;
      positions.push(radius(y) * Math.cos(angle), y, radius(y) * Math.sin(angle));
      if (j === 0) continue;
      const [a, b] = [j * N_SECTORS + i, j * N_SECTORS + ((i + 1) % N_SECTORS)];
      indices.push(a - N_SECTORS, a, b - N_SECTORS, b - N_SECTORS, a, b);
    }
  }
  return { positions, indices };
}

export class Builder {
  readonly document = new Document();
  private readonly buffer = this.document.createBuffer();
  private readonly scene = this.document.createScene();

  floats(type: "SCALAR" | "VEC3" | "VEC4" | "MAT4", values: readonly number[]) {
    return this.document
      .createAccessor()
      .setType(type)
      .setArray(Float32Array.from(values))
      .setBuffer(this.buffer);
  }

  whole(type: "SCALAR" | "VEC4", values: readonly number[]) {
    return this.document
      .createAccessor()
      .setType(type)
      .setArray(Uint16Array.from(values))
      .setBuffer(this.buffer);
  }

  material(name: string, colour: [number, number, number]) {
    return this.document
      .createMaterial(name)
      .setBaseColorFactor([...colour, 1])
      .setRoughnessFactor(0.8)
      .setDoubleSided(true);
  }

  primitive({ positions, indices }: { positions: number[]; indices: number[] }, material: Material) {
    return this.document
      .createPrimitive()
      .setIndices(this.whole("SCALAR", indices))
      .setAttribute("POSITION", this.floats("VEC3", positions))
      .setMaterial(material);
  }

  add(node: Node) {
    this.scene.addChild(node);
    return node;
  }

  async file(name: string): Promise<DroppedFile> {
    return { name, bytes: await new NodeIO().writeBinary(this.document) };
  }
}

function body(): Promise<DroppedFile> {
  const all = new Builder();
  const mesh = all.document.createMesh("body");
  mesh.addPrimitive(all.primitive(sleeve(1, 2, 13, radiusAt), all.material("Skin", [0.8, 0.55, 0.4])));
  mesh.addPrimitive(all.primitive(sleeve(0, 1, 13, radiusAt), all.material("Trousers", [0.2, 0.25, 0.45])));
  all.add(all.document.createNode("body").setMesh(mesh));
  return all.file("body.glb");
}

/** Writes a sleeve around the upper body, skinned to two joints that a clip animates. */
function shirt(): Promise<DroppedFile> {
  const all = new Builder();
  const { document } = all;
  const cloth = sleeve(0.9, 1.7, 15, (y) => 1.12 * radiusAt(y));
  const chest = document.createNode("chest").setTranslation([0, 1, 0]);
  const hips = all.add(document.createNode("hips").addChild(chest));
  const bind = (y: number) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -y, 0, 1];
  const skin = document
    .createSkin()
    .addJoint(hips)
    .addJoint(chest)
    .setInverseBindMatrices(all.floats("MAT4", [...bind(0), ...bind(1)]));
  const heights = cloth.positions.filter((_, k) => k % 3 === 1);
  const shares = heights.map((y) => Math.min(Math.max(2 * (y - 0.9), 0), 1));
  const primitive = all
    .primitive(cloth, all.material("Cloth", [0.75, 0.75, 0.7]))
    .setAttribute(
      "JOINTS_0",
      all.whole(
        "VEC4",
        shares.flatMap(() => [0, 1, 0, 0]),
      ),
    )
    .setAttribute(
      "WEIGHTS_0",
      all.floats(
        "VEC4",
        shares.flatMap((share) => [1 - share, share, 0, 0]),
      ),
    );
  all.add(
    document.createNode("shirt").setMesh(document.createMesh("shirt").addPrimitive(primitive)).setSkin(skin),
  );
  const [sine, cosine] = [Math.sin(0.2), Math.cos(0.2)];
  const sampler = document
    .createAnimationSampler()
    .setInput(all.floats("SCALAR", [0, 0.5, 1]))
    .setOutput(all.floats("VEC4", [0, 0, 0, 1, sine, 0, 0, cosine, 0, 0, 0, 1]));
  const channel = document.createAnimationChannel().setTargetNode(chest).setTargetPath("rotation");
  document.createAnimation("nod").addSampler(sampler).addChannel(channel.setSampler(sampler));
  return all.file("shirt.glb");
}

/** Writes a box in front of the body. */
function buckle(): Promise<DroppedFile> {
  const all = new Builder();
  const positions = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((k) => [
    k & 1 ? 0.08 : -0.08,
    k & 2 ? 1 : 0.9,
    k & 4 ? 0.43 : 0.38,
  ]);
  const indices = [
    [0, 2, 3, 1],
    [4, 5, 7, 6],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 4, 6, 2],
    [1, 3, 7, 5],
  ].flatMap(([a = 0, b = 0, c = 0, d = 0]) => [a, b, c, a, c, d]);
  const primitive = all.primitive({ positions, indices }, all.material("Brass", [0.8, 0.65, 0.25]));
  const mesh = all.document.createMesh("buckle").addPrimitive(primitive);
  all.add(all.document.createNode("buckle").setMesh(mesh));
  return all.file("buckle.glb");
}

export const wardrobe = (): Promise<DroppedFile[]> => Promise.all([body(), shirt(), buckle()]);

/** Reads the positions of all vertices of a GLB: its meshes in order, and their primitives in order. */
export async function pointsOf({ bytes }: Pick<DroppedFile, "bytes">): Promise<number[]> {
  const root = (await new NodeIO().readBinary(bytes)).getRoot();
  const primitives = root.listMeshes().flatMap((mesh) => mesh.listPrimitives());
  return primitives.flatMap((primitive) => [...(primitive.getAttribute("POSITION")?.getArray() ?? [])]);
}

/** Computes the distances between all pairs of points. */
export function distances(points: readonly number[]): number[] {
  const all = Array.from({ length: points.length / 3 }, (_, k) => points.slice(3 * k, 3 * k + 3));
  return all.flatMap((a, k) =>
    all.slice(k + 1).map((b) => Math.hypot(...a.map((value, axis) => value - (b[axis] ?? 0)))),
  );
}
