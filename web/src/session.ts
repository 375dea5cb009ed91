/** The page's interface to Rust: the engine on this thread, workers for binds and files, and frames. */

import { startBind } from "@cagework/core/session/bind";
import { type Client, createClient } from "@cagework/core/session/client";
import { createFrames } from "@cagework/core/session/frames";
import { chain, pageTurn } from "@cagework/core/session/jobs";
import type { Held, ReadModel } from "@cagework/core/session/messages";
import { type Canvases, type OpenResult, openOn } from "@cagework/core/session/open";
import { createSeparateWorkers, load, type ReadListener } from "@cagework/core/session/reader";
import type {
  BindEvent,
  BindOptions,
  BindReport,
  CageArrays,
  CageOptions,
  CheckedCage,
  Coordinates,
  GrabInput,
  GrabResult,
  Job,
  ModelInfo,
  NamedFile,
  OpenContents,
  Problem,
  ProportionRange,
  PullFrame,
  Repair,
  UpAxis,
  View,
  WalkInfo,
} from "./contract";
import { BIND_DEFAULTS } from "./defaults";
import { once, prepareSample } from "./session/opening";
import { cancelled } from "./strings";
import { T } from "./words";

declare global {
  /** The open session, for the browser's console and for tests. */
  var cagework: Session | undefined;
}

/** Time after which drawing starts even if no model has been opened, ms. */
const MAX_EMPTY_MS = 3000;

/**
 * Samples that are read as files: from the folder `samples`, except the knot, whose splats Rust computes by a formula.
 * Rust builds the other samples.
 */
const SAMPLE_FILES: Readonly<Record<string, string>> = {
  spot: "spot.splat",
  knot: "knot.spz",
  wardrobe: "wardrobe.glb",
};

async function download(address: string, signal: AbortSignal | undefined): Promise<Blob> {
  const answer = await fetch(address, { signal: signal ?? null });
  if (!answer.ok) throw new Error(`${address}: ${answer.status} ${answer.statusText}`);
  return answer.blob();
}

/**
 * The engine and its workers. All methods documented as working "in the worker" share one worker, which runs their jobs
 * in sequence.
 */
export type Session = Awaited<ReturnType<typeof start>>;

/** A file that a worker has read successfully. */
export type ReadFile = Pick<ReadModel, "vertices" | "held">;

/** What the page needs from a file whose models are in the engine. */
export interface OpenedFile {
  readonly model: ModelInfo;
  /** Check of the cage in the file; null without a cage. */
  readonly check: readonly Problem[] | null;
  /** Settings of a project, JSON; null for other files. */
  readonly settings: string | null;
  /** Point of a sample that the page asks the user to pull first. */
  readonly grip?: readonly number[];
  /** Sentences about parts of a project that could not be restored. */
  readonly notices: readonly string[];
}

/** Opens a session, see `openOn`. */
export function openSession(canvases: Canvases, needs: Needs): Promise<Session> {
  return openOn(canvases, (opened) => start({ ...opened, ...needs }));
}

interface Needs {
  /** Resolves to true if the session opens the first sample, because there is no link and no saved work. */
  readonly fresh: Promise<boolean>;
  /** Called after each change of the document. */
  changed(view: View): void;
}

