// Reads damaged files with the page's wasm modules, in which addresses have 32 bits. Each file must be read or refused
// with an error, without a trap, within 60 s, and within 1 GiB.
//
// usage: node page.mjs FUZZ_PROGRAM MINUTES [SEED]
// FUZZ_PROGRAM: the native fuzzer, which writes the files.

import { spawn } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { isMainThread, parentPort, Worker } from "node:worker_threads";

const MAX_SECONDS = 60;
/** Limit on the memory of each module. Wasm memory never shrinks, so a worker above half of it is replaced. */
const MAX_MEGABYTES = 1024;
/** Limit of a conversion of FBX on the page, bytes (`fbx.ts`). */
const FBX_MEMORY = 2 ** 31;
const ROOT = join(import.meta.dirname, "../..");

if (isMainThread) await main();
else await work();

async function main() {
  const [program, minutes, seed = Math.floor(Date.now() / 1000)] = process.argv.slice(2);
  console.log(`fuzz of the page: seed ${seed}, ${minutes} minutes`);
  const until = performance.now() + 60_000 * minutes;
  const source = spawn(program, ["--write", String(seed)], { stdio: ["ignore", "pipe", "inherit"] });
  const counts = { inputs: 0, read: 0, failures: 0, slowest: 0 };
  let worker = new Worker(import.meta.filename);
  for await (const bytes of inputsOf(source.stdout)) {
    const began = performance.now();
    const answer = await ask(worker, bytes);
    counts.slowest = Math.max(counts.slowest, performance.now() - began);
    counts.read += answer.read ? 1 : 0;
    if (answer.failure !== undefined) {
      const path = `target/fuzz/page-${seed}-${counts.inputs}`;
      mkdirSync(join(ROOT, "target/fuzz"), { recursive: true });
      writeFileSync(join(ROOT, path), bytes);
      console.log(`input ${counts.inputs}: ${answer.failure}; kept as ${path}`);
      counts.failures += 1;
    }
    if (answer.failure !== undefined || answer.megabytes > MAX_MEGABYTES / 2) {
      await worker.terminate();
      worker = new Worker(import.meta.filename);
    }
    counts.inputs += 1;
    if (performance.now() > until) break;
  }
  source.kill();
  await worker.terminate();
  console.log(
    `fuzz of the page: ${counts.inputs} inputs, ${counts.read} read, ${counts.failures} failures; the slowest took ${counts.slowest.toFixed()} ms`,
  );
  process.exit(counts.failures > 0 || counts.read === 0 ? 1 : 0);
}

/** Files, each with its length before it, as a 32-bit number. */
async function* inputsOf(stream) {
  let rest = Buffer.alloc(0);
  for await (const chunk of stream) {
    rest = Buffer.concat([rest, chunk]);
    while (rest.length >= 4 && rest.length >= 4 + rest.readUInt32LE()) {
      const end = 4 + rest.readUInt32LE();
      yield rest.subarray(4, end);
      rest = rest.subarray(end);
    }
  }
}

/** Lets the worker read a file. */
function ask(worker, bytes) {
  return new Promise((resolve) => {
    const fail = (error) => end({ failure: `the worker ended: ${error.message}` });
    const timer = setTimeout(() => end({ failure: `not done after ${MAX_SECONDS} s` }), 1000 * MAX_SECONDS);
    function end(answer) {
      clearTimeout(timer);
      worker.off("message", end).off("error", fail);
      resolve(answer);
    }
    worker.on("message", end).on("error", fail);
    worker.postMessage(bytes);
  });
}

async function work() {
  const source = join(ROOT, "web/package/src");
  const pkg = await import(join(source, "pkg/cagework.js"));
  const fbx = await import(join(source, "pkg-fbx/cagework_fbx.js"));
  // The hook of panics calls it, before the trap.
  globalThis.reportError = (error) => console.error(error);
  const { memory } = pkg.initSync({ module: readFileSync(join(source, "pkg/cagework_bg.wasm")) });
  const ofFbx = fbx.initSync({ module: readFileSync(join(source, "pkg-fbx/cagework_fbx_bg.wasm")) }).memory;
  parentPort.on("message", (input) => {
    const answer = { read: false };
    try {
      for (const name of ["x", "x.splat", "x.fbx"]) {
        try {
          read(pkg, fbx, name, input);
          answer.read = true;
        } catch (error) {
          if (error instanceof WebAssembly.RuntimeError || error instanceof RangeError) throw error;
        }
      }
    } catch (error) {
      answer.failure = `${error.name}: ${error.message}`;
    }
    answer.megabytes = Math.max(memory.buffer.byteLength, ofFbx.buffer.byteLength) / 2 ** 20;
    if (answer.megabytes > MAX_MEGABYTES) answer.failure ??= `took ${answer.megabytes} MB`;
    parentPort.postMessage(answer);
  });
}

/** Opens a file as the page does. */
function read(pkg, fbx, name, input) {
  let file = input;
  if (name.endsWith(".fbx")) {
    const converted = new fbx.ConvertedFbx(input, FBX_MEMORY);
    file = converted.takeGlb();
    converted.free();
  }
  const bytes = new pkg.FileBytes(file.length);
  bytes.push(file);
  const model = pkg.LoadedModel.read(name.replace("fbx", "glb"), bytes, () => undefined, 0);
  model.prepare(0);
  const { cage, checkedPositions } = model;
  if (cage) pkg.Binder.checkCage(cage, checkedPositions);
  pkg.LoadedModel.restore(model.store()).free();
}
