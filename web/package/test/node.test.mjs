// Compares results of the installed package in Node with those of the `cagework` command. Runs in the empty project in
// which the package is installed.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { availableParallelism, tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { inflateRawSync } from "node:zlib";
import { bind, deform, field, generateCage, proportions, readModel, reshape } from "@cagework/core";
import { CageDeformer } from "@cagework/core/three";
import {
  Bone,
  BufferAttribute,
  BufferGeometry,
  CylinderGeometry,
  Group,
  InterleavedBuffer,
  InterleavedBufferAttribute,
  Matrix4,
  Skeleton,
  SkinnedMesh,
  SphereGeometry,
  Vector3,
} from "three";
import { sample } from "./sample.mjs";

/** Tolerance for the rounding of 32-bit sums, as a fraction of the model's size. */
const ROUNDING = 1e-6;
/** Allowed difference between weights of wasm and of native code, which round sums differently. */
const WEIGHTS = 1e-6;

const { glb, cage, posed } = await sample(import.meta.dirname, "humanoid");
const mesh = await readModel(glb);
const size = Math.max(...cage.positions) - Math.min(...cage.positions);
const folder = mkdtempSync(join(tmpdir(), "cagework-npm-"));
after(() => rmSync(folder, { recursive: true }));

function command(line) {
  execFileSync(process.env.CAGEWORK_COMMAND, line.split(" "), {
    cwd: folder,
    stdio: ["ignore", "ignore", "inherit"],
  });
}

/** Writes a cage as OBJ, with all digits of each number. */
function obj(positions, corners) {
  const lines = [];
  for (let k = 0; k < positions.length; k += 3) lines.push(`v ${positions.slice(k, k + 3).join(" ")}`);
  for (let k = 0; k < corners.length; k += 1 + corners[k]) {
    lines.push(`f ${Array.from(corners.slice(k + 1, k + 1 + corners[k]), (i) => i + 1).join(" ")}`);
  }
  return `${lines.join("\n")}\n`;
}

/** Reads an array of an NPZ file, which is a ZIP archive of NPY files. */
function npz(path, name) {
  const zip = readFileSync(path);
  const view = new DataView(zip.buffer, zip.byteOffset, zip.byteLength);
  let at = view.getUint32(zip.length - 6, true);
  while (view.getUint32(at, true) === 0x02014b50) {
    const [method, packed, nameLength] = [
      view.getUint16(at + 10, true),
      view.getUint32(at + 20, true),
      view.getUint16(at + 28, true),
    ];
    const skip = view.getUint16(at + 30, true) + view.getUint16(at + 32, true);
    const local = view.getUint32(at + 42, true);
    if (zip.subarray(at + 46, at + 46 + nameLength).toString() === `${name}.npy`) {
      const start = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
      const data = zip.subarray(start, start + packed);
      const npy = method === 0 ? data : inflateRawSync(data);
      const body = npy.subarray(10 + npy.readUInt16LE(8));
      const kind = npy
        .subarray(10, 10 + npy.readUInt16LE(8))
        .toString()
        .includes("<f4")
        ? Float32Array
        : Int32Array;
      return new kind(body.buffer.slice(body.byteOffset, body.byteOffset + body.length));
    }
    at += 46 + nameLength + skip;
  }
  assert.fail(`${path} has no ${name}`);
}

writeFileSync(join(folder, "model.glb"), glb);
writeFileSync(join(folder, "cage.obj"), obj(cage.positions, cage.corners));
writeFileSync(join(folder, "pose.obj"), obj(posed, cage.corners));
command("bind model.glb --cage cage.obj -g 24 --weights all.npz");
command("bind model.glb --cage cage.obj -g 24 --static --weights static.npz");

test("weights match the command's and each row sums to 1", async () => {
  const stages = [];
  const { weights, report } = await bind(mesh.positions, cage, {
    grid: 24,
    onProgress: ({ stage }) => stages.push(stage),
  });
  const theirs = ["indptr", "indices", "data"].map((name) => npz(join(folder, "static.npz"), name));
  assert.deepEqual([...weights.indptr], [...theirs[0]]);
  assert.deepEqual([...weights.indices], [...theirs[1]]);
  const worst = weights.data.reduce((most, w, k) => Math.max(most, Math.abs(w - theirs[2][k])), 0);
  assert.ok(worst < WEIGHTS, `${worst}`);
  for (let v = 0; v < mesh.positions.length / 3; v++) {
    const sum = weights.data.slice(weights.indptr[v], weights.indptr[v + 1]).reduce((a, b) => a + b, 0);
    assert.ok(Math.abs(sum - 1) < 1e-5, `row ${v} sums to ${sum}`);
  }
  assert.equal(report.vertices, mesh.positions.length / 3);
  assert.deepEqual([...new Set(stages)], ["voxelize", "solve", "sample"]);
});

