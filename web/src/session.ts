/** The page's interface to Rust: the engine on this thread, workers for binds and files, and frames. */

import { startBind } from "@cagework/core/session/bind";
import { type Client, createClient, named } from "@cagework/core/session/client";
import { createFrames } from "@cagework/core/session/frames";
import { chain } from "@cagework/core/session/jobs";
import type { ReadModel } from "@cagework/core/session/messages";
import { type Canvases, type OpenedOn, openOn } from "@cagework/core/session/open";
import { createApart, load } from "@cagework/core/session/reader";
import { polygons } from "@cagework/core/session/reading";
import type { BindOptions, Job, OpenContents, Opened, ReadFile, Session, View } from "./contract";
import { BIND_DEFAULTS, CAGE_DEFAULTS, RIG_DEFAULTS } from "./defaults";
import { once, prepareSample } from "./session/opening";
import { T } from "./words";

declare global {
  /** The open session, for the browser's console and for tests. */
  var cagework: Session | undefined;
}

/** Time after which drawing starts even if no model has been opened, ms. */
const LONGEST_EMPTY = 3000;

/** Fields of `ReadModel` with the same values for all samples, which have no companion files and no notices. */
const OWN = {
  siblings: new Map(),
  up: undefined,
  used: 0,
  pixels: 0,
  textures: [],
  notices: [],
  took: 0,
  vertices: 0,
};

/** Opens a session, see `openOn`. */
export function openSession(canvases: Canvases, needs: Needs): Promise<Session> {
  return openOn(canvases, (opened) => start({ ...opened, ...needs }));
}

interface Needs {
  /** Whether the first model to be opened is the first sample. */
  readonly fresh: Promise<boolean>;
  /** Called after each change of the document. */
  changed(view: View): void;
}

