/** Model files made by formula. */

import { crc32, deflateSync } from "node:zlib";
import { Document, type Node, NodeIO } from "@gltf-transform/core";
import {
  EXTMeshoptCompression,
  KHRDracoMeshCompression,
  KHRMeshQuantization,
} from "@gltf-transform/extensions";
import { quantize, reorder } from "@gltf-transform/functions";
import draco3d from "draco3dgltf";
import validator from "gltf-validator";
import { MeshoptDecoder, MeshoptEncoder } from "meshoptimizer";

/** Writes a PNG of 8 x 8 pixels, alternately orange and teal. */
function png(): Uint8Array {
  const SIDE = 8;
  const rows = Array.from({ length: SIDE }, (_, j) => [
    0,
    ...Array.from({ length: SIDE }, (_, i) => ((i + j) % 2 === 0 ? [230, 120, 30] : [20, 130, 130])).flat(),
  ]);
  const chunk = (type: string, data: Uint8Array) => {
    const body = Buffer.concat([Buffer.from(type), data]);
    const frame = Buffer.alloc(8);
    frame.writeUInt32BE(data.length, 0);
    frame.writeUInt32BE(crc32(body), 4);
    return Buffer.concat([frame.subarray(0, 4), body, frame.subarray(4)]);
  };
  const header = Buffer.from([0, 0, 0, SIDE, 0, 0, 0, SIDE, 8, 2, 0, 0, 0]);
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  const pixels = deflateSync(Uint8Array.from(rows.flat()));
  const parts = [signature, chunk("IHDR", header), chunk("IDAT", pixels), chunk("IEND", new Uint8Array())];
  return new Uint8Array(Buffer.concat(parts));
}

/** Creates a bent tube along y, 2 high, of radius up to 0.4, with texture coordinates. */
function tube(rings = 40, around = 32): { positions: Float32Array; uvs: Float32Array; indices: Uint32Array } {
  const positions: number[] = [];
  const uvs: number[] = [];
  const indices: number[] = [];
  for (let j = 0; j <= rings; j++) {
    const v = j / rings;
    // The first and last rings have radius 0, which closes the ends.
    const radius = 0.4 * Math.sqrt(Math.max(0, Math.sin(Math.PI * v))) ** 0.5;
    for (let i = 0; i <= around; i++) {
      const angle = (2 * Math.PI * i) / around;
      positions.push(0.3 * Math.sin(3 * v) + radius * Math.cos(angle), 2 * v, radius * Math.sin(angle));
      uvs.push(i / around, 1 - v);
    }
  }
  const row = around + 1;
  for (let j = 0; j < rings; j++) {
    for (let i = 0; i < around; i++) {
      const a = j * row + i;
      indices.push(a, a + row, a + 1, a + 1, a + row, a + row + 1);
    }
  }
  return {
    positions: new Float32Array(positions),
    uvs: new Float32Array(uvs),
    indices: new Uint32Array(indices),
  };
}

function document(): { document: Document; node: Node } {
  const document = new Document();
  const buffer = document.createBuffer();
  const { positions, uvs, indices } = tube();
  const image = document.createTexture("colours").setImage(png()).setMimeType("image/png");
  const primitive = document
    .createPrimitive()
    .setAttribute("POSITION", document.createAccessor().setType("VEC3").setArray(positions).setBuffer(buffer))
    .setAttribute("TEXCOORD_0", document.createAccessor().setType("VEC2").setArray(uvs).setBuffer(buffer))
    .setIndices(document.createAccessor().setType("SCALAR").setArray(indices).setBuffer(buffer))
    .setMaterial(document.createMaterial("skin").setBaseColorTexture(image).setDoubleSided(true));
  const node = document.createNode("worm").setMesh(document.createMesh("worm").addPrimitive(primitive));
  document.createScene("garden").addChild(node);
  return { document, node };
}

/** Writes the textured tube as GLB. */
export async function glb(): Promise<Uint8Array> {
  return new NodeIO().writeBinary(document().document);
}

/** Writes the textured tube as .gltf, with files for its buffer and texture. */
export async function gltfFiles(): Promise<{ name: string; bytes: Uint8Array }[]> {
  const { json, resources } = await new NodeIO().writeJSON(document().document, { basename: "worm" });
  const files = Object.entries(resources).map(([name, bytes]) => ({ name, bytes }));
  return [{ name: "worm.gltf", bytes: new TextEncoder().encode(JSON.stringify(json)) }, ...files];
}