test("an affine pose of a generated cage moves the model by the same map", async () => {
  const made = await generateCage(mesh, { target: 60 });
  assert.ok(made.positions.length <= 180 && made.problems.every(({ severity }) => severity !== "error"));
  const { weights } = await bind(mesh.positions, made, { grid: 24 });
  const affine = (p) => p.map((x, k) => (k % 3 === 1 ? 2 * x + 0.5 * p[k - 1] - 1 : x));
  const followed = await deform(weights, affine(Float64Array.from(made.positions)));
  const wanted = affine(Float64Array.from(mesh.positions));
  const worst = followed.reduce((most, x, k) => Math.max(most, Math.abs(x - wanted[k])), 0);
  assert.ok(worst < 4 * ROUNDING * size, `${worst}`);
});

test("a field maps points, maps them back, and its texture holds the same displacements", async () => {
  const made = await generateCage(mesh, { target: 60 });
  const affine = (p) => p.map((x, k) => (k % 3 === 1 ? 1.5 * x + 0.25 * p[k - 1] - 1 : x));
  const bent = await field(made, made.positions, { cells: 24 });
  const points = Float32Array.from(mesh.positions.slice(0, 300));
  const close = (a, b) =>
    assert.ok(
      a.every((x, k) => Math.abs(x - b[k]) < 1e-4 * size),
      "positions differ",
    );
  close(bent.map(points), points);
  bent.pose(affine(Float64Array.from(made.positions)));
  close(bent.map(points), affine(Float64Array.from(points)));
  close(bent.inverse(bent.map(points)), points);
  assert.ok(Math.abs(bent.gradient(points)[4] - 1.5) < 1e-2);
  // Interpolate the texture trilinearly, as a sampler of a shader does.
  const { data, size: n, origin, spacing } = bent.texture();
  const at = [...points.slice(0, 3)].map((x, k) => (x - origin[k]) / spacing);
  const by = [0, 0, 0];
  for (let corner = 0; corner < 8; corner++) {
    const node = at.map((x, k) => Math.floor(x) + ((corner >> k) & 1));
    const share = at.reduce((all, x, k) => all * (1 - Math.abs(x - node[k])), 1);
    for (let k = 0; k < 3; k++) by[k] += share * data[4 * (node[0] + n[0] * (node[1] + n[1] * node[2])) + k];
  }
  close(
    by.map((x, k) => points[k] + x),
    bent.map(points.slice(0, 3)),
  );
  await assert.rejects(
    field(made, made.positions, { cells: 7 }),
    /cells is 7; it must be a whole number from 8 to 256/,
  );
  assert.throws(() => bent.pose([1, 2, 3]), /posed has 3 numbers/);
});

for (const [options, line] of [
  [{}, ""],
  [{ joints: "turn", keep_travel: true }, " --joints turn --keep-travel"],
  [{ ground: true, feet: "lock" }, " --ground --feet lock"],
  [{ plain: true }, " --static"],
]) {
  test(`a reshaped rigged file equals the command's, byte for byte${line}`, async () => {
    const weights = options.plain ? "static" : "all";
    command(`deform model.glb --cage cage.obj --weights ${weights}.npz --pose pose.obj${line} -o out.glb`);
    const out = await reshape(glb, cage, posed, { grid: 24, ...options });
    assert.ok(Buffer.from(out).equals(readFileSync(join(folder, "out.glb"))));
  });
}

test("proportions pose the cage as the command does", async () => {
  command("proportions model.glb --cage cage.obj --preset chibi --leg 1.2 -g 24 --pose-out tall.obj");
  const pose = await proportions(glb, cage, { leg: 1.2 }, { preset: "chibi", grid: 24 });
  const lines = readFileSync(join(folder, "tall.obj"), "utf8").split("\n");
  const at = lines
    .filter((line) => line.startsWith("v "))
    .flatMap((line) => line.split(" ").slice(1, 4).map(Number));
  const farthest = Math.max(...at.map((x, k) => Math.abs(x - pose[k])));
  assert.ok(at.length === pose.length && farthest < 1e-4 * size, `${farthest}`);
  await assert.rejects(proportions(glb, cage, { tail: 1 }, { grid: 24 }), /no proportion "tail"/);
});

