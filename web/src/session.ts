/** The one way from the page to Rust: the engine on this thread, the binder in a worker, files, frames. */

import type {
  BindEvent,
  BindOptions,
  BindReport,
  CageState,
  Job,
  ModelInfo,
  NamedFile,
  Opened,
  Engine as PageEngine,
  Sample,
  Session,
} from "./contract";
import { BIND_DEFAULTS } from "./defaults";
import init, { Binder, Engine } from "./pkg/cagework";
import wasmUrl from "./pkg/cagework_bg.wasm?url";
import { findAdapter } from "./session/adapter";
import { startBind } from "./session/bind";
import { createClient } from "./session/client";
import { load, readFiles } from "./session/files";
import { createFrames } from "./session/frames";
import { chain } from "./session/jobs";

declare global {
  /** For the browser's console, and for tests. */
  var cagework: Session | undefined;
}

/**
 * Opens a GPU, the module and the worker. Fails with the name NoWebGPU, NoAdapter or NoDevice where the page cannot run.
 */
export async function openSession(canvas: HTMLCanvasElement): Promise<Session> {
  const adapter = await findAdapter();
  const module = await compile(wasmUrl);
  const { memory } = await init({ module_or_path: module });
  const frames = createFrames();
  const raw = await Engine.create(canvas, frames.ask);
  const engine = raw as unknown as PageEngine;
  frames.start(() => raw.drawFrame());
  const client = createClient(
    module,
    () => new Worker(new URL("./worker.ts", import.meta.url), { type: "module", name: "cagework" }),
  );
  const losses = new Set<(reason: string) => void>();
  const watch = async () => {
    const reason = await raw.lost();
    for (const listener of losses) listener(reason);
  };
  void watch();

  const cage = () => ({ positions: engine.restPositions(), corners: engine.cageCorners() });
  const stateOf = () => engine.cageState() ?? null;
  let bind: Job<BindReport> | undefined;
  let slice: Job<void> | undefined;
  let meanValue: Job<void> | undefined;

  async function openBytes(bytes: Parameters<typeof load>[0]): Promise<Opened> {
    const { loaded, notices } = await load(bytes);
    const { settings } = loaded;
    const poses = loaded.poseNames().map((name, k) => ({ name, positions: loaded.posePositions(k) }));
    bind?.cancel();
    const read: ModelInfo = await raw.open(loaded);
    const model = { ...read, notices: [...read.notices, ...notices] };
    const project = settings === undefined ? null : { poses, settings };
    return { model, cage: stateOf(), project };
  }

  const session: Session = {
    engine,
    adapter,
    samples: samples(),
    openFiles: async (files) => openBytes(await readFiles(files)),
    async openSample(id) {
      const { glb, cage, poses } = await client.run("sample", { id }).done;
      const label = samples().find((sample) => sample.id === id)?.label ?? id;
      const opened = await openBytes({ name: `${label}.glb`, bytes: glb, sibling: () => undefined });
      return { ...opened, cage: engine.setCage(cage.positions, cage.corners), poses };
    },
    async openCage(files: readonly NamedFile[]): Promise<CageState> {
      const { name, bytes, sibling } = await readFiles(files);
      return raw.loadCage(name, bytes, sibling);
    },
    generateCage(options, onProgress) {
      const input = { positions: raw.modelPositions(), triangles: raw.modelTriangles(), options };
      const job = client.run("cage", input, ({ fraction }) => onProgress(fraction));
      return chain(job, ({ positions, corners }) => engine.setCage(positions, corners));
    },
    bind(options: BindOptions, listener: (event: BindEvent) => void): Job<BindReport> {
      bind?.cancel();
      bind = startBind({ client, engine, raw, adapter, options, listener, cage: cage() });
      return bind;
    },
    estimateMemory: (options) => raw.estimateMemory(options),
    bindMeanValue() {
      meanValue?.cancel();
      const job = client.run("meanValue", { positions: raw.modelPositions(), cage: cage() });
      meanValue = chain(job, ({ indptr, indices, data }) => raw.adoptOther(indptr, indices, data));
      return meanValue;
    },
    loadSlice(axis, fraction, grid) {
      slice?.cancel();
      const options: BindOptions = { ...BIND_DEFAULTS, grid };
      const job = client.run("slice", { cage: cage(), axis, fraction, options });
      const none = { indptr: new Uint32Array(), indices: new Uint32Array(), data: new Float32Array() };
      slice = chain(job, (rows) => {
        const { indptr, indices, data } = rows ?? none;
        raw.takeSlice(axis, fraction, options, indptr, indices, data);
      });
      return slice;
    },
    draw: frames.ask,
    onFrame: frames.listen,
    async picture(width, height) {
      const pixels = new Uint8ClampedArray(await raw.picture(width, height));
      const canvas = new OffscreenCanvas(width, height);
      canvas.getContext("2d")?.putImageData(new ImageData(pixels, width, height), 0, 0);
      return canvas.convertToBlob({ type: "image/png" });
    },
    readPositions: () => raw.readPositions(),
    onLost(listener) {
      losses.add(listener);
      return () => losses.delete(listener);
    },
    async recover(fresh) {
      await raw.recover(fresh);
      void watch();
    },
    loseDevice: () => raw.lose(),
    memory: () => memory.buffer.byteLength,
    close() {
      frames.stop();
      client.close();
      raw.free();
    },
  };
  globalThis.cagework = session;
  return session;
}

function samples(): readonly Sample[] {
  const words = Binder.samples();
  return Array.from({ length: words.length / 3 }, (_, k) => {
    const [id = "", label = "", sentence = ""] = words.slice(3 * k, 3 * k + 3);
    return { id, label, sentence };
  });
}

/** Compiles while it downloads, where the server says that it is wasm. */
async function compile(url: string): Promise<WebAssembly.Module> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url} could not be downloaded (${response.status})`);
  if (response.headers.get("Content-Type")?.startsWith("application/wasm")) {
    return WebAssembly.compileStreaming(response);
  }
  return WebAssembly.compile(await response.arrayBuffer());
}