/** Writes a torus of about `vertices` vertices, radii 1 and 0.35, as GLB. */
export async function torus(vertices: number): Promise<Uint8Array> {
  const around = Math.round(Math.sqrt(vertices / 3));
  const rings = Math.round(vertices / around);
  const positions = new Float32Array(3 * rings * around);
  const indices = new Uint32Array(6 * rings * around);
  for (let k = 0; k < rings * around; k++) {
    const [ring, i] = [Math.floor(k / around), k % around];
    const [turn, angle] = [(2 * Math.PI * ring) / rings, (2 * Math.PI * i) / around];
    const radius = 1 + 0.35 * Math.cos(angle);
    positions.set([radius * Math.cos(turn), 0.35 * Math.sin(angle), radius * Math.sin(turn)], 3 * k);
    const beside = k - i + ((i + 1) % around);
    const [next, across] = [k, beside].map((v) => (v + around) % (rings * around)) as [number, number];
    indices.set([k, beside, next, beside, across, next], 6 * k);
  }
  const document = new Document();
  const buffer = document.createBuffer();
  const primitive = document
    .createPrimitive()
    .setAttribute("POSITION", document.createAccessor().setType("VEC3").setArray(positions).setBuffer(buffer))
    .setIndices(document.createAccessor().setType("SCALAR").setArray(indices).setBuffer(buffer));
  const node = document.createNode("torus").setMesh(document.createMesh("torus").addPrimitive(primitive));
  document.createScene().addChild(node);
  return new NodeIO().writeBinary(document);
}

export async function dracoGlb(): Promise<Uint8Array> {
  const { document: made } = document();
  made.createExtension(KHRDracoMeshCompression).setRequired(true);
  const io = new NodeIO()
    .registerExtensions([KHRDracoMeshCompression])
    .registerDependencies({ "draco3d.encoder": await draco3d.createEncoderModule() });
  return io.writeBinary(made);
}

export async function meshoptGlb(): Promise<Uint8Array> {
  await Promise.all([MeshoptEncoder.ready, MeshoptDecoder.ready]);
  const { document: made } = document();
  await made.transform(reorder({ encoder: MeshoptEncoder }), quantize());
  made
    .createExtension(EXTMeshoptCompression)
    .setRequired(true)
    .setEncoderOptions({ method: EXTMeshoptCompression.EncoderMethod.FILTER });
  const io = new NodeIO()
    .registerExtensions([EXTMeshoptCompression, KHRMeshQuantization])
    .registerDependencies({ "meshopt.encoder": MeshoptEncoder });
  return io.writeBinary(made);
}

/** Writes a tetrahedron as OBJ. If `open`, it lacks a face. */
export function obj(scale: number, open = false): Uint8Array {
  const corners = [
    [1, 1, 1],
    [-1, -1, 1],
    [-1, 1, -1],
    [1, -1, -1],
  ];
  const faces = ["f 1 2 4", "f 1 3 2", "f 1 4 3", "f 2 3 4"].slice(open ? 1 : 0);
  const lines = corners.map((p) => `v ${p.map((x) => x * scale).join(" ")}`);
  return new TextEncoder().encode([...lines, ...faces, ""].join("\n"));
}

/** Vertex positions, and faces as vertex indices from 0. */
export interface Mesh {
  readonly positions: readonly (readonly number[])[];
  readonly faces: readonly (readonly number[])[];
}

/**
 * Creates a box around the origin, given half its side lengths. Its six quads are counter-clockwise seen from outside.
 */
export function boxFaces(half: number | readonly [number, number, number]): Mesh {
  const sides = typeof half === "number" ? [half, half, half] : half;
  const signs = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [k & 1, k & 2, k & 4].map((bit) => (bit ? 1 : -1)));
  return {
    positions: signs.map((sign) => sign.map((s, axis) => s * (sides[axis] ?? 1))),
    faces: [
      [0, 2, 3, 1],
      [4, 5, 7, 6],
      [0, 1, 5, 4],
      [2, 6, 7, 3],
      [0, 4, 6, 2],
      [1, 3, 7, 5],
    ],
  };
}

/** Writes a mesh as OBJ. */
export function objOf({ positions, faces }: Mesh): Uint8Array {
  const lines = [
    ...positions.map((p) => `v ${p.join(" ")}`),
    ...faces.map((face) => `f ${face.map((i) => i + 1).join(" ")}`),
  ];
  return new TextEncoder().encode(`${lines.join("\n")}\n`);
}

/** Writes a tetrahedron as FBX text, in centimetres with y up. Its corners are at 1 m or -1 m of each axis. */
export function fbx(): Uint8Array {
  const corners = [
    [1, 1, 1],
    [-1, -1, 1],
    [-1, 1, -1],
    [1, -1, -1],
  ].flatMap((corner) => corner.map((x) => 100 * x));
  const indices = [0, 1, -4, 0, 2, -2, 0, 3, -3, 1, 2, -4];
  return new TextEncoder().encode(`; FBX 7.4.0 project file
FBXHeaderExtension: {
  FBXVersion: 7400
}
GlobalSettings: {
  Properties70: {
    P: "UnitScaleFactor", "double", "Number", "", 1.0
  }
}
Objects: {
  Geometry: 1, "Geometry::tetra", "Mesh" {
    Vertices: *${corners.length} {
      a: ${corners.join(",")}
    }
    PolygonVertexIndex: *${indices.length} {
      a: ${indices.join(",")}
    }
  }
  Model: 2, "Model::tetra", "Mesh" {
  }
}
Connections: {
  C: "OO", 2, 0
  C: "OO", 1, 2
}
`);
}