test("the example of the README runs", async () => {
  const [, code] = /```js\n([\s\S]*?)```/.exec(
    readFileSync(join(import.meta.dirname, "node_modules/@cagework/core/README.md"), "utf8"),
  );
  const [imports, ...rest] = code.split("\n");
  const file = join(import.meta.dirname, "readme.mjs");
  const glb_ = `import { readFileSync } from "node:fs";\nconst glb = readFileSync(${JSON.stringify(join(folder, "model.glb"))});`;
  writeFileSync(file, [imports, glb_, ...rest, "export { cage, wide };"].join("\n"));
  const { cage: made, wide } = await import(file);
  const width = (positions) => positions.reduce((most, x, k) => (k % 3 === 0 ? Math.max(most, x) : most), 0);
  assert.ok(made.positions.length <= 240);
  assert.ok(Math.abs(width((await readModel(wide)).positions) / width(mesh.positions) - 1.3) < 1e-5);
});

test("reshaping with the rest pose returns the same file, byte for byte", async () => {
  assert.ok(
    Buffer.from(await reshape(new Blob([glb]), cage, cage.positions, { grid: 12 })).equals(Buffer.from(glb)),
  );
});

test("splats and points are reshaped without faces", async () => {
  // Splats on a helix in a box that makes a quarter turn about z.
  const at = Array.from({ length: 90 }, (_, k) => [Math.cos(k / 9) / 2, k / 100 - 0.45, Math.sin(k / 9) / 2]);
  const capture = Buffer.alloc(32 * at.length);
  for (const [k, point] of at.entries()) {
    for (const [j, x] of [...point, 0.03, 0.02, 0.01].entries()) capture.writeFloatLE(x, 32 * k + 4 * j);
    capture.set([200, 100, 50, 255, 255, 128, 128, 128], 32 * k + 24);
  }
  const corners = [0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6];
  const box = {
    positions: Array.from({ length: 24 }, (_, k) => (((k / 3) >> (k % 3)) % 2 === 0 ? -1 : 1)),
    corners: corners.flatMap((i, k) => (k % 4 === 0 ? [4, i] : [i])),
  };
  const turn = (points) => points.map((_, k) => [-points[k + 1], points[k - 1], points[k]][k % 3]);
  const posed = turn(box.positions);
  const turned = Buffer.from(await reshape(capture, box, posed, { name: "a.splat" }));
  const close = (a, b) => assert.ok(Math.abs(a - b) < 1e-5, `${a} instead of ${b}`);
  for (const [k, point] of at.entries()) {
    for (const [j, x] of turn(point).entries()) close(turned.readFloatLE(32 * k + 4 * j), x);
    // sqrt(1/2), 0, 0, sqrt(1/2), times 128 plus 128
    assert.deepEqual([...turned.subarray(32 * k + 28, 32 * k + 32)], [219, 128, 128, 219]);
  }
  assert.ok(Buffer.from(await reshape(capture, box, box.positions, { name: "a.splat" })).equals(capture));
  const header = `ply\nformat ascii 1.0\nelement vertex ${at.length}\n`;
  const cloud = `${header}property float x\nproperty float y\nproperty float z\nend_header\n`;
  const lines = at.map((point) => `${point.join(" ")}\n`).join("");
  const moved = await reshape(new Blob([cloud + lines]), box, posed, { name: "cloud.ply" });
  const [, body] = Buffer.from(moved).toString().split("end_header\n");
  const points = body.trim().split(/\s+/).map(Number);
  for (const [k, x] of turn(at.flat()).entries()) close(points[k], x);
});