async function start(opened: OpenResult & Needs) {
  const { artifact, module, canvas, adapter, lack, fresh, changed } = opened;
  const { pkg, openWorker } = artifact;
  const { memory } = await pkg.default({ module_or_path: module });
  const client = createClient(module, openWorker);
  const samples = [...pkg.Binder.samples(), ...Object.keys(SAMPLE_FILES)];
  const buildSample = prepareSample(client, samples[0], fresh);
  const frames = createFrames(window);
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
   * Starts drawing once the first model is open. On a slow GPU, drawing an empty frame before that would delay the
   * model.
   */
  const begin = once(() =>
    frames.start(
      (sharp) => engine.drawFrame(sharp),
      () => !client.isBusy(),
    ),
  );
  setTimeout(begin, MAX_EMPTY_MS);
  /** The canvas in use. WebGL2 reports a lost context only by an event of the canvas. */
  let guarded: HTMLCanvasElement;
  const guard = (canvas: HTMLCanvasElement) => {
    guarded = canvas;
    // Ignore canvases of failed recoveries: their events are not about the device in use.
    canvas.addEventListener("webglcontextlost", () => guarded === canvas && engine.lose());
  };
  guard(canvas);
  const losses: ((reason: string) => void)[] = [];
  const watch = async () => {
    const reason = await engine.lost();
    for (const listener of losses) listener(reason);
  };
  void watch();

  const cage = () => engine.cageArrays();

  const openSeparateWorker = () => createClient(module, openWorker);
  const reading = createSeparateWorkers(openSeparateWorker);
  const checking = createSeparateWorkers(openSeparateWorker);
  /** Worker for pulls, opened when first needed. It is separate so that binds do not delay pulls. */
  let puller: Client | undefined;
  const pulling = () => {
    puller ??= openSeparateWorker();
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

  /** What the open models take, without one of them. */
  const held = (without?: number): Held => ({
    pixels: engine.texturePixels(without),
    bytes: engine.modelBytes(without),
  });

  /** Reads a model from one file in a worker of its own. */
  const readOne = (name: string, content: Uint8Array | Blob, up?: UpAxis) => {
    const file = new Blob([content as BlobPart]);
    return reading("read", { files: [{ name, path: name, file }], up }).done;
  };

  async function openRead(
    read: ReadModel,
    sample: string | null,
    poses: OpenContents["poses"] = [],
  ): Promise<OpenedFile> {
    const models = await load(pkg, read);
    const settings = models[0].settings ?? null;
    // A project that was saved without a cage contains an empty cage.
    const cage = read.cage?.positions.length ? read.cage : undefined;
    const notices = await engine.open(models, { sample, settings, cage: cage ?? null, poses });
    const info = engine.modelInfo();
    // The page then collects the shapes that the cage encloses, which takes as long.
    await pageTurn();
    const model = {
      ...info,
      name: T.models.several(info.name, info.members.length - 1),
      notices: [...info.notices, ...read.notices],
    };
    return { model, check: cage?.check ?? null, settings, notices };
  }

  const session = {
    /** The engine on the page's thread: document, picking, gestures, drawing, exports. */
    engine,
    /** Name of the GPU, as the report card shows it. */
    adapter,
    /** Why the page draws with WebGL2 and computes on the processor; null with WebGPU. */
    lack,
    /** Identifiers of the built-in samples; the first one is opened at start. */
    samples,
    /**
     * Reads one model with its companion files, or a project GLB, in a worker of its own. Companion files in folders
     * are found by `path`. Decodes textures, Draco and meshopt data; decoders are downloaded when first needed. If
     * reading fails or crashes, the open model is not affected. `held`: what the models take that remain open.
     */
    readFiles: (files: readonly NamedFile[], held: Held, hear?: ReadListener): Job<ReadFile> =>
      reading("read", { files, up: undefined, held }, hear),
    held,
    /**
     * Until the returned function is called, one worker reads all files. The worker is replaced only after a failure.
     */
    shareReader: reading.share,
    /**
     * Opens a file that was read; for a project, also its cage and poses. Call it once for each file. `sample`:
     * identifier of the sample, if the file is one.
     */
    open: (read: ReadFile, sample: string | null = null) =>
      openRead(read as ReadModel, sample).finally(begin),
    /**
     * Adds models to the open cage, and keeps cage and pose. `label` returns the name of the undo step for a number of
     * models; without it, no step is added. Resolves with the notices of the readers.
     */
    add(reads: readonly ReadFile[], label?: (models: number) => string): Job<readonly string[]> {
      let isGivenUp = false;
      const work = async () => {
        const all: Awaited<ReturnType<typeof load>>[number][] = [];
        try {
          for (const read of reads) {
            if (isGivenUp) throw cancelled();
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
    /** Fits a humanoid rig with clips to the open models, so that the cage can follow them. */
    async openWalk(read: ReadFile): Promise<WalkInfo> {
      const all = await load(pkg, read as ReadModel);
      try {
        return engine.openWalk(all[0]);
      } finally {
        for (const loaded of all) loaded.free();
      }
    },
    /**
     * Gives a model the joints, joint weights and morph targets of the model `body`, in a worker of its own, as an undo
     * step. Keeps the cage and its poses. Resolves with a sentence about what was copied.
     */
    copyRig(id: number, body: number, label: string, hear?: ReadListener): Job<{ readonly report: string }> {
      const [clothes, from] = [engine.storedModel(id), engine.storedModel(body)];
      const job = reading("copyRig", { clothes, body: from, held: held(id) }, hear);
      return chain(ofNow(job), async (read) => {
        const [loaded] = await load(pkg, read);
        await engine.replace(id, loaded, label);
        return { report: read.report };
      });
    },
    async openSample(id: string, signal?: AbortSignal): Promise<OpenedFile> {
      const name = SAMPLE_FILES[id];
      if (name) {
        const content =
          id === "knot" ? pkg.Binder.knotCapture() : await download(`./samples/${name}`, signal);
        const read = await readOne(name, content);
        signal?.throwIfAborted();
        return openRead(read, id).finally(begin);
      }
      const { read, poses, grip } = await buildSample(id);
      const words = T.samples[id];
      const named = poses.map((pose, k) => ({ ...pose, name: words?.poses[k] ?? pose.name }));
      const opened = await openRead(read, id, named).finally(begin);
      return { ...opened, grip };
    },
    /** Opens a project again with another up axis: rotates model, cage and poses. */
    async turn(bytes: Uint8Array, up: UpAxis) {
      return openRead(await readOne("turned.glb", bytes, up), null);
    },
    /** Reads the page's settings of a project. Defaults replace invalid values; `notices` name the invalid values. */
    readSettings: pkg.readSettings,
    /** Reads a cage from a file, like a model, and checks it. */
    readCage(files: readonly NamedFile[], hear?: ReadListener): Job<CheckedCage> {
      const { smooth } = engine.cageArrays().controls;
      const input = {
        files,
        up: engine.up(),
        origin: engine.origin(),
        model: engine.modelPositions(),
        smooth,
      };
      return reading("readCage", input, hear);
    },
    /** Creates a box around the model, with faces of about equal size: `divisions` of them along its longest side. */
    boxCage: (divisions: number): CageArrays => engine.boxCage(divisions),
    /** Checks the cage at rest, in a worker of its own. */
    checkCage: (): Job<readonly Problem[]> =>
      ofNow(checking("check", { cage: cage(), model: engine.modelPositions() })),
    /** Repairs the cage at rest, in a worker of its own. Cancels `checkCage`. */
    repair: (kind: Repair): Job<CheckedCage> =>
      ofNow(checking("repair", { kind, cage: cage(), model: engine.modelPositions() })),
    /** Sets the cage, as an undo step if there is a label. An invalid cage is kept as a draft, with `usable` false. */
    takeCage: (cage: CageArrays, label?: string) => engine.setCage(cage, label),
    /**
     * Converts poses of `old`, another cage of the model, to poses of the open cage, in the worker.
     * `poses`: `[n_poses, n_old_controls, 3]`.
     */
    carryPoses: (old: CageArrays, poses: Float32Array) =>
      ofNow(
        client.run("carry", { model: engine.modelPositions(), cage: engine.restPositions(), old, poses }),
      ),
    /**
     * Generates a cage for the model, in the worker. `clip`: name of a clip whose frames it also encloses. The listener
     * also gets the segments of the skeleton along which the cage is made, once.
     */
    generateCage(
      options: CageOptions,
      onProgress: (fraction: number, skeleton?: Float32Array) => void,
      clip?: string,
    ): Job<CheckedCage> {
      const input = () => {
        const [positions, triangles] = engine.modelStates(clip);
        const { smooth } = engine.cageArrays().controls;
        const rig = clip === undefined ? engine.modelRig() : undefined;
        const asked = clip === undefined ? options : pkg.Engine.clipCageOptions(options);
        const model = engine.modelPositions();
        return { positions, triangles, rig, model, options: asked, smooth };
      };
      return ofNow(client.run("cage", input, ({ fraction, skeleton }) => onProgress(fraction, skeleton)));
    },
    /**
     * Binds in the worker. A model that is not bound yet is first bound with the option `grid` set to 32, unless the
     * requested grid is not finer or the bind is very large (see `startBind`). Each result is adopted as soon as it is
     * ready, without a change of the pose. After `cancel()`, `done` rejects with name "Cancelled", and adopted results
     * remain in use.
     */
    bind: (options: BindOptions, listener: (event: BindEvent) => void): Job<BindReport> =>
      startBind({ client, engine, adapter, options, listener, cage }),
    /**
     * Computes closed-form coordinates for comparison, in the worker. Needed once per cage before `scene.compare` shows
     * them.
     */
    bindByFormula: (kind: Coordinates): Job<void> =>
      chain(
        ofNow(client.run("formula", { kind, positions: engine.modelPositions(), cage: cage() })),
        ({ indptr, indices, data }) =>
          engine.adoptOther(kind, indptr, (start, end) => [
            indices.subarray(start, end),
            data.subarray(start, end),
          ]),
      ),
    /** Computes cells and coordinates of one plane of the grid, in the worker. `scene.slice` then shows them. */
    loadSlice(axis: 0 | 1 | 2, fraction: number, grid: number): Job<void> {
      const options = { ...BIND_DEFAULTS, grid };
      const job = client.run("slice", { cage: cage(), axis, fraction, options });
      return chain(ofNow(job), (rows) => engine.takeSlice(axis, fraction, options, rows));
    },
    /**
     * Computes the lattice by which the cage deforms splats and moving models (`RigOptions.dynamic`), in the worker.
     * Needed once per cage.
     */
    loadLattice(grid: number): Job<void> {
      const options = { ...BIND_DEFAULTS, grid };
      return chain(ofNow(client.run("lattice", { cage: cage(), options })), (rows) =>
        engine.takeLattice(rows),
      );
    },
    /** Prepares pulls of the open model, in a worker for pulls. */
    preparePull: () =>
      ofNow(
        pulling().run("pullOpen", () => ({
          positions: engine.modelPositions(),
          triangles: engine.modelTriangles(),
          cage: cage(),
        })),
      ),
    /** Starts a pull with grabbed and pinned points, in the worker for pulls. */
    pullGrab: (grab: GrabInput): Job<GrabResult> => ofNow(pulling().run("pullGrab", grab)),
    /** Solves one frame of the pull, in the worker for pulls. `to`: targets of the grabbed points, `[n_grabs, 3]`. */
    pullFrame: (to: Float32Array): Job<PullFrame> => ofNow(pulling().run("pullFrame", { to })),
    /** Measures the factors of proportions beyond which the bound humanoid folds, in the worker. */
    proportionRanges: (): Job<readonly ProportionRange[]> =>
      ofNow(client.run("folds", () => engine.foldSample())),
    /** Creates a zip archive of files with distinct names. */
    zip: (files: readonly { readonly name: string; readonly bytes: Uint8Array }[]) =>
      pkg.Engine.zipFiles(
        files.map(({ name }) => name),
        files.map(({ bytes }) => bytes),
      ),
    /** Requests a frame; repeated calls are merged. Changes through `engine` request a frame themselves. */
    draw: frames.ask,
    /**
     * Calls `listener` after each drawn frame with the milliseconds that the main thread spent on the frame. Returns a
     * function that removes the listener.
     */
    onFrame: frames.listen,
    /**
     * Draws the scene as a PNG, up to `MAX_PICTURE` pixels per side. `alone`: only the model, on a transparent
     * background.
     */
    async picture(width: number, height: number, alone = false) {
      return pngOf(await engine.picture(width, height, alone), width, height);
    },
    /** Draws the model in a saved pose as a PNG, on a transparent background. */
    async posePicture(width: number, height: number, index: number) {
      return pngOf(await engine.posePicture(width, height, index), width, height);
    },
    /** Draws the model with the colours of the weight of a control as a PNG, on a transparent background. */
    async weightPicture(width: number, height: number, column: number) {
      return pngOf(await engine.weightPicture(width, height, column), width, height);
    },
    /** For tests: reads the posed positions as drawn, by default with harmonic coordinates. */
    readPositions: (kind: Coordinates = "harmonic") => engine.readPositions(kind),
    /** Calls `listener` when the GPU device is lost, after which the page calls `recover()`. */
    onLost: (listener: (reason: string) => void) => void losses.push(listener),
    /**
     * Restores the view on a new device. `canvas` must be new, because one with a lost context cannot be used again.
     */
    async recover(fresh: HTMLCanvasElement) {
      guard(fresh);
      await engine.recover(fresh);
      void watch();
    },
    /** For tests: destroys the device, as a driver reset would. */
    loseDevice: () => engine.lose(),
    /** Ends the idle worker, which frees its memory. The next job starts another one. */
    rest: client.rest,
    /** Size of the wasm module's memory on this thread, bytes. */
    memory: () => memory.buffer.byteLength,
  };
  globalThis.cagework = session;
  return session;
}

/** Encodes RGBA pixels. */
function pngOf(pixels: Uint8Array, width: number, height: number): Promise<Blob> {
  const canvas = new OffscreenCanvas(width, height);
  const image = new ImageData(new Uint8ClampedArray(pixels), width, height);
  canvas.getContext("2d")?.putImageData(image, 0, 0);
  return canvas.convertToBlob({ type: "image/png" });
}
