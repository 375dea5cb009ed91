/** The stops of both tours: sample, binds and view of each stop. Their sentences are in words/en/tour.ts. */

import type { BindOptions, BindReport, Coordinates, SceneOptions } from "../contract";
import { PAPER_DEFAULTS } from "../defaults";
import type { Slice, StepName, TourName } from "../state";

export interface Stop {
  readonly sample: string;
  /** Index of the sample's pose; the rest pose if undefined. */
  readonly pose?: number;
  readonly step: StepName;
  /** Options of the stop's binds, in the order in which they run. The view shows the weights of the last bind. */
  readonly binds: readonly Partial<BindOptions>[];
  /** How often each bind runs again after the first time. Its report is that of the median time of these runs. */
  readonly repeats?: number;
  readonly scene?: Partial<SceneOptions>;
  /** Index of the cage vertex that is selected. */
  readonly vertex?: number;
  readonly slice?: Partial<Slice>;
  readonly compare?: readonly Coordinates[];
  /** Rotation of the view, starting from the right side of the model, as a pointer movement in CSS pixels. */
  readonly turn?: readonly [x: number, y: number];
}

/**
 * Numbers of cells along each side of the cage's bounding box, for the error table. All binds of the table together
 * take about a second.
 */
export const GRIDS = [16, 32] as const;
/** Values of `tau`, the threshold at which the solver stops, in the error table. */
export const TAUS = [1e-3, 1e-4, 1e-5] as const;

/** Bind options of the classic method. */
export const paper = (grid: number, tau: number): Partial<BindOptions> => {
  const { backend: _, memory_limit: __, ...way } = PAPER_DEFAULTS;
  return { ...way, grid, tau };
};
/**
 * The view of figures 2 to 5 of K. Smith's paper (docs/method.md): the model's wireframe over its reconstruction from
 * the weights.
 */
const FIGURE: Partial<SceneOptions> = { base_wireframe: true, cage: false, colour: "clay" };

/** Bind options of the classic method with each solver. */
export const solvers = (grid: number): Partial<BindOptions>[] =>
  (["jacobi", "cg", "multigrid"] as const).map((solver) => ({ ...paper(grid, 1e-5), solver }));

const RAT = { sample: "rat", turn: [90, 30] } as const;
const HUMANOID = { sample: "humanoid", step: "pose", binds: [{}], turn: [50, 15] } as const;

/** Stops of the tour *First steps*. */
const FIRST = {
  pull: { ...RAT, step: "pose", binds: [{}] },
  mirror: HUMANOID,
  save: HUMANOID,
  clip: HUMANOID,
  export: { ...HUMANOID, step: "export", pose: 0 },
} satisfies Record<string, Stop>;

/** Stops of the tour *How it works*. */
function howStops(gpu: boolean) {
  return {
    cage: { ...RAT, step: "pose", binds: [{}] },
    weight: { ...RAT, step: "pose", binds: [{}], scene: { colour: "weight" }, vertex: 58 },
    grid: {
      ...RAT,
      step: "bind",
      binds: [{}],
      scene: { slice: "value", model: false },
      slice: { axis: 0, position: 0.5 },
      vertex: 57,
    },
    paper: { ...RAT, step: "bind", binds: [paper(16, 1e-5)], scene: FIGURE },
    smoothing: { ...RAT, step: "bind", binds: [paper(32, 1e-3)], scene: FIGURE },
    delta: { ...RAT, step: "bind", binds: solvers(32) },
    times: {
      ...RAT,
      step: "bind",
      repeats: 3,
      binds: [
        paper(32, 1e-5),
        { grid: 32 },
        ...(gpu ? [{ grid: 64, backend: "gpu" } as const] : []),
        { grid: 64, backend: "cpu" },
      ],
    },
    error: {
      ...RAT,
      step: "bind",
      binds: GRIDS.flatMap((grid) => TAUS.map((tau) => paper(grid, tau))).reverse(),
      scene: FIGURE,
    },
    coordinates: {
      sample: "clamp",
      pose: 0,
      step: "pose",
      binds: [{}],
      compare: ["harmonic", "mean_value", "green"],
      turn: [-90, 0],
    },
    smooth: {
      sample: "clamp",
      pose: 0,
      step: "pose",
      binds: [{}],
      scene: { colour: "clay" },
      turn: [-90, 0],
    },
    // `binds` is empty, because opening a capture makes its cage and binds it.
    splat: { sample: "spot", step: "pose", binds: [], scene: { cage: false }, turn: [60, 20] },
  } satisfies Record<string, Stop>;
}

export type StopName = keyof typeof FIRST | keyof ReturnType<typeof howStops>;
/** Returns the stops of both tours. `gpu`: whether binds can run on the graphics card. */
export const stopsOf = (gpu: boolean): Readonly<Record<StopName, Stop>> => ({ ...FIRST, ...howStops(gpu) });
/** The names of each tour's stops, in order. */
export const STOPS = {
  first: Object.keys(FIRST) as StopName[],
  how: Object.keys(howStops(false)) as StopName[],
} as const satisfies Record<TourName, readonly StopName[]>;

/** Numbers of subdivision steps that stop "smooth" offers. */
export const STEPS = [0, 1, 2] as const;
/** Ends of the bone along the clamp's lower jaw, object units. */
export const BONE = [
  [-0.15, -0.3, 0],
  [0.85, -0.3, 0],
] as const;

/** Bind options in which binds of the same stop may differ. */
const WAY = ["grid", "tau", "method", "solver", "backend"] as const;

/** Whether a report belongs to a bind with these options. Numbers are compared as f32, the type of tau in Rust. */
export function isOf(report: BindReport, way: Partial<Pick<BindOptions, (typeof WAY)[number]>>): boolean {
  const bits = (value: string | number) => (typeof value === "number" ? Math.fround(value) : value);
  return WAY.every((key) => way[key] === undefined || bits(way[key]) === bits(report[key]));
}