test("a model far from the origin deforms like one near it", async () => {
  const [x, z] = [500000.25, 4500000.5];
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [x + (k & 1), (k >> 1) & 1, z + (k >> 2) / 8]);
  const text = ({ place }) =>
    `${corners.map((p) => `v ${place(p).join(" ")}`).join("\n")}\nf 1 2 4 3\nf 5 6 8 7\n`;
  const file = new TextEncoder().encode(text({ place: (p) => p }));
  const far = await readModel(file, { name: "far.obj" });
  assert.ok(far.origin[0] > 5e5 && far.origin[1] === 0 && far.origin[2] > 4e6);
  const around = await generateCage(far);
  const up = around.positions.map((x, k) => (k % 3 === 1 ? x + 0.5 : x));
  const raised = await reshape(file, around, up, { name: "far.obj", grid: 12 });
  const numbers = (bytes) =>
    new TextDecoder().decode(bytes).split(/[\s]+/).map(Number).filter(Number.isFinite);
  const wanted = numbers(new TextEncoder().encode(text({ place: ([x, y, z]) => [x, y + 0.5, z] })));
  const off = numbers(raised).map((found, k) => Math.abs(found - wanted[k]));
  assert.ok(off.length === wanted.length && Math.max(...off) < 1e-6, `${Math.max(...off)}`);
  assert.ok(
    Buffer.from(await reshape(file, around, around.positions, { name: "far.obj", grid: 12 })).equals(
      Buffer.from(file),
    ),
  );
});

test("states include the vertices of morph targets and of a clip's frames", async () => {
  const states = await readModel(glb, { states: true });
  assert.deepEqual([...states.positions.subarray(0, mesh.positions.length)], [...mesh.positions]);
  assert.deepEqual(states.triangles, mesh.triangles);
  const [clip] = JSON.parse(
    execFileSync(process.env.CAGEWORK_COMMAND, ["info", join(folder, "model.glb"), "--json"]),
  ).clips;
  const moving = await readModel(glb, { states: true, clip: clip.name });
  assert.ok(moving.positions.length > states.positions.length + mesh.positions.length);
});

test("compressed files are read", async () => {
  for (const name of ["draco.glb", "meshopt.glb"]) {
    const { positions, triangles } = await readModel(readFileSync(join(import.meta.dirname, name)));
    assert.ok(positions.length > 0 && triangles.every((v) => v < positions.length / 3), name);
  }
});

test("an aborted bind rejects at once and others finish", async () => {
  const giveUp = new AbortController();
  // The whole bind would take minutes.
  const long = bind(mesh.positions, cage, {
    grid: 256,
    signal: giveUp.signal,
    onProgress: () => giveUp.abort(),
  });
  const short = bind(mesh.positions, cage, { grid: 12 });
  await assert.rejects(long, { name: "AbortError" });
  assert.ok((await short).report.converged);
  await assert.rejects(bind(mesh.positions, cage, { signal: AbortSignal.abort() }), { name: "AbortError" });
});

test("a queued job aborts at once, and an error in onProgress ends only its own job", async () => {
  const wait = AbortSignal.timeout(20);
  const others = Array.from({ length: availableParallelism() }, () =>
    bind(mesh.positions, cage, { grid: 128 }),
  );
  let isDone = false;
  const all = Promise.all(others).then(() => {
    isDone = true;
  });
  await assert.rejects(bind(mesh.positions, cage, { grid: 12, signal: wait }), { name: "TimeoutError" });
  assert.ok(!isDone);
  const onProgress = () => {
    throw new RangeError("mine");
  };
  await assert.rejects(bind(mesh.positions, cage, { grid: 12, onProgress }), {
    name: "RangeError",
    message: "mine",
  });
  await all;
});

test("input that cannot be cloned is an error, and the next call works", async () => {
  const positions = mesh.positions.slice();
  structuredClone(positions.buffer, { transfer: [positions.buffer] });
  const controls = { smooth: 0, inner: 0, elements: [() => 0], radius: null };
  await assert.rejects(bind(mesh.positions, { ...cage, controls }, { grid: 12 }), { name: "DataCloneError" });
  await assert.rejects(bind(positions, cage, { grid: 12 }));
  assert.ok((await bind(mesh.positions, cage, { grid: 12 })).report.converged);
});