/** Writes a box as OBJ. */
export function box(half: number | readonly [number, number, number]): Uint8Array {
  return objOf(boxFaces(half));
}

/** Returns the errors that the Khronos glTF validator finds in a GLB. */
export async function validationErrors(bytes: Uint8Array): Promise<string[]> {
  const report = await validator.validateBytes(new Uint8Array(bytes));
  const ERROR = 0;
  return report.issues.messages
    .filter(({ severity }) => severity === ERROR)
    .map(({ code, pointer, message }) => `${code} at ${pointer}: ${message}`);
}

/**
 * Writes a GLB of a body and a hat skinned to two joints, and a rigid buckle. The body has two morph targets with
 * default weights 0 and 1. A clip animates both joints and the morph targets.
 */
export async function dancer(): Promise<Uint8Array> {
  const document = new Document();
  const buffer = document.createBuffer();
  const array = (type: "SCALAR" | "VEC3" | "VEC4" | "MAT4", values: Float32Array | Uint16Array) =>
    document.createAccessor().setType(type).setArray(values).setBuffer(buffer);
  const floats = (type: "SCALAR" | "VEC3" | "VEC4" | "MAT4", values: readonly number[]) =>
    array(type, Float32Array.from(values));
  const bone = document.createNode("chest").setTranslation([0, 1, 0]);
  const hips = document.createNode("hips").addChild(bone);
  const bind = (y: number) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -y, 0, 1];
  const skin = document
    .createSkin()
    .addJoint(hips)
    .addJoint(bone)
    .setInverseBindMatrices(floats("MAT4", [...bind(0), ...bind(1)]));
  const scene = document.createScene().addChild(hips);
  const SIDES = 16;
  const RINGS = 13;

  /**
   * A closed, skinned tube. Each function in `keys` is a morph target: it returns the radial displacement at a relative
   * height, 0 to 1.
   */
  const tube = (
    name: string,
    [from, to]: [number, number],
    radius: number,
    keys: ((t: number) => number)[],
  ) => {
    const rings = Array.from({ length: RINGS * SIDES }, (_, k) => {
      const [ring, angle] = [Math.floor(k / SIDES), (2 * Math.PI * (k % SIDES)) / SIDES];
      return { t: ring / (RINGS - 1), x: Math.cos(angle), z: Math.sin(angle) };
    });
    const ends = [0, 1].map((t) => ({ t, x: 0, z: 0 }));
    const places = [...rings, ...ends];
    const height = (t: number) => from + (to - from) * t;
    const positions = places.flatMap(({ t, x, z }) => [radius * x, height(t), radius * z]);
    const corners: number[] = [];
    for (let i = 0; i < SIDES; i++) {
      const j = (i + 1) % SIDES;
      const top = (RINGS - 1) * SIDES;
      corners.push(RINGS * SIDES, i, j, RINGS * SIDES + 1, top + j, top + i);
      for (let ring = 0; ring < top; ring += SIDES)
        corners.push(ring + i, ring + SIDES + i, ring + j, ring + j, ring + SIDES + i, ring + SIDES + j);
    }
    const share = (t: number) => Math.min(Math.max(height(t) - 0.5, 0), 1);
    const primitive = document
      .createPrimitive()
      .setIndices(array("SCALAR", Uint16Array.from(corners)))
      .setAttribute("POSITION", floats("VEC3", positions))
      .setAttribute("JOINTS_0", array("VEC4", Uint16Array.from(places.flatMap(() => [0, 1, 0, 0]))))
      .setAttribute(
        "WEIGHTS_0",
        floats(
          "VEC4",
          places.flatMap(({ t }) => [1 - share(t), share(t), 0, 0]),
        ),
      );
    for (const key of keys) {
      const deltas = places.flatMap(({ t, x, z }) => [key(t) * x, 0, key(t) * z]);
      primitive.addTarget(document.createPrimitiveTarget().setAttribute("POSITION", floats("VEC3", deltas)));
    }
    const mesh = document.createMesh(name).addPrimitive(primitive);
    if (keys.length > 0) mesh.setWeights([0, 1]).setExtras({ targetNames: ["belly", "chest"] });
    const node = document.createNode(name).setMesh(mesh).setSkin(skin);
    scene.addChild(node);
    return node;
  };
  const bump = (middle: number) => (t: number) => 0.1 * Math.max(0, 1 - ((t - middle) / 0.3) ** 2);
  const body = tube("body", [0, 1.8], 0.3, [bump(0.3), bump(0.7)]);
  tube("hat", [1.85, 2.1], 0.4, []);

  const corners = Array.from({ length: 8 }, (_, k) => [k & 1, (k >> 1) & 1, k >> 2].map((b) => 0.1 * b));
  const sides = [
    0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7,
    5,
  ];
  const box = document
    .createPrimitive()
    .setIndices(array("SCALAR", Uint16Array.from(sides)))
    .setAttribute("POSITION", floats("VEC3", corners.flat()));
  const buckle = document.createMesh("buckle").addPrimitive(box);
  bone.addChild(document.createNode("buckle").setMesh(buckle).setTranslation([-0.05, 0, 0.25]));

  const times = floats("SCALAR", [0, 0.5, 1]);
  const dance = document.createAnimation("dance");
  const move = (node: Node, path: "translation" | "rotation" | "weights", values: number[]) => {
    const type = path === "weights" ? "SCALAR" : path === "rotation" ? "VEC4" : "VEC3";
    const sampler = document.createAnimationSampler().setInput(times).setOutput(floats(type, values));
    const channel = document.createAnimationChannel().setTargetNode(node).setTargetPath(path);
    dance.addSampler(sampler).addChannel(channel.setSampler(sampler));
  };
  const [sine, cosine] = [Math.sin(0.3), Math.cos(0.3)];
  move(bone, "rotation", [0, 0, 0, 1, 0, 0, sine, cosine, 0, 0, 0, 1]);
  move(hips, "translation", [0, 0, 0, 0.2, 0.1, 0, 0, 0, 0]);
  move(body, "weights", [0, 1, 1, 0, 0, 1]);
  return new NodeIO().writeBinary(document);
}

