/**
 * A fake session for tests of actions, without wasm, workers or GPU. Jobs end when the test resolves them, and a cage
 * has only positions and corners.
 */

import { named } from "@cagework/core/session/client";
import type { Context, Fix } from "../src/actions/context";
import type {
  BindReport,
  CageControls,
  CageState,
  CheckedCage,
  Command,
  Engine,
  Held,
  Job,
  MemberInfo,
  ModelInfo,
  OpenedFile,
  ReadFile,
  Session,
  View,
} from "../src/contract";
import { VIEW_DEFAULTS } from "../src/defaults";
import { type DocumentMirror, followDocument } from "../src/document";
import { createQueue } from "../src/queue";
import { createStore, type Store } from "../src/signals";
import { INITIAL_STATE } from "../src/state";
import { type Explanation, textOf } from "../src/strings";

/** A job that the tested code has requested. The test resolves or rejects it. */
export interface JobRequest {
  readonly kind: string;
  readonly input: unknown;
  resolve(output: unknown): void;
  reject(error: Error): void;
  cancelled: boolean;
}

export interface Fake {
  readonly ctx: Context;
  readonly store: Store;
  readonly engine: Engine;
  readonly mirror: DocumentMirror;
  readonly asked: JobRequest[];
  readonly said: string[];
  /** Buttons of the last message in `said`. */
  offered: readonly { readonly label: string; run(): void }[];
  readonly problems: (Explanation & { fix?: Fix["label"] })[];
  /** Kinds of closed-form coordinates that count as computed; tests add to the list. */
  readonly others: string[];
  /** Names of the called engine functions that the fake does not implement. */
  readonly calls: string[];
  /** Commands passed to `engine.apply`, in order. */
  readonly commands: Command[];
  /** Labels of the undo steps, in order. */
  readonly did: string[];
  /** Changes fields of the engine's view of the document, and notifies the page. */
  show(patch: Partial<View>): void;
  /** Replaces the engine's description of its models. */
  showModel(model: ModelInfo): void;
  /** Replaces the cage. If `cage` includes a check, the page stores the check and does not request one. */
  showCage(cage: CheckedCage): void;
  /** Replaces or adds functions of the engine. */
  teach(functions: Partial<Engine>): void;
}

const NOTHING: Held = { pixels: 0, bytes: 0 };

const BOUNDS: CageState["info"]["bounds"] = { min: [0, 0, 0], max: [1, 1, 1] };

/** One model of a document that may contain several. */
export function memberOf(id: number, name: string, triangles = 12): MemberInfo {
  const options = { shown: true, rigid: [], stays: [] };
  const parts = ["material:Cloth", "node:Buckle"];
  return { id, name, format: "obj", vertices: 8, triangles, joints: 0, parts, options, painted: false };
}

/** The engine's description of a document with these models. */
export function modelOf(members: readonly MemberInfo[]): ModelInfo {
  return { ...MODEL, name: members[0]?.name ?? "", members: [...members] };
}

export const MODEL: ModelInfo = {
  name: "cube.obj",
  format: "obj",
  up: "y",
  vertices: 8,
  triangles: 12,
  faces: 6,
  materials: 0,
  textures: 0,
  splats: 0,
  points: 0,
  skins: 0,
  joints: 0,
  clips: [],
  targets: [],
  props: [],
  rigged: false,
  vrm: false,
  bounds: BOUNDS,
  suggestedUp: null,
  notices: [],
  members: [memberOf(0, "cube.obj")],
};

/** A checked cage without faults: `n` vertices at x = y = z = `height`, and placeholder corners. */
export function cageOf(n: number, height = 0): CheckedCage {
  return { positions: new Float32Array(3 * n).fill(height), corners: Uint32Array.of(n), check: [] };
}

/** Controls of a cage without smoothing and without inner controls. */
export const PLAIN_CONTROLS: CageControls = { smooth: 0, inner: 0, elements: [], radius: null };

export const OPENED_FILE: OpenedFile = { model: MODEL, check: null, settings: null, notices: [] };

