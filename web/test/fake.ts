/** A fake session without wasm, workers or GPU. Tests resolve its jobs; a cage is two arrays. */

import { named } from "@cagework/core/session/client";
import type { Context, Fix } from "../src/actions/context";
import type {
  BindReport,
  CageControls,
  CageState,
  CheckedCage,
  Engine,
  Job,
  MemberInfo,
  ModelInfo,
  Opened,
  Session,
} from "../src/contract";
import { createHistory } from "../src/history";
import { createQueue } from "../src/queue";
import { createStore, type Store } from "../src/signals";
import { INITIAL } from "../src/state";
import type { Explained } from "../src/strings";

/** A requested job. */
export interface Asked {
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
  readonly asked: Asked[];
  readonly said: string[];
  /** Buttons of the last message. */
  offered: readonly { readonly label: string; run(): void }[];
  readonly problems: (Explained & { fix?: Fix["label"] })[];
  /** Kinds of coordinates that the engine has computed. */
  readonly others: string[];
  /** Names of engine calls that the fake only records. */
  readonly calls: string[];
  /** Replaces a function of the engine. */
  teach(functions: Partial<Engine>): void;
}

const BOUNDS: CageState["info"]["bounds"] = { min: [0, 0, 0], max: [1, 1, 1] };

/** A model of several. */
export function memberOf(id: number, name: string, triangles = 12): MemberInfo {
  const options = { shown: true, rigid: [], stays: [] };
  const parts = ["material:Cloth", "node:Buckle"];
  return { id, name, format: "obj", vertices: 8, triangles, rigged: false, parts, options, painted: false };
}

/** The engine's description of these models. */
export function modelOf(members: readonly MemberInfo[]): ModelInfo {
  const [first, ...more] = members.map(({ name }) => name);
  const name = more.length > 0 ? `${first} and ${more.length} more` : (first ?? "");
  return { ...MODEL, name, members: [...members] };
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
  skins: 0,
  joints: 0,
  clips: [],
  targets: [],
  props: [],
  rigged: false,
  bounds: BOUNDS,
  notices: [],
  members: [memberOf(0, "cube.obj")],
};

/** A cage of `n` vertices at the same height. */
export function cageOf(n: number, height = 0): CheckedCage {
  const check = {
    problems: [],
    vertices: new Uint32Array(),
    edges: new Uint32Array(),
    faces: new Uint32Array(),
    points: new Float32Array(),
    outside: new Uint32Array(),
  };
  return { positions: new Float32Array(3 * n).fill(height), corners: Uint32Array.of(n), check };
}

/** Controls of a plain cage. */
export const PLAIN: CageControls = { smooth: 0, inner: 0, elements: [], radius: null };

export const OPENED: Opened = { model: MODEL, cage: null, check: null, project: null };