test("errors name the argument, its value and the expected one", async () => {
  const { weights } = await bind(mesh.positions, cage, { grid: 12 });
  const n = cage.positions.length;
  const wrong = [
    [() => bind([1, 2], cage), /^points has 2 numbers; three for each point are needed, so 0 or 3$/],
    [() => bind(mesh.positions, { ...cage, corners: [3, 0, 1] }), /^the last face of the cage is cut off$/],
    [() => bind(mesh.positions, cage, { gird: 32 }), /^unknown option gird; the options are .*grid/],
    [
      () => bind(mesh.positions, cage, { grid: 4 }),
      /^grid is 4; it must be auto \(0\) or a whole number from 8 to 512$/,
    ],
    [() => bind(mesh.positions, cage, { grid: "32" }), /^grid is a string; it must be a number$/],
    [() => bind(mesh.positions, cage, { backend: "gpu" }), /^WebGPU is missing here/, "NoAdapter"],
    [() => deform(weights, [1, 2, 3]), new RegExp(`^posed has 3 numbers; it must have ${n},`)],
    [() => deform(weights, new Array(n).fill(1e308)), /^the pose moves point 0 to .* end at 3.4/],
    [() => reshape(glb, cage, [1, 2, 3]), new RegExp(`^posed has 3 numbers; the cage has ${n}$`)],
    [() => reshape("fox.glb", cage, posed), /^model must be the bytes of a file/],
    [() => generateCage({ positions: [0, 0, 0], triangles: [0, 1] }), /^triangles has 2 numbers/],
    [
      () => generateCage({ positions: [0, 0, 0], triangles: [[0, 1, 2], 0, 0] }),
      /^triangles has 0,1,2 at 0; /,
    ],
    [
      () =>
        reshape(
          glb,
          cage,
          posed.map(() => Number.NaN),
        ),
      /^posed has NaN at 0; /,
    ],
    [() => readModel(new Uint8Array(5)), /not a GLB/, "Format"],
    [() => readModel(glb, { states: true, clip: "no clip" }), /no clip/],
  ];
  for (const [call, message, name = "Error"] of wrong) await assert.rejects(call, { name, message });
});

const QUARTER = new Matrix4().makeRotationZ(Math.PI / 2);

/** Finds the largest distance between vectors of the same index in two attributes of three.js. */
function apart(a, b) {
  let most = 0;
  for (let v = 0; v < a.count; v++) {
    most = Math.max(most, Math.hypot(a.getX(v) - b.getX(v), a.getY(v) - b.getY(v), a.getZ(v) - b.getZ(v)));
  }
  return most;
}

test("geometries of three.js follow one cage, with smooth normals across seams", async () => {
  const [body, shirt] = [new SphereGeometry(1, 24, 16), new SphereGeometry(0.8, 12, 8).toNonIndexed()];
  const interleaved = new InterleavedBuffer(new Float32Array(4 * shirt.attributes.position.count), 4);
  const position = new InterleavedBufferAttribute(interleaved, 3, 1);
  const { array } = shirt.attributes.position;
  for (let v = 0; v < position.count; v++) position.setXYZ(v, ...array.subarray(3 * v, 3 * v + 3));
  shirt.setAttribute("position", position);
  const [bodyBefore, shirtBefore] = [body.clone(), shirt.attributes.position.clone()];
  const deformer = await CageDeformer.create([body, shirt], { grid: 24, cageOptions: { target: 40 } });
  assert.equal(
    deformer.edges.length / 2,
    deformer.cage.positions.length / 3 + facesOf(deformer.cage) - 2,
    "Euler's formula",
  );
  // A quarter turn about z: x becomes y, and y becomes -x.
  deformer.pose.set(
    deformer.pose.map((_, k, p) => (k % 3 === 0 ? -p[k + 1] : k % 3 === 1 ? p[k - 1] : p[k])),
  );
  await Promise.all([deformer.update(), deformer.update()]);
  assert.ok(
    apart(body.attributes.position, bodyBefore.attributes.position.clone().applyMatrix4(QUARTER)) < 1e-5,
  );
  assert.ok(apart(shirt.attributes.position, shirtBefore.applyMatrix4(QUARTER)) < 1e-5);
  // The deformer computes normals from the mesh's facets. They differ from the exact normals of the sphere, but no more
  // at the texture seam than elsewhere.
  const turned = bodyBefore.attributes.normal.clone().applyMatrix4(QUARTER);
  assert.ok(apart(body.attributes.normal, turned) < 0.05, `${apart(body.attributes.normal, turned)}`);
  assert.ok(Math.abs(body.boundingSphere.radius - 1) < 1e-4);
  const empty = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(0), 3));
  await assert.rejects(CageDeformer.create(empty), { name: "Missing" });
});