/** A report of a converged multigrid bind on a grid of 64; `patch` replaces fields. */
export function reportOf(patch: Partial<BindReport> = {}): BindReport {
  const none = { mean: 0, max: 0 };
  return {
    method: "embedded",
    solver: "multigrid",
    backend: "cpu",
    threads: 1,
    grid: 64,
    dims: [8, 8, 8],
    cell_size: [1, 1, 1],
    tau: 1e-5,
    cells: { interior: 1, boundary: 1, exterior: 1 },
    levels: [1],
    iterations: 3,
    converged: true,
    at_round_off: false,
    delta_history: [],
    delta_interval: 1,
    residual_history: [],
    timings_ms: { voxelize: 1, solve: 1, sample: 1, total: 3 },
    memory_bytes: { estimated: 1, peak: 1 },
    rest_error: { mean: 0, p99: 0, max: 0, mean_rel: 0, max_rel: 0 },
    raw_error: { sum: none, point_rel: none, min_weight: 0 },
    weights: { min: 0, max: 1, max_sum_error: 0, nonzeros: 1 },
    vertices: 8,
    cage_vertices: 8,
    inner_controls: 0,
    smooth: 0,
    held_vertices: 0,
    outside_vertices: 0,
    staying_vertices: 0,
    outside_distance: 0,
    ambiguous_cells: 0,
    notices: [],
    ...patch,
  };
}

/** Waits until resolved promises have run their callbacks. */
export const settled = () => new Promise((resolve) => setTimeout(resolve));