async function start(opened: OpenedOn & Needs): Promise<Session> {
  const { artifact, module, canvas, adapter, lack, fresh, changed } = opened;
  const { pkg, openWorker } = artifact;
  const { memory } = await pkg.default({ module_or_path: module });
  const client = createClient(module, openWorker);
  const samples = pkg.Binder.samples();
  const buildSample = prepareSample(client, samples[0], fresh);
  const frames = createFrames();
  /** Reports errors of `changed` here, because Rust ignores errors of its callbacks. */
  const report = (view: View) => {
    try {
      changed(view);
    } catch (error) {
      reportError(error);
    }
  };
  const engine = await pkg.Engine.create(canvas, frames.ask, report).catch((error: unknown) => {
    client.close();
    throw error;
  });
  // If preparing the pipelines fails, the first frame tries again and reports the error.
  engine.warm().catch(() => undefined);
  /**
   * Starts drawing once the first model is open. On a slow GPU, drawing an empty frame before would delay the model.
   */
  const begin = once(() =>
    frames.start(
      (sharp) => engine.drawFrame(sharp),
      () => !client.isBusy(),
    ),
  );
  setTimeout(begin, LONGEST_EMPTY);
  /** Selects the CPU backend if the GPU cannot compute: without WebGPU, and for conjugate gradients. */
  const possible = (options: BindOptions): BindOptions =>
    lack || options.solver === "cg" ? { ...options, backend: "cpu" } : options;
  /** The canvas in use. WebGL2 reports a lost context only by an event of the canvas. */
  let guarded: HTMLCanvasElement;
  const guard = (canvas: HTMLCanvasElement) => {
    guarded = canvas;
    // Ignore canvases of failed recoveries: their events are not about the device in use.
    canvas.addEventListener("webglcontextlost", () => guarded === canvas && engine.lose());
  };
  guard(canvas);
  const losses = new Set<(reason: string) => void>();
  const watch = async () => {
    const reason = await engine.lost();
    for (const listener of losses) listener(reason);
  };
  void watch();

  const cage = () => ({
    positions: engine.restPositions(),
    corners: engine.cageCorners(),
    controls: engine.cageControls(),
  });

  const openApart = () => createClient(module, openWorker);
  const reading = createApart(openApart);
  const checking = createApart(openApart);
  /** Worker for pulls, opened when first needed. It is separate so that binds do not delay pulls. */
  let puller: Client | undefined;
  const pulling = () => {
    puller ??= openApart();
    return puller;
  };
  /** Rejects the job with "Cancelled" if models or cage have changed when it is done. */
  const ofNow = <T>(job: Job<T>): Job<T> => {
    const { revision } = engine;
    return chain(job, (result) => {
      engine.requireCurrent(revision);
      return result;
    });
  };

  async function openRead(
    read: ReadModel,
    sample: string | null,
    poses: OpenContents["poses"] = [],
  ): Promise<Opened> {
    const models = await load(pkg, read);
    const settings = models[0].settings ?? null;
    // A project saved without a cage contains an empty one.
    const cage = read.cage?.positions.length ? read.cage : undefined;
    const contents: OpenContents = {
      sample,
      settings,
      cage: cage ? { ...cage, notices: [...(cage.notices ?? [])] } : null,
      poses,
    };
    const notices = await engine.open(models, contents);
    const info = engine.modelInfo();
    const model = {
      ...info,
      name: T.models.several(info.name, info.members.length - 1),
      notices: [...info.notices, ...read.notices],
    };
    return { model, check: cage?.check ?? null, settings, notices };
  }

  const session: Session = {
    engine,
    adapter,
    lack,
    samples,
    readFiles: (files, used, hear) => reading("read", { files, up: undefined, used }, hear),
    shareReader: reading.share,
    open: (read: ReadFile) => openRead(read as ReadModel, null).finally(begin),
    add(reads: readonly ReadFile[], label, hear) {
      let isGivenUp = false;
      const work = async () => {
        const all: Awaited<ReturnType<typeof load>>[number][] = [];
        try {
          for (const [k, read] of reads.entries()) {
            if (isGivenUp) throw named("Cancelled", "cancelled");
            hear?.(k);
            // If the file is a project, add its models and ignore its cage.
            all.push(...(await load(pkg, read as ReadModel)));
          }
        } catch (error) {
          for (const loaded of all) loaded.free();
          throw error;
        }
        await engine.add(all, label?.(all.length));
        return reads.flatMap((read) => (read as ReadModel).notices);
      };
      return {
        done: work(),
        cancel() {
          isGivenUp = true;
        },
      };
    },
    async openSample(id) {
      const { glb, cage, poses, grip } = await buildSample(id);
      const words = T.samples[id];
      const name = `${words?.name ?? id}.glb`;
      const named = poses.map((pose, k) => ({ ...pose, name: words?.poses[k] ?? pose.name }));
      const content = new Blob([glb as BlobPart]);
      const opened = await openRead({ ...OWN, name, content, cage }, id, named).finally(begin);
      return { ...opened, grip };
    },
    async turn(bytes, up) {
      const name = "turned.glb";
      const file = new Blob([new Uint8Array(bytes)]);
      return openRead(await reading("read", { files: [{ name, path: name, file }], up, used: 0 }).done, null);
    },
    readSettings: (text, bind) =>
      pkg.readSettings(text, JSON.stringify({ bind, cage: CAGE_DEFAULTS, rig: RIG_DEFAULTS })),
    readCage(files, hear) {
      const { smooth } = engine.cageControls();
      const input = {
        files,
        up: engine.up(),
        origin: engine.origin(),
        model: engine.modelPositions(),
        smooth,
      };
      return reading("readCage", input, hear);
    },
    boxCage: (divisions) => polygons(engine.boxCage(divisions)),
    checkCage: () => ofNow(checking("check", { cage: cage(), model: engine.modelPositions() })),
    repair: (kind) => ofNow(checking("repair", { kind, cage: cage(), model: engine.modelPositions() })),
    takeCage: ({ positions, corners, controls, notices = [] }, label) =>
      engine.setCage(positions, corners, controls, [...notices], label),
    cageArrays: cage,
    carryPoses: (old, poses) =>
      ofNow(
        client.run("carry", { model: engine.modelPositions(), cage: engine.restPositions(), old, poses }),
      ),
    generateCage(options, onProgress, clip) {
      const [positions, triangles] = engine.modelStates(clip);
      const model = engine.modelPositions();
      const { smooth } = engine.cageControls();
      const input = { positions, triangles, model, options, smooth };
      return ofNow(client.run("cage", input, ({ fraction }) => onProgress(fraction)));
    },
    bind: (options, listener) =>
      startBind({ client, engine, adapter, options: possible(options), listener, cage: cage() }),
    estimateMemory: (options) => engine.estimateMemory(possible(options)),
    bindByFormula: (kind) =>
      chain(
        ofNow(client.run("formula", { kind, positions: engine.modelPositions(), cage: cage() })),
        ({ indptr, indices, data }) =>
          engine.adoptOther(kind, indptr, (start, end) => [
            indices.subarray(start, end),
            data.subarray(start, end),
          ]),
      ),
    loadSlice(axis, fraction, grid) {
      const options = possible({ ...BIND_DEFAULTS, grid });
      const job = client.run("slice", { cage: cage(), axis, fraction, options });
      const none = { indptr: new Uint32Array(), indices: new Uint32Array(), data: new Float32Array() };
      return chain(ofNow(job), (rows) => {
        const { indptr, indices, data } = rows ?? none;
        engine.takeSlice(axis, fraction, options, indptr, indices, data);
      });
    },
    loadLattice(grid) {
      const options = possible({ ...BIND_DEFAULTS, grid });
      return chain(
        ofNow(client.run("lattice", { cage: cage(), options })),
        ({ indptr, indices, data, offsets }) => engine.takeLattice(indptr, indices, data, offsets),
      );
    },
    preparePull: () =>
      ofNow(
        pulling().run("pullOpen", {
          positions: engine.modelPositions(),
          triangles: engine.modelTriangles(),
          cage: cage(),
        }),
      ),
    pullGrab: (grab) => ofNow(pulling().run("pullGrab", grab)),
    pullFrame: (to) => ofNow(pulling().run("pullFrame", { to })),
    zip: (files) =>
      pkg.Engine.zipFiles(
        files.map(({ name }) => name),
        files.map(({ bytes }) => bytes),
      ),
    draw: frames.ask,
    onFrame: frames.listen,
    async picture(width, height, alone = false) {
      const pixels = new Uint8ClampedArray(await engine.picture(width, height, alone));
      const canvas = new OffscreenCanvas(width, height);
      canvas.getContext("2d")?.putImageData(new ImageData(pixels, width, height), 0, 0);
      return canvas.convertToBlob({ type: "image/png" });
    },
    readPositions: (kind = "harmonic") => engine.readPositions(kind),
    onLost(listener) {
      losses.add(listener);
      return () => losses.delete(listener);
    },
    async recover(fresh) {
      guard(fresh);
      await engine.recover(fresh);
      void watch();
    },
    loseDevice: () => engine.lose(),
    memory: () => memory.buffer.byteLength,
    close() {
      frames.stop();
      client.close();
      puller?.close();
      engine.free();
    },
  };
  globalThis.cagework = session;
  return session;
}