/** Reads the positions of the first primitive of the mesh `name` in a GLB. */
export async function positionsOf(bytes: Uint8Array, name: string): Promise<number[]> {
  const root = (await new NodeIO().readBinary(bytes)).getRoot();
  const mesh = root.listMeshes().find((mesh) => mesh.getName() === name);
  return [...(mesh?.listPrimitives()[0]?.getAttribute("POSITION")?.getArray() ?? [])];
}

/** Reads the vertex positions of a GLB's first primitive at the keyframe `seconds` of its morph target animation. */
export async function shownAt(bytes: Uint8Array, seconds: number): Promise<number[]> {
  const root = (await new NodeIO().readBinary(bytes)).getRoot();
  const [primitive] = root.listMeshes().flatMap((mesh) => mesh.listPrimitives());
  const [sampler] = root.listAnimations().flatMap((animation) => animation.listSamplers());
  const times = [...(sampler?.getInput()?.getArray() ?? [])];
  const key = times.findIndex((time) => Math.abs(time - seconds) < 1e-4);
  const targets = primitive?.listTargets() ?? [];
  const weights = sampler?.getOutput()?.getArray() ?? [];
  const positions = [...(primitive?.getAttribute("POSITION")?.getArray() ?? [])];
  for (const [k, target] of targets.entries()) {
    const weight = weights[key * targets.length + k] ?? Number.NaN;
    if (weight === 0) continue;
    const deltas = target.getAttribute("POSITION")?.getArray() ?? [];
    for (const [i, delta] of deltas.entries()) positions[i] = (positions[i] ?? 0) + weight * delta;
  }
  return positions;
}

/**
 * Writes a `.splat` file: splats on a vase, 2 high, with stripes. `floaters`: number of larger splats on its right, 1.2
 * from its axis.
 */
export function splats(n = 1000, floaters = 0): Uint8Array {
  const bytes = Buffer.alloc(32 * (n + floaters));
  for (let k = 0; k < n; k++) {
    const y = (2 * (k + 0.5)) / n;
    const angle = 2.399963 * k;
    const radius = 0.4 + 0.15 * Math.sin(4 * y);
    const at = [radius * Math.cos(angle), y, radius * Math.sin(angle)];
    for (const [axis, value] of [...at, 0.05, 0.05, 0.05].entries())
      bytes.writeFloatLE(value, 32 * k + 4 * axis);
    const color = Math.floor(5 * y) % 2 === 0 ? [220, 90, 40, 250] : [40, 120, 200, 250];
    bytes.set(color, 32 * k + 24);
    bytes.set([255, 128, 128, 128], 32 * k + 28);
  }
  for (let k = n; k < n + floaters; k++) {
    for (const [axis, value] of [1.2, (2 * (k - n + 0.5)) / floaters, 0, 0.15, 0.15, 0.15].entries())
      bytes.writeFloatLE(value, 32 * k + 4 * axis);
    bytes.set([60, 200, 80, 250, 255, 128, 128, 128], 32 * k + 24);
  }
  return new Uint8Array(bytes);
}
