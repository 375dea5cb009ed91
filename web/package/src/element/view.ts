/** The element's view: an engine on a canvas, with a model and its cage. */

import type { BindReport, Engine, Job, ModelInfo, SceneOptions } from "../contract";
import { BIND_DEFAULTS, CAGE_DEFAULTS, SCENE_DEFAULTS } from "../contract/generated";
import { isSoftware } from "../session/adapter";
import type { Package } from "../session/artifact";
import { startBind } from "../session/bind";
import { type Client, createClient, named } from "../session/client";
import { createFrames, type Frames } from "../session/frames";
import { type Canvases, type OpenedOn, openOn } from "../session/open";
import { createApart, load } from "../session/reader";

export interface Wanted {
  readonly name: string;
  readonly file: Blob;
  /** Maximum number of cage vertices. */
  readonly vertices: number;
  /** Number of cells along the cage's longest side. */
  readonly grid: number;
}

export interface Ready {
  readonly model: ModelInfo;
  readonly report: BindReport;
}

/** Called with the current stage and the fraction of it that is done. */
export type Hear = (what: "Opening" | "Making a cage" | "Binding", fraction: number) => void;

export interface View {
  readonly engine: Engine;
  /** Opens a model, generates a cage unless the file is a project with one, and binds. Cancels a previous `open`. */
  open(wanted: Wanted, hear: Hear): Promise<Ready>;
  close(): Promise<void>;
}

/** Opens a view with WebGPU, or WebGL2. Calls `lost` if a lost device cannot be restored. */
export function openView(canvases: Canvases, lost: (error: unknown) => void): Promise<View> {
  return openOn(canvases, async (opened) => {
    const { artifact, module, canvas } = opened;
    await artifact.pkg.default({ module_or_path: module });
    const client = createClient(module, artifact.openWorker);
    const frames = createFrames();
    const engine = await artifact.pkg.Engine.create(canvas, frames.ask, () => {}).catch((error: unknown) => {
      client.close();
      throw error;
    });
    return viewOf({ ...opened, pkg: artifact.pkg, client, frames, engine }, canvases, lost);
  });
}

interface Parts extends OpenedOn {
  readonly pkg: Package;
  readonly client: Client;
  readonly frames: Frames;
  readonly engine: Engine;
}

function viewOf(parts: Parts, canvases: Canvases, lost: (error: unknown) => void): View {
  const { artifact, module, adapter, lack, pkg, client, frames, engine } = parts;
  const reading = createApart(() => createClient(module, artifact.openWorker));
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

  async function openModel({ name, file, vertices, grid }: Wanted, hear: Hear): Promise<Ready> {
    hear("Opening", 0);
    const read = await run(reading("read", { files: [{ name, path: name, file }], up: undefined, used: 0 }));
    await engine.open(await load(pkg, read), { sample: null, settings: null, cage: null, poses: [] });
    engine.frameAll();
    let cage = read.cage;
    if (!cage) {
      const [positions, triangles] = engine.modelStates();
      const options = { ...CAGE_DEFAULTS, vertices };
      const input = { positions, triangles, model: engine.modelPositions(), options, smooth: 0 };
      cage = await run(client.run("cage", input, ({ fraction }) => hear("Making a cage", fraction)));
    }
    engine.setCage(cage.positions, cage.corners, cage.controls, [], undefined);
    engine.frameAll();
    const report = await run(
      startBind({
        client,
        engine,
        adapter,
        options: { ...BIND_DEFAULTS, grid, backend },
        listener: (event) => event.kind === "progress" && hear("Binding", event.fraction),
        cage: {
          positions: engine.restPositions(),
          corners: engine.cageCorners(),
          controls: engine.cageControls(),
        },
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
      // Free the engine only when none of its methods is running. Losing the device ends those that wait for the GPU.
      engine.lose();
      await work;
      engine.lose();
      await watching;
      engine.free();
    },
  };
}

/** Scene options of the element. Drags move vertices of the cage and do not pull the model. */
export function sceneOf(theme: string | null): SceneOptions {
  return { ...SCENE_DEFAULTS, theme: theme === "light" ? "light" : "dark", pull: false };
}
