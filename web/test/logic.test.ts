import { isSoftware } from "@cagework/core/session/adapter";
import { pinch } from "@cagework/core/session/touch";
import { describe, expect, it } from "vitest";
import { grown } from "../src/actions/bind";
import { freshName } from "../src/actions/poses";
import { nextAmount } from "../src/amount";
import type { BindReport, CageState, Problem } from "../src/contract";
import { drawn } from "../src/derived";
import { rectangle } from "../src/input/pointer";
import { type AppState, INITIAL_STATE, type StepName } from "../src/state";
import { explain, isCancelled, sentence, textOf } from "../src/strings";
import { curvesOf } from "../src/ui/curves";
import { historyPoints, scaleOf } from "../src/ui/plot";
import { sayResult } from "../src/ui/report";
import { hintOf } from "../src/ui/status";
import { placeTip } from "../src/ui/tips";
import { nextTool } from "../src/ui/toolbar";
import { recognise } from "../src/ui/unsupported";
import { PLAIN_CONTROLS, reportOf } from "./fake";

describe("typed amounts", () => {
  const type = (keys: string) => [...keys].reduce((typed, key) => nextAmount(typed, key) ?? typed, "");
  it("keep digits", () => expect(type("12.5")).toBe("12.5"));
  it("accept one decimal point", () => expect(type("1.2.5")).toBe("1.25"));
  it("toggle the sign with minus", () => {
    expect(type("5-")).toBe("-5");
    expect(type("5--")).toBe("5");
  });
  it("delete with backspace, down to nothing", () => {
    expect(nextAmount("-", "Backspace")).toBe("");
    expect(nextAmount("", "x")).toBeUndefined();
  });
});

describe("two fingers", () => {
  it("pan by their midpoint and zoom by their distance", () => {
    const before = [
      { x: 0, y: 0 },
      { x: 100, y: 0 },
    ];
    const after = [
      { x: -40, y: 10 },
      { x: 160, y: 10 },
    ];
    expect(pinch(before, after)).toEqual({ dx: 10, dy: 10, x: 60, y: 10, factor: 2 });
  });
  it("do nothing if one is missing", () => expect(pinch([{ x: 0, y: 0 }], [])).toBeUndefined());
  it("do not zoom if they coincide", () => {
    const same = [
      { x: 5, y: 5 },
      { x: 5, y: 5 },
    ];
    expect(pinch(same, same)?.factor).toBe(1);
  });
});

describe("tool tips", () => {
  const window = { width: 390, height: 300 };
  const tip = { width: 100, height: 24 };
  const box = (x: number, y: number) => ({ x, y, width: 36, height: 36, right: x + 36, bottom: y + 36 });
  const at = (x: number, y: number, isInColumn = false) =>
    placeTip(box(x, y) as DOMRectReadOnly, tip, isInColumn, window);
  it("are below their element, or above at the lower edge", () => {
    expect(at(100, 100)).toEqual({ x: 68, y: 142 });
    expect(at(0, 260)).toEqual({ x: 6, y: 230 });
  });
  it("are beside a tool of a column, and cover no other tool", () => {
    expect(at(12, 100, true)).toEqual({ x: 54, y: 106 });
    expect(at(350, 290, true)).toEqual({ x: 244, y: 270 });
  });
});

