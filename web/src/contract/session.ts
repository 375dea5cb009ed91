/** What `session.ts` offers: files, jobs in the worker, frames. */

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

export interface Session {
  /** Synchronous side: state, picking, gestures, exports. Never keep anything else of the wasm module. */
  readonly engine: Engine;
  /** Name of the GPU, as the report card shows it. */
  readonly adapter: string;
  /** Why the page draws with WebGL2 and computes on the processor; null with WebGPU. */
  readonly lack: Lack | null;
  /** Identifier and label of each built-in sample; the first one is opened at start. */
  readonly samples: readonly Sample[];

  /**
   * Reads what was dropped or chosen, in a worker of its own: one .glb/.gltf/.obj (with siblings of a .gltf; paths of a
   * folder drop through `path`), or a project GLB. Draco and meshopt are decoded (their decoders load only then), textures
   * decoded. Whatever the file does, what is open stays open.
   */
  readFiles(files: readonly NamedFile[], hear?: (progress: Reading) => void): Job<ReadFile>;
  /** Opens what was read, once; a project's cage and poses are open afterwards too. */
  open(read: ReadFile): Promise<Opened>;
  /** Until what it returns is called, files are read by one worker as long as it does not break. */
  shareReader(): () => void;
  /**
   * Adds models to the cage that is open; cage and pose stay. `label` names the step of the history for a number of models;
   * without it, there is no step. `hear` is called with the index of each file. Resolves with notices.
   */
  add(
    reads: readonly ReadFile[],
    label?: (models: number) => string,
    hear?: (next: number) => void,
  ): Job<readonly string[]>;
  openSample(id: string): Promise<Opened>;
  /** Opens a project again with another axis up: model, cage and poses are turned. */
  turn(project: Uint8Array, up: UpAxis): Promise<Opened>;
  /** Checks the page's part of a project's settings: defaults (`bind` for a bind) replace bad values, and `notices` name them. */
  readSettings(text: string, bind: BindOptions): Settings;
  /** Reads a cage from a file as a model is read, and checks it. */
  readCage(files: readonly NamedFile[], hear?: (progress: Reading) => void): Job<CheckedCage>;
  /** A box around the model, its longest side cut into `divisions`. */
  boxCage(divisions: number): CageArrays;
  /** Makes a cage for the model, in the worker. `clip` names a clip whose frames it encloses as well. */
  generateCage(options: CageOptions, onProgress: (fraction: number) => void, clip?: string): Job<CheckedCage>;
  /** Checks the cage at rest as it is, in a worker of its own. */
  checkCage(): Job<Check>;
  /** The cage at rest, repaired, in that worker too. */
  repair(kind: Repair): Job<CheckedCage>;
  /** The cage at rest. */
  cageArrays(): CageArrays;
  /** Poses of another cage of the model, one after the other, for the cage that is open; in the worker. */
  carryPoses(old: CageArrays, poses: Float32Array): Job<Float32Array>;
  /** Takes a cage, as a step if there is a label. A mesh that is no cage yet is kept as a draft: `usable` is false. */
  takeCage(cage: CheckedCage, label?: string): CageState;

  /**
   * Binds in the worker: coarse (g = 32) first if that is less than asked, then as asked; each result is adopted as
   * soon as it is there, the pose stays.
   * `done` rejects with name "Cancelled" after `cancel()`, what was adopted before stays.
   */
  bind(options: BindOptions, listener: (event: BindEvent) => void): Job<BindReport>;
  /** Bytes that this bind would need, or the Error that it would end in. Cheap: call on every change. */
  estimateMemory(options: BindOptions): number;
  /** Coordinates by formula to compare with; needed once per cage before `scene.compare` shows them. Runs in the worker. */
  bindByFormula(kind: Coordinates): Job<void>;
  /** Cells and coordinates of one plane of the grid, in the worker; shown with `scene.slice` afterwards. */
  loadSlice(axis: 0 | 1 | 2, position: number, grid: number): Job<void>;
  /** What the cage needs to bend a moving model (`RigOptions.dynamic`), in the worker; once per cage. */
  loadLattice(grid: number): Job<void>;

  /** Makes ready to pull the model that is open, in a worker of its own. */
  preparePull(): Job<null>;
  /** Takes hold there. */
  pullGrab(grab: GrabInput): Job<Grabbed>;
  /** One frame towards targets, `[n_grabs, 3]`. */
  pullFrame(to: Float32Array): Job<PullFrame>;

  /** Asks for a frame; many calls make one. Every change through `engine` asks by itself. */
  draw(): void;
  /** Called after each drawn frame with the milliseconds the main thread spent on it. Returns "stop listening". */
  onFrame(listener: (ms: number) => void): () => void;
  /** PNG of the scene (without canvas borders), any size up to 8192; `alone`: of the model, transparent around it. */
  picture(width: number, height: number, alone?: boolean): Promise<Blob>;
  /** Posed positions as they are drawn, harmonic unless told (tests, numbers panel). */
  readPositions(kind?: Coordinates): Promise<Float32Array>;

  /** The device was lost (or `loseDevice()` was called): the page says so and calls `recover()`. */
  onLost(listener: (reason: string) => void): () => void;
  /** Everything again on a new device and canvas (a lost context's canvas cannot be used again: give a fresh one). */
  recover(canvas: HTMLCanvasElement): Promise<void>;
  /** For tests: destroys the device, as a driver reset would. */
  loseDevice(): void;
  /** Bytes of the module's memory on this thread. */
  memory(): number;
  close(): void;
}

export interface Sample {
  readonly id: string;
  readonly label: string;
  /** What there is to see. */
  readonly sentence?: string;
}

/** A file that a worker has read without harm. */
export interface ReadFile {
  /** How long the page freezes while it is opened, about, ms. */
  readonly took: number;
  readonly vertices: number;
}

export interface Opened {
  readonly model: ModelInfo;
  /** What is wrong with the cage that came along; null without one. */
  readonly check: Check | null;
  /** The text that a project was saved with; null without a project. */
  readonly settings: string | null;
  /** What could not be restored, in sentences. */
  readonly notices: readonly string[];
}
