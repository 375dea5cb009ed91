/** The element's view: an engine on a canvas, with a model and its cage. */

import type { BindReport, CageArrays, Engine, Job, ModelInfo, SceneOptions } from "../contract";
import { BIND_DEFAULTS, CAGE_DEFAULTS, SCENE_DEFAULTS } from "../contract/generated";
import { isSoftware } from "../session/adapter";
import type { Package } from "../session/artifact";
import { startBind } from "../session/bind";
import { type Client, createClient, named } from "../session/client";
import { createFrames, type Frames } from "../session/frames";
import { type Canvases, type OpenResult, openOn } from "../session/open";
import { createSeparateWorkers, load } from "../session/reader";
import type { BindResult, Cage } from "../types";

/** A model to open, and how to bind it. */
export interface ModelRequest {
  readonly name: string;
  readonly file: Blob;
  /** Maximum number of cage vertices. */
  readonly vertices: number;
  /** Number of cells along the cage's longest side. */
  readonly grid: number;
  /** The cage to use, instead of the cage of a project or a generated one. */
  readonly cage?: Cage | undefined;
  /** Result of a bind of the model to `cage`. */
  readonly bound?: BindResult | undefined;
}

export interface OpenedModel {
  readonly model: ModelInfo;
  readonly report: BindReport;
}

/** Callback for the current stage and the finished fraction of the stage, 0 to 1. */
export type StageListener = (what: "Opening" | "Making a cage" | "Binding", fraction: number) => void;

export interface View {
  readonly engine: Engine;
  /**
   * Opens a model, generates a cage unless the request or the project has one, and binds the model unless the request
   * has the result of a bind. Cancels a previous `open`.
   */
  open(wanted: ModelRequest, hear: StageListener): Promise<OpenedModel>;
  close(): Promise<void>;
}

/** Opens a view with WebGPU, or with WebGL2 if there is no WebGPU. Calls `lost` if a lost device cannot be restored. */
export function openView(canvases: Canvases, lost: (error: unknown) => void): Promise<View> {
  return openOn(canvases, async (opened) => {
    const { artifact, module, canvas } = opened;
    await artifact.pkg.default({ module_or_path: module });
    const client = createClient(module, artifact.openWorker);
    const frames = createFrames(window);
    const engine = await artifact.pkg.Engine.create(canvas, frames.ask, () => {}).catch((error: unknown) => {
      client.close();
      throw error;
    });
    return viewOf({ ...opened, pkg: artifact.pkg, client, frames, engine }, canvases, lost);
  });
}

interface Parts extends OpenResult {
  readonly pkg: Package;
  readonly client: Client;
  readonly frames: Frames;
  readonly engine: Engine;
}

function viewOf(parts: Parts, canvases: Canvases, lost: (error: unknown) => void): View {
  const { artifact, module, adapter, lack, pkg, client, frames, engine } = parts;
  const reading = createSeparateWorkers(() => createClient(module, artifact.openWorker));
  const backend = lack || isSoftware(adapter) ? "cpu" : "gpu";
  let current: Job<unknown> | undefined;
  let work: Promise<unknown> = Promise.resolve();
  let isClosed = false;

  /** Recovers from a lost GPU device on a new canvas, because a canvas cannot be used with another device. */
  const watch = async (canvas: HTMLCanvasElement): Promise<void> => {
    canvas.addEventListener("webglcontextlost", () => engine.lose());
    await engine.lost();
    if (isClosed) return;
    const fresh = canvases.freshCanvas();
    await engine.recover(fresh);
    frames.ask();
    return isClosed ? undefined : watch(fresh);
  };
  const watching = watch(parts.canvas).catch((error: unknown) => {
    if (!isClosed) lost(error);
  });

  const run = <T>(job: Job<T>): Promise<T> => {
    if (isClosed) job.cancel();
    current = job;
    return job.done;
  };

  async function openModel(wanted: ModelRequest, hear: StageListener): Promise<OpenedModel> {
    const { name, file, vertices, grid, bound } = wanted;
    hear("Opening", 0);
    const read = await run(reading("read", { files: [{ name, path: name, file }], up: undefined }));
    await engine.open(await load(pkg, read), { sample: null, settings: null, cage: null, poses: [] });
    engine.frameAll();
    let cage = wanted.cage ? arraysOf(wanted.cage, engine.origin()) : read.cage;
    if (!cage) {
      const [positions, triangles] = engine.modelStates();
      const options = { ...CAGE_DEFAULTS, target: vertices };
      const [rig, model] = [engine.modelRig(), engine.modelPositions()];
      const input = { positions, triangles, rig, model, options, smooth: 0 };
      cage = await run(client.run("cage", input, ({ fraction }) => hear("Making a cage", fraction)));
    }
    engine.setCage({ ...cage, notices: [] }, undefined);
    engine.frameAll();
    if (bound) {
      const { indptr, indices, data, offsets } = bound.weights;
      const rows = (start: number, end: number) =>
        [indices.subarray(start, end), data.subarray(start, end)] as const;
      await engine.adopt(indptr, rows, offsets, bound.report, true);
      return { model: engine.modelInfo(), report: bound.report };
    }
    const report = await run(
      startBind({
        client,
        engine,
        adapter,
        options: { ...BIND_DEFAULTS, grid, backend },
        listener: (event) => event.kind === "progress" && hear("Binding", event.fraction),
        cage: () => engine.cageArrays(),
      }),
    );
    return { model: engine.modelInfo(), report };
  }

  return {
    engine,
    open(wanted, hear) {
      current?.cancel();
      // The engine can open one model at a time: wait until the previous call has stopped.
      const opening = work.then(() => {
        if (isClosed) throw named("Cancelled", "the element was removed from the page");
        frames.start(
          (sharp) => engine.drawFrame(sharp),
          () => !client.isBusy(),
        );
        return openModel(wanted, hear);
      });
      work = opening.catch(() => undefined);
      return opening;
    },
    async close() {
      isClosed = true;
      frames.stop();
      current?.cancel();
      client.close();
      // Free the engine only when none of its methods is running. Losing the device ends methods that wait for the GPU.
      engine.lose();
      await work;
      engine.lose();
      await watching;
      engine.free();
    },
  };
}

/** Copies a cage to arrays relative to the model's origin. */
function arraysOf({ positions, corners, controls, origin }: Cage, to: ArrayLike<number>): CageArrays {
  const shift = [0, 1, 2].map((axis) => (origin?.[axis] ?? 0) - (to[axis] ?? 0));
  return {
    positions: Float32Array.from(positions, (x, k) => x + (shift[k % 3] ?? 0)),
    corners: Uint32Array.from(corners),
    controls: controls ?? { smooth: 0, inner: 0, elements: [], radius: null },
  };
}

/** Returns the scene options of the element. Drags move vertices of the cage and do not pull the model. */
export function sceneOf(theme: string | null): SceneOptions {
  return { ...SCENE_DEFAULTS, theme: theme === "light" ? "light" : "dark", pull: false };
}