describe("hints", () => {
  const cage = {} as CageState;
  const hint = (patch: Partial<AppState>, scene: Partial<AppState["scene"]>, isTouch = false) =>
    hintOf(
      { ...INITIAL_STATE, cage, bound: true, ...patch, scene: { ...INITIAL_STATE.scene, ...scene } },
      isTouch,
    );
  it("name only what the tool can do with what is visible", () => {
    expect(hint({}, {})).toMatch(/^Pull the model or a handle/);
    expect(hint({}, { cage: false })).toMatch(/^Pull the model \(arrow keys too\) ·/);
    expect(hint({}, { pull: false })).toMatch(/^Drag a handle ·/);
    expect(hint({}, { pull: false, cage: false })).not.toMatch(/Drag a handle|Pull the model/);
    const selected = { count: 1, last: 0, center: null };
    expect(hint({ selected }, { pull: false, gizmo: "move" })).toMatch(/gizmo.*arrow keys/);
    expect(hint({ editingRest: true }, { cage: false })).not.toMatch(/Drag a handle/);
  });
  it("name the repair that a cage needs before a bind", () => {
    const check: Problem[] = [
      {
        code: "open_edge",
        severity: "error",
        count: 4,
        message: "",
        places: { edges: [], faces: [], vertices: [], points: [] },
        fixes: [{ kind: "repair", repair: "fill_holes" }],
      },
    ];
    expect(hint({ bound: false, cage: { ...cage, usable: false }, check }, {})).toBe(
      "Before the model can be bound, the cage needs “Fill the holes”.",
    );
  });
  it("mention no wheel, mouse button or key on a phone", () => {
    const states: Partial<AppState>[] = [
      {},
      { editingRest: true },
      { clip: { ...INITIAL_STATE.clip, clip: 0 } },
      { painting: { id: 0, radius: 1, erase: false } },
      { bound: false },
    ];
    for (const state of states) {
      for (const scene of [{}, { pull: false }, { cage: false }, { gizmo: "move" as const, pull: false }]) {
        expect(hint(state, scene, true)).not.toMatch(/scroll|wheel|right-drag|shift|click|\?|Tab|Esc/i);
      }
    }
  });
});

describe("a toolbar", () => {
  it("moves the focus along its direction, around its ends", () => {
    expect([nextTool("ArrowDown", true, 0, 3), nextTool("ArrowUp", true, 0, 3)]).toEqual([1, 2]);
    expect([nextTool("ArrowRight", false, 2, 3), nextTool("ArrowLeft", false, 2, 3)]).toEqual([0, 1]);
    expect([nextTool("Home", true, 2, 3), nextTool("End", false, 0, 3)]).toEqual([0, 2]);
    expect([nextTool("ArrowRight", true, 0, 3), nextTool("a", true, 0, 3)]).toEqual([undefined, undefined]);
  });
});

describe("the plot", () => {
  it("spans powers of ten and includes the threshold", () => {
    const scale = scaleOf(
      [
        {
          name: "a",
          kind: "now",
          points: [
            [1, 0.03],
            [9, 2e-4],
          ],
        },
      ],
      1e-5,
    );
    expect(scale).toEqual({ lowest: -5, highest: -1, last: 9, logarithmic: false });
  });
  it("places points by the report's interval and skips zeros", () => {
    expect(historyPoints([0.1, 0, 0.01], 10)).toEqual([
      [10, 0.1],
      [30, 0.01],
    ]);
  });
  it("compares three solvers, on a logarithmic axis if their iterations differ much", () => {
    const report = (solver: BindReport["solver"], history: number[]) =>
      ({ solver, delta_history: history, delta_interval: 1 }) as unknown as BindReport;
    const jacobi = report("jacobi", [0.5, ...Array<number>(99).fill(1e-3)]);
    const state = {
      bindRun: null,
      report: report("multigrid", [1e-3, 1e-5]),
      earlier: [report("multigrid", [1e-2]), report("cg", [1e-1, 1e-2]), jacobi],
    };
    const curves = curvesOf(state);
    expect(curves.map(({ name, kind }) => [name, kind])).toEqual([
      ["multigrid", "now"],
      ["conjugate gradients", "before"],
      ["Jacobi", "earlier"],
    ]);
    expect(scaleOf(curves, 1e-5)).toMatchObject({ last: 100, logarithmic: true });
    expect(scaleOf(curves.slice(0, 2), 1e-5)).toMatchObject({ last: 2, logarithmic: false });
  });
  it("adds only new iterations and bounds the curve's length", () => {
    let curve = grown([], 1, 0.5);
    curve = grown(curve, 1, 0.4);
    curve = grown(curve, 2, null);
    expect(curve).toEqual([[1, 0.5]]);
    for (let i = 2; i < 5000; i += 1) curve = grown(curve, i, 1 / i);
    expect(curve.length).toBeLessThanOrEqual(601);
    expect(curve.at(-1)?.[0]).toBe(4999);
  });
});