/** The report of a bind with these options. */
export function reportOf(patch: Partial<BindReport> = {}): BindReport {
  const none = { mean: 0, max: 0 };
  return {
    method: "embedded",
    solver: "multigrid",
    preconditioner: "none",
    backend: "cpu",
    threads: 1,
    grid: 64,
    dims: [8, 8, 8],
    cell_size: [1, 1, 1],
    cell_shape: "box",
    delta_norm: "euclidean",
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
  const asked: Asked[] = [];
  const said: string[] = [];
  const problems: Fake["problems"] = [];
  const calls: string[] = [];
  const store = createStore(INITIAL);
  const history = createHistory(() => undefined);

  function job<T>(kind: string, input: unknown): Job<T> {
    let entry: Asked | undefined;
    const done = new Promise<T>((resolve, reject) => {
      entry = { kind, input, resolve: (output) => resolve(output as T), reject, cancelled: false };
      asked.push(entry);
    });
    // Awaited by the caller.
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
  let revision = 0;
  const controlsNow = () => rest.controls ?? PLAIN;
  const stateOf = (): CageState => ({
    usable: true,
    controls: controlsNow(),
    radius: 0.1,
    info: {
      vertices: rest.positions.length / 3 - controlsNow().inner,
      edges: 0,
      quads: 0,
      faces: 0,
      triangles: 0,
      bounds: BOUNDS,
      notices: [],
    },
  });
  const put = (positions: Float32Array, corners: Uint32Array, controls?: CageControls) => {
    rest = { positions: positions.slice(), corners, controls, check: null };
    posed = rest.positions.slice();
    revision += 1;
    return stateOf();
  };
  const known: Partial<Engine> = {
    get revision() {
      return revision;
    },
    requireCurrent(asked) {
      if (asked !== revision) throw named("Cancelled", "the model or cage was replaced");
    },
    setCage: put,
    commitRest: () => put(posed, rest.corners, rest.controls),
    cageControls: controlsNow,
    setSmooth(smooth) {
      const pose = posed;
      const state = put(rest.positions, rest.corners, { ...controlsNow(), smooth });
      posed = pose;
      return state;
    },
    addControl(kind, places) {
      const { inner, elements, ...others } = controlsNow();
      const corners = Array.from(places.slice(0, places.length / 3), (_, k) => inner + k);
      const element =
        kind === "point" ? { point: inner } : kind === "line" ? { line: corners } : { face: corners };
      const positions = Float32Array.of(...rest.positions, ...places);
      const controls = { ...others, inner: inner + corners.length, elements: [...elements, element] };
      return put(positions, rest.corners, controls);
    },
    middleAt: (x, y) => Float32Array.of(x, y, 0),
    cageCorners: () => rest.corners,
    restPositions: () => rest.positions.slice(),
    cagePositions: () => posed.slice(),
    setCagePositions(positions: Float32Array) {
      posed = positions.slice();
    },
    selection: () => Uint32Array.of(0),
    selectionCenter: () => Float32Array.of(0, 0, 0),
    last: () => 0,
    unmatched: () => new Uint32Array(),
    legend: () => undefined,
    hasOther: (kind) => fake.others.includes(kind),
    strays: () => 0,
    memberSettings: () => [],
    transformLabel: () => "Move",
  };
  const engine = new Proxy({} as Engine, {
    get: (_, name: keyof Engine) => known[name] ?? (() => calls.push(String(name))),
  });

  const session: Partial<Session> = {
    engine,
    samples: [{ id: "rat", label: "Rat" }],
    readFiles: (files) => job("read", files),
    open: (read) => job<Opened>("open", read).done,
    shareReader: () => () => {},
    add: (reads) => job<ModelInfo>("add", reads),
    openSample: (id) => job<Opened>("sample", id).done,
    turn: (project, up) => job<Opened>("turn", { project, up }).done,
    readCage: (files) => job("readCage", files),
    boxCage: (divisions) => cageOf(8, divisions),
    generateCage: (options) => job("cage", options),
    checkCage: () => job("check", null),
    repair: (kind) => job("repair", kind),
    carryPoses: (old, poses) => job<Float32Array[]>("carry", { old, poses }),
    takeCage: ({ positions, corners, controls }) => put(positions, corners, controls),
    bind: (options, listener) => job("bind", { options, listener }),
    estimateMemory: () => 1000,
    bindByFormula: (kind) => job("formula", kind),
    loadSlice: (axis, position) => job("slice", { axis, position }),
    loadLattice: (grid) => job("lattice", { grid }),
    preparePull: () => job<null>("pullOpen", null),
    pullGrab: (grab) => job("pullGrab", grab),
    pullFrame: (to) => job("pullFrame", to),
    picture: () => job<Blob>("picture", null).done,
    readSettings(text, { bind }) {
      const given = JSON.parse(text);
      return { notices: [], ...given, bind: { ...given.bind, memory_limit: bind.memory_limit } };
    },
  };
  const ctx: Context = {
    session: () => session as Session,
    store,
    history,
    queue: createQueue(),
    viewport: () => ({ width: 400, height: 300 }) as DOMRect,
    tell: {
      say: (text, ...offered) => {
        said.push(text);
        fake.offered = offered;
      },
      problem: (explained, fix) =>
        problems.push(fix ? ({ ...explained, fix: fix.label } as never) : explained),
      clear: () => problems.splice(0),
    },
    fixFor: (fix) => ({ label: fix, run: () => undefined }),
  };
  const fake: Fake = {
    ctx,
    store,
    engine,
    asked,
    said,
    offered: [],
    problems,
    others: [],
    calls,
    teach: (functions) => Object.assign(known, functions),
  };
  return fake;
}