for (const [type, isNormalized, centre, scale] of [
  [Int16Array, true, 0, 1],
  [Uint16Array, false, 0.95, 1000],
]) {
  for (const isInterleaved of [false, true]) {
    const layout = isInterleaved ? "interleaved " : "";
    test(`${layout}positions in ${type.name}s follow a cage beyond their range`, async () => {
      const geometry = new SphereGeometry(0.9, 16, 12).translate(centre, centre, centre);
      const { position } = geometry.scale(scale, scale, scale).attributes;
      const buffer = new InterleavedBuffer(new type(4 * position.count), 4);
      const quantised = isInterleaved
        ? new InterleavedBufferAttribute(buffer, 3, 0, isNormalized)
        : new BufferAttribute(new type(3 * position.count), 3, isNormalized);
      for (let v = 0; v < position.count; v++) {
        quantised.setXYZ(v, position.getX(v), position.getY(v), position.getZ(v));
      }
      geometry.setAttribute("position", quantised);
      const rest = Array.from({ length: position.count }, (_, v) => quantised.getX(v));
      const deformer = await CageDeformer.create(geometry, { grid: 24, cageOptions: { target: 30 } });
      for (const shift of [-0.3, 0.3]) {
        deformer.pose.set(deformer.cage.positions.map((x, k) => (k % 3 === 0 ? x + shift * scale : x)));
        await deformer.update();
        const moved = geometry.attributes.position;
        const errors = rest.map((x, v) => Math.abs(moved.getX(v) - x - shift * scale));
        assert.ok(Math.max(...errors) < 10 * ROUNDING * scale, `${Math.max(...errors)}`);
      }
    });
  }
}

test("joints of a skinned mesh follow the cage, and its skin stays at rest", async () => {
  const geometry = new CylinderGeometry(0.4, 0.4, 4, 12, 8).translate(0, 2, 0);
  const { position } = geometry.attributes;
  const rest = position.clone();
  // The upper half follows the second bone.
  const index = Array.from({ length: position.count }, (_, v) => [position.getY(v) > 2.1 ? 1 : 0, 0, 0, 0]);
  geometry.setAttribute("skinIndex", new BufferAttribute(Uint16Array.from(index.flat()), 4));
  const weight = index.flatMap(() => [1, 0, 0, 0]);
  geometry.setAttribute("skinWeight", new BufferAttribute(Float32Array.from(weight), 4));
  const [root, tip, mesh] = [new Bone(), new Bone(), new SkinnedMesh(geometry)];
  root.position.set(0, 0.5, 0);
  root.rotation.z = 0.3;
  tip.position.set(0, 1.5, 0);
  const armature = new Group().add(root.add(tip), mesh);
  armature.rotation.x = 0.4;
  armature.updateMatrixWorld(true);
  mesh.bind(new Skeleton([root, tip]));
  const joint = (bone) => mesh.worldToLocal(bone.getWorldPosition(new Vector3()));
  const before = [root, tip].map(joint);
  const deformer = await CageDeformer.create(mesh, { grid: 24, cageOptions: { target: 40 } });
  // Affine maps are reproduced exactly.
  const posed = ([x, y, z]) => [1.2 * x, 1.5 * y - 0.2, z + 0.1 * y];
  for (let k = 0; k < deformer.pose.length; k += 3)
    deformer.pose.set(posed(deformer.cage.positions.subarray(k, k + 3)), k);
  for (let repeated = 0; repeated < 2; repeated++) {
    await deformer.update();
    armature.updateMatrixWorld(true);
    mesh.skeleton.update();
    for (const [k, bone] of [root, tip].entries()) {
      const off = joint(bone).distanceTo(new Vector3(...posed(before[k].toArray())));
      assert.ok(off < 1e-5, `joint ${k}: ${off}`);
    }
    for (let v = 0; v < position.count; v++) {
      const skinned = mesh.getVertexPosition(v, new Vector3());
      const off = skinned.distanceTo(new Vector3(...posed([rest.getX(v), rest.getY(v), rest.getZ(v)])));
      assert.ok(off < 1e-5, `vertex ${v}: ${off}`);
    }
  }
  // A rotation of the second bone turns the upper half about the moved joint.
  const [pivot, v] = [tip.getWorldPosition(new Vector3()), index.findIndex(([bone]) => bone === 1)];
  const at = () => mesh.localToWorld(mesh.getVertexPosition(v, new Vector3()));
  const distance = at().distanceTo(pivot);
  const start = at();
  tip.rotation.x = 1;
  armature.updateMatrixWorld(true);
  assert.ok(Math.abs(at().distanceTo(pivot) - distance) < 1e-5 && at().distanceTo(start) > 0.3);
});

function facesOf({ corners }) {
  let faces = 0;
  for (let k = 0; k < corners.length; k += 1 + corners[k]) faces += 1;
  return faces;
}
