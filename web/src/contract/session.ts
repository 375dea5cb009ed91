/** Interface of `session.ts`: files, jobs in workers, frames. */

import type {
  BindEvent,
  BindOptions,
  BindReport,
  CageArrays,
  CageOptions,
  CageState,
  Check,
  CheckedCage,
  Coordinates,
  Engine,
  Grabbed,
  GrabInput,
  Job,
  Lack,
  ModelInfo,
  NamedFile,
  PullFrame,
  Reading,
  Repair,
  Settings,
  UpAxis,
} from "@cagework/core/contract";

/** Methods that work "in the worker" share one worker, which runs their jobs in sequence. */
export interface Session {
  /** The engine on the page's thread: document, picking, gestures, drawing, exports. */
  readonly engine: Engine;
  /** Name of the GPU, as the report card shows it. */
  readonly adapter: string;
  /** Why the page draws with WebGL2 and computes on the processor; null with WebGPU. */
  readonly lack: Lack | null;
  /** Identifiers of the built-in samples; the first one is opened at start. */
  readonly samples: readonly string[];

  /**
   * Reads one model with its companion files, or a project GLB, in a worker of its own. Files of a folder are found by
   * `path`. Decodes textures, Draco and meshopt data; decoders are downloaded when first needed. If reading fails or
   * crashes, the open model is not affected. `used`: pixels of the textures of other models that are drawn together with this one.
   */
  readFiles(files: readonly NamedFile[], used: number, hear?: (progress: Reading) => void): Job<ReadFile>;
  /** Opens a file that was read; a project brings its cage and poses. Call it once for each file. */
  open(read: ReadFile): Promise<Opened>;
  /** Until the returned function is called, one worker reads all files. The worker is replaced only after a failure. */
  shareReader(): () => void;
  /**
   * Adds models to the open cage; cage and pose stay. `label` returns the name of the undo step for a number of models;
   * without it, no step is added. `hear` is called with the index of each file. Resolves with notices.
   */
  add(
    reads: readonly ReadFile[],
    label?: (models: number) => string,
    hear?: (next: number) => void,
  ): Job<readonly string[]>;
  openSample(id: string): Promise<Opened>;
  /** Opens a project again with another up axis: rotates model, cage and poses. */
  turn(project: Uint8Array, up: UpAxis): Promise<Opened>;
  /**
   * Checks the page's part of a project's settings. Defaults replace bad values, which `notices` name. `bind`: defaults
   * of bind options.
   */
  readSettings(text: string, bind: BindOptions): Settings;
  /** Reads a cage from a file, like a model, and checks it. */
  readCage(files: readonly NamedFile[], hear?: (progress: Reading) => void): Job<CheckedCage>;
  /** A box around the model, with faces of about equal size: `divisions` of them along its longest side. */
  boxCage(divisions: number): CageArrays;
  /** Generates a cage for the model, in the worker. `clip`: name of a clip whose frames it also encloses. */
  generateCage(options: CageOptions, onProgress: (fraction: number) => void, clip?: string): Job<CheckedCage>;
  /** Checks the cage at rest, in a worker of its own. */
  checkCage(): Job<Check>;
  /** Repairs the cage at rest, in a worker of its own. Cancels `checkCage`. */
  repair(kind: Repair): Job<CheckedCage>;
  /** The cage at rest. */
  cageArrays(): CageArrays;
  /**
   * Converts poses of `old`, another cage of the model, to poses of the open cage, in the worker.
   * `poses`: `[n_poses, n_old_controls, 3]`.
   */
  carryPoses(old: CageArrays, poses: Float32Array): Job<Float32Array>;
  /** Sets the cage, as an undo step if there is a label. An invalid cage is kept as a draft, with `usable` false. */
  takeCage(cage: CheckedCage, label?: string): CageState;

  /**
   * Binds in the worker: first with 32 cells along the cage's longest side if the requested grid is finer, then on the
   * requested grid. Each result is adopted as soon as it is ready; the pose stays. After `cancel()`, `done` rejects
   * with name "Cancelled" and adopted results stay.
   */
  bind(options: BindOptions, listener: (event: BindEvent) => void): Job<BindReport>;
  /**
   * Number of bytes that a bind with these options needs. Throws the error that the bind would end with. Fast enough to
   * be called on every change.
   */
  estimateMemory(options: BindOptions): number;
  /**
   * Computes coordinates by a formula for comparison, in the worker. Needed once per cage before `scene.compare` shows
   * them.
   */
  bindByFormula(kind: Coordinates): Job<void>;
  /** Computes cells and coordinates of one plane of the grid, in the worker. `scene.slice` then shows them. */
  loadSlice(axis: 0 | 1 | 2, position: number, grid: number): Job<void>;
  /**
   * Computes the lattice by which the cage deforms a moving model (`RigOptions.dynamic`), in the worker. Needed once
   * per cage.
   */
  loadLattice(grid: number): Job<void>;

  /** Prepares pulls of the open model, in a worker for pulls. */
  preparePull(): Job<null>;
  /** Starts a pull with grabbed and pinned points, in the worker for pulls. */
  pullGrab(grab: GrabInput): Job<Grabbed>;
  /** Solves one frame of the pull, in the worker for pulls. `to`: targets of the grabbed points, `[n_grabs, 3]`. */
  pullFrame(to: Float32Array): Job<PullFrame>;

  /** A zip archive of files with distinct names. */
  zip(files: readonly { readonly name: string; readonly bytes: Uint8Array }[]): Uint8Array;
  /** Requests a frame; repeated calls are merged. Changes through `engine` request a frame themselves. */
  draw(): void;
  /**
   * Calls `listener` after each drawn frame with the milliseconds that the main thread spent on the frame. Returns a
   * function that removes the listener.
   */
  onFrame(listener: (ms: number) => void): () => void;
  /** PNG of the scene, up to 8192 pixels per side. `alone`: only the model, on a transparent background. */
  picture(width: number, height: number, alone?: boolean): Promise<Blob>;
  /** Posed positions as drawn, by default with harmonic coordinates. For tests. */
  readPositions(kind?: Coordinates): Promise<Float32Array>;

  /**
   * Calls `listener` when the GPU device is lost, after which the page calls `recover()`. Returns a function that
   * removes the listener.
   */
  onLost(listener: (reason: string) => void): () => void;
  /** Restores the view on a new device. `canvas` must be new, because one with a lost context cannot be used again. */
  recover(canvas: HTMLCanvasElement): Promise<void>;
  /** For tests: destroys the device, as a driver reset would. */
  loseDevice(): void;
  /** Bytes of the module's memory on this thread. */
  memory(): number;
  close(): void;
}

/** A file that a worker has read successfully. */
export interface ReadFile {
  /** Approximate time for which opening the file blocks the page, ms. */
  readonly took: number;
  readonly vertices: number;
  /** Pixels of its textures. */
  readonly pixels: number;
}

export interface Opened {
  readonly model: ModelInfo;
  /** Check of the cage in the file; null without a cage. */
  readonly check: Check | null;
  /** Settings text of a project; null for other files. */
  readonly settings: string | null;
  /** Point of a sample to pull first. */
  readonly grip?: Float32Array;
  /** Sentences about parts of a project that could not be restored. */
  readonly notices: readonly string[];
}