it("faults are marked in step Cage, and elsewhere if they prevent a bind", () => {
  const bounds = { min: [0, 0, 0], max: [1, 1, 1] } as CageState["info"]["bounds"];
  const at = (step: StepName, usable: boolean) => {
    const info = { vertices: 8, edges: 12, faces: 6, quads: 6, bounds, notices: [] };
    const cage = { usable, info, controls: PLAIN_CONTROLS, radius: 0 };
    return drawn({ ...INITIAL_STATE, step, cage }).problems;
  };
  expect([at("pose", true), at("cage", true), at("pose", false)]).toEqual([false, true, true]);
});

it("the result of a bind says what follows what, and how far the model is off at rest", () => {
  const said = (report: Partial<BindReport>) =>
    sayResult(
      reportOf({
        vertices: 4812,
        cage_vertices: 80,
        timings_ms: { voxelize: 0, solve: 0, sample: 0, total: 200 },
        ...report,
      }),
    );
  const error = (max_rel: number) => ({ ...reportOf({}).rest_error, max_rel });
  expect(said({ rest_error: error(1e-8) })).toMatch(/4,812 points .* 80 handles .*At rest nothing moves\.$/);
  expect(said({ rest_error: error(1e-2) })).toContain("off by up to 1% of the cage's size");
  expect(said({ outside_vertices: 1, converged: false })).toMatch(/stopped .* 1 point lies outside/);
});

describe("words", () => {
  it("turn Rust's messages into sentences", () => {
    expect(textOf(sentence("cage is not closed: edge 12-40 has one triangle"))).toBe(
      "Cage is not closed: edge 12-40 has one triangle.",
    );
    expect(sentence("  ")).toBe("Something went wrong.");
    expect(textOf(sentence("horse.glb: cut off"))).toBe("horse.glb: cut off.");
  });
  it("offer a fix by the error's name", () => {
    const error = new Error("needs 3 GB");
    error.name = "Memory";
    expect(explain(error, "No bind").fix).toBe("coarser");
    error.name = "WeightsMemory";
    expect(explain(error, "No bind").fix).toBe("fewer");
    error.name = "NoneInside";
    expect(explain(error, "No bind").fix).toBe("regenerate");
    expect(explain("plain", "No bind")).toEqual({ title: "No bind", message: { english: "Plain." } });
  });
  it("recognise a cancellation", () => {
    const error = new Error("cancelled");
    error.name = "Cancelled";
    expect(isCancelled(error)).toBe(true);
  });
  it("choose an unused name for a pose", () => {
    const poses = ["Pose 2", "Jump"].map((name) => ({ name }));
    expect(freshName(poses)).toBe("Pose 3");
    expect(freshName(poses.slice(0, 1))).toBe("Pose 3");
  });
});

it("recognises software GPUs", () => {
  expect(isSoftware("ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (LLVM 10.0.0)))")).toBe(true);
  expect(isSoftware("llvmpipe (LLVM 15.0.6, 256 bits)")).toBe(true);
  expect(isSoftware("NVIDIA GeForce RTX 4070")).toBe(false);
});

describe("browsers", () => {
  it("are recognised by their user agents", () => {
    const edge =
      "Mozilla/5.0 (Windows NT 10.0; Win64; x64) AppleWebKit/537.36 Chrome/140.0 Safari/537.36 Edg/140.0";
    const safari =
      "Mozilla/5.0 (Macintosh; Intel Mac OS X 10_15_7) AppleWebKit/605.1.15 Version/17.6 Safari/605.1.15";
    const chrome = "Mozilla/5.0 (X11; Linux x86_64) AppleWebKit/537.36 Chrome/144.0.0.0 Safari/537.36";
    const firefox = "Mozilla/5.0 (Android 14; Mobile; rv:140.0) Gecko/140.0 Firefox/140.0";
    expect(recognise(edge)).toEqual({ browser: "edge", system: "windows" });
    expect(recognise(safari)).toEqual({ browser: "safari", system: "mac" });
    expect(recognise(chrome)).toEqual({ browser: "chrome", system: "linux" });
    expect(recognise(firefox)).toEqual({ browser: "firefox", system: "android" });
  });
});

it("a rubber band starts at its top left corner", () => {
  expect(rectangle({ x: 10, y: 5 }, { x: 4, y: 8 })).toEqual({ x: 4, y: 5, width: 6, height: 3 });
});