export function createFake(): Fake {
  const asked: JobRequest[] = [];
  const said: string[] = [];
  const problems: Fake["problems"] = [];
  const calls: string[] = [];
  const store = createStore(INITIAL_STATE);
  const commands: Command[] = [];
  const did: string[] = [];

  function job<T>(kind: string, input: unknown): Job<T> {
    let entry: JobRequest | undefined;
    const done = new Promise<T>((resolve, reject) => {
      entry = { kind, input, resolve: (output) => resolve(output as T), reject, cancelled: false };
      asked.push(entry);
    });
    // The caller handles the rejection. Without this handler, a rejection before the caller awaits `done` would fail
    // the test.
    done.catch(() => undefined);
    const cancel = () => {
      if (!entry || entry.cancelled) return;
      entry.cancelled = true;
      entry.reject(named("Cancelled", "cancelled"));
    };
    return { done, cancel };
  }

  let rest = cageOf(0);
  let posed = rest.positions;
  let committed = posed;
  let revision = 0;
  const controlsNow = () => rest.controls ?? PLAIN_CONTROLS;
  const stateOf = (): CageState => ({
    usable: true,
    controls: controlsNow(),
    radius: 0.1,
    info: {
      vertices: rest.positions.length / 3 - controlsNow().inner,
      edges: 0,
      quads: 0,
      faces: 0,
      bounds: BOUNDS,
      notices: [...(rest.notices ?? [])],
    },
  });
  let view: View = VIEW_DEFAULTS;
  let model = MODEL;
  const show = (patch: Partial<View>) => {
    view = { ...view, ...patch };
    mirror.take(view);
  };
  const step = (label: string | undefined) => {
    if (label === undefined) return;
    did.push(label);
    show({ steps: view.steps + 1, undo: label });
  };
  const known: Partial<Engine> = {
    estimateMemory: () => 1000,
    get revision() {
      return revision;
    },
    get hasWeights() {
      return view.bound;
    },
    requireCurrent(asked) {
      if (asked !== revision) throw named("Cancelled", "model or cage have changed");
    },
    setCage(cage, label) {
      rest = { ...cage, positions: Float32Array.from(cage.positions), check: null };
      posed = rest.positions.slice();
      committed = posed;
      revision += 1;
      show({ cage: view.cage + 1, bound: false });
      step(label ?? undefined);
      return stateOf();
    },
    apply(command, label) {
      commands.push(command);
      if (command.do === "set_pins") show({ pins: command.pins });
      step(label ?? undefined);
    },
    commit(label) {
      committed = posed;
      step(label);
      return true;
    },
    revert() {
      calls.push("revert");
      posed = committed;
    },
    undo: () => false,
    modelInfo: () => model,
    humanoidInfo: () => undefined,
    cageState: () => (rest.positions.length > 0 ? stateOf() : undefined),
    boundReport: () => undefined,
    carriable: () => posed.slice(),
    setEditingRest: (editingRest) => show({ editingRest }),
    cageArrays: () => ({ ...rest, controls: controlsNow() }),
    middleAt: (x, y) => Float32Array.of(x, y, 0),
    restPositions: () => rest.positions.slice(),
    cagePositions: () => posed.slice(),
    setCagePositions(positions) {
      posed = Float32Array.from(positions);
    },
    selection: () => Uint32Array.of(0),
    setTools: (tools) => show({ tools }),
    legend: () => undefined,
    hasOther: (kind) => fake.others.includes(kind),
    strays: () => 0,
    movesAlone: () => false,
    lostIn: () => [],
    reachCircle: () => new Float32Array(),
    axes: () => Float32Array.of(0.8, -0.2, 0.5, 0, 0.9, 0.3, -0.5, -0.3, 0.8),
    estimateUpdates: () => 0,
    gestureView: () => ({ kind: "grab", amounts: [0.25], axis: 0, plane: false }),
  };
  const engine = new Proxy({} as Engine, {
    get: (_, name: keyof Engine) => known[name] ?? (() => calls.push(String(name))),
  });

  const session: Partial<Session> = {
    engine,
    samples: ["rat"],
    readFiles(files) {
      const { done, cancel } = job<ReadFile>("read", files);
      return { done: done.then((read) => ({ ...read, held: NOTHING })), cancel };
    },
    held: () => NOTHING,
    zip: (files) => Uint8Array.of(files.length),
    open: (read) => job<OpenedFile>("open", read).done,
    shareReader: () => () => {},
    add: (reads, label) => job("add", { reads, label }),
    openSample: (id) => job<OpenedFile>("sample", id).done,
    turn: (project, up) => job<OpenedFile>("turn", { project, up }).done,
    readCage: (files) => job("readCage", files),
    boxCage: (divisions) => cageOf(8, divisions),
    generateCage: (options) => job("cage", options),
    checkCage: () => job("check", null),
    repair: (kind) => job("repair", kind),
    carryPoses: (old, poses) => job<Float32Array>("carry", { old, poses }),
    takeCage: (cage, label) => engine.setCage(cage, label),
    bind: (options, listener) => job("bind", { options, listener }),
    bindByFormula: (kind) => job("formula", kind),
    loadSlice: (axis, position) => job("slice", { axis, position }),
    loadLattice: (grid) => job("lattice", { grid }),
    preparePull: () => job<null>("pullOpen", null),
    pullGrab: (grab) => job("pullGrab", grab),
    pullFrame: (to) => job("pullFrame", to),
    picture: () => job<Blob>("picture", null).done,
    weightPicture: (_width, _height, column) => job<Blob>("weightPicture", column).done,
    posePicture: (_width, _height, index) => job<Blob>("posePicture", index).done,
    onFrame: () => () => undefined,
    readSettings(text, memory_limit) {
      const given = JSON.parse(text);
      return { notices: [], ...given, bind: { ...given.bind, memory_limit } };
    },
  };
  const ctx: Context = {
    session: () => session as Session,
    engine: () => engine,
    store,
    queue: createQueue(),
    viewport: () => ({ width: 400, height: 300 }) as DOMRect,
    tell: {
      say: (text, ...offered) => {
        said.push(textOf(text));
        fake.offered = offered;
      },
      problem: ({ message, ...explained }, fix) =>
        problems.push({
          ...explained,
          message: textOf(message),
          ...(fix ? { fix: fix.label as never } : {}),
        }),
      clear: () => problems.splice(0),
      closeLatest: () => false,
    },
    fixFor: (fix) => ({ label: fix, run: () => undefined }),
  };
  const mirror = followDocument(ctx);
  const fake: Fake = {
    ctx,
    store,
    engine,
    mirror,
    asked,
    said,
    offered: [],
    problems,
    others: [],
    calls,
    commands,
    did,
    show,
    showModel(info) {
      model = info;
      show({ models: view.models + 1 });
    },
    showCage(cage) {
      engine.setCage(cage, undefined);
      if (cage.check) mirror.know(cage.check);
    },
    teach: (functions) => Object.assign(known, functions),
  };
  return fake;
}
