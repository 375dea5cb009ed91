/** Step 3: how to bind, what it needs, how far it is, and what came out. */

import type { App } from "../app";
import type { BindOptions } from "../contract";
import { BIND_DEFAULTS, PAPER_DEFAULTS } from "../defaults";
import { bytes, count, percent, scientific, timeLeft } from "../format";
import { cageBroken } from "../state";
import { STAGES } from "../strings";
import { button, head, numberField, section, segments, slider, toggle } from "./controls";
import { curvesOf, legendOf } from "./curves";
import { fill, h, setText } from "./dom";
import { icon } from "./icons";
import { createPlace } from "./place";
import { createPlot, drawPlot } from "./plot";
import { compareTable, reportCard } from "./report";

const GRIDS = ["32", "64", "128", "256"] as const;
type Grid = (typeof GRIDS)[number];

export function createBindPanel(app: App): HTMLElement {
  const { store } = app;
  const set = app.bind.setOptions;

  const preset = h(
    "div",
    { class: "row even" },
    button("Ours", () => set(keepPlace(BIND_DEFAULTS)), {
      kind: "small",
      title: "Embedded boundary, multigrid",
    }),
    button("The paper's", () => set(keepPlace(PAPER_DEFAULTS)), {
      kind: "small",
      title: "Rectangular cells and Jacobi sweeps, as published",
    }),
  );
  const keepPlace = (options: BindOptions): Partial<BindOptions> => {
    const { grid, backend } = store.get().bindOptions;
    return { ...options, grid, backend };
  };
  const grid = segments<Grid>(
    "Grid, cells along the longest side",
    GRIDS.map((value) => ({ value, label: value })),
    (value) => set({ grid: Number(value) }),
  );
  const method = segments<BindOptions["method"]>(
    "Method",
    [
      { value: "embedded", label: "Embedded", title: "Meets the cage exactly inside a cell" },
      { value: "classic", label: "Classic", title: "The published method: whole cells" },
    ],
    (value) => set({ method: value }),
  );
  const solver = segments<BindOptions["solver"]>(
    "Solver",
    [
      { value: "multigrid", label: "Multigrid" },
      { value: "jacobi", label: "Jacobi" },
      { value: "cg", label: "Conj. gradients", title: "Conjugate gradients, on the processor" },
    ],
    (value) => set({ solver: value }),
  );
  const preconditioned = toggle(
    "Preconditioned by a V-cycle",
    "Each step begins with a cycle of multigrid: a few steps instead of a hundred.",
    (on) => set({ preconditioner: on ? "v_cycle" : "none" }),
  );
  const about = h("p", { class: "hint" });
  const memory = h("p", { class: "memory" });

  const tau = slider(
    "Stop when the change is below",
    { min: -8, max: -2, step: 1, format: (power) => `1e${power}` },
    (power) => set({ tau: 10 ** power }),
  );
  const limit = numberField("At most so many iterations", { min: 1, max: 1_000_000, step: "1" }, (value) =>
    set({ max_iterations: value }),
  );
  const sparsify = segments<"0" | "0.00001" | "0.001">(
    "Drop small weights",
    [
      { value: "0", label: "Keep all" },
      { value: "0.00001", label: "Up to 1e-5 a row" },
      { value: "0.001", label: "Up to 1e-3 a row" },
    ],
    (value) => set({ sparsify: Number(value) }),
  );
  const cells = segments<BindOptions["cell_shape"]>(
    "Cells of the classic method",
    [
      { value: "box", label: "As the cage's box" },
      { value: "cubic", label: "Cubes" },
    ],
    (value) => set({ cell_shape: value }),
  );
  const delta = segments<BindOptions["delta_norm"]>(
    "How Eq. 2 is read",
    [
      { value: "euclidean", label: "As meant" },
      { value: "literal", label: "As printed" },
    ],
    (value) => set({ delta_norm: value }),
  );
  const outside = toggle(
    "Vertices outside follow the cage",
    "They keep their place beside the closest point of the cage. Off: the bind refuses them.",
    (on) => set({ outside: on ? "closest_point" : "refuse" }),
  );
  const classicOnly = h("div", { class: "stack" }, cells.element, delta.element);
  const advanced = h(
    "details",
    { class: "fold" },
    h("summary", { text: "Advanced" }),
    h("div", { class: "stack" }, tau.element, limit.element, sparsify.element, classicOnly, outside.element),
  );

  const stage = h("strong", { class: "grow" });
  const share = h("span", { class: "number" });
  const bar = h("progress", { attrs: { max: "1", "aria-label": "Bind" } });
  const left = h("p", { class: "hint" });
  const running = h(
    "section",
    { class: "card stack tight", attrs: { "aria-label": "Bind under way" } },
    h("div", { class: "row" }, stage, share),
    bar,
    left,
  );
  const plot = createPlot();
  const figure = h(
    "figure",
    { class: "figure" },
    h("figcaption", { class: "section-title", text: "Change per iteration" }),
  );
  const legend = h("ul", { class: "curves" });
  const now = h("p", { class: "hint" });
  figure.append(plot, legend, now);
  const result = h("div", { class: "stack" });

  store.watch(["bindOptions"], ({ bindOptions: o }) => {
    grid.set(String(o.grid) as Grid);
    method.set(o.method);
    solver.set(o.solver);
    preconditioned.set(o.preconditioner === "v_cycle");
    preconditioned.element.hidden = o.solver !== "cg";
    tau.set(Math.round(Math.log10(o.tau)));
    limit.set(o.max_iterations);
    sparsify.set(o.sparsify === 0 ? "0" : o.sparsify < 1e-4 ? "0.00001" : "0.001");
    cells.set(o.cell_shape);
    delta.set(o.delta_norm);
    outside.set(o.outside === "closest_point");
    classicOnly.hidden = o.method !== "classic";
    setText(about, sayOptions(o));
  });
  store.watch(["memory", "cage", "bindOptions"], (state) => {
    const wrong = typeof state.memory === "string";
    memory.classList.toggle("bad", wrong);
    memory.hidden = !state.cage || cageBroken(state);
    fill(
      memory,
      icon(wrong ? "warning" : "info"),
      wrong ? String(state.memory) : `Needs about ${bytes(Number(state.memory))} of memory.`,
    );
  });
  store.watch(["bindRun", "report", "earlier", "bindOptions"], (state) => {
    const { bindRun, report, bindOptions } = state;
    running.hidden = bindRun === null;
    if (bindRun) {
      setText(stage, `${STAGES[bindRun.stage]}${bindRun.pass === "coarse" ? ", coarse first" : ""}`);
      setText(share, percent(bindRun.fraction));
      bar.value = bindRun.fraction;
      setText(left, bindRun.etaMs === null ? "Working out how long it takes" : timeLeft(bindRun.etaMs));
    }
    const curves = curvesOf(state).filter((curve) => curve.points.length > 0);
    fill(legend, ...legendOf(curves));
    figure.hidden = curves.length === 0;
    if (!figure.hidden) drawPlot(plot, curves, bindRun ? bindOptions.tau : (report?.tau ?? bindOptions.tau));
    const last = curves[0]?.points.at(-1);
    setText(now, last ? `${scientific(last[1])} after ${count(last[0])} iterations` : "");
  });
  store.watch(["report", "earlier", "bound"], ({ report, earlier, bound }) => {
    fill(
      result,
      report && bound ? reportCard(report) : null,
      report && earlier.length > 0
        ? h(
            "div",
            { class: "stack tight" },
            h("h3", { class: "section-title", text: "Beside earlier binds" }),
            compareTable([report, ...earlier]),
          )
        : null,
    );
  });

  return h(
    "div",
    { class: "stack loose" },
    head(
      "Bind the model to its cage",
      "Each vertex gets a share of every cage vertex: harmonic coordinates, solved on a grid inside the cage.",
    ),
    running,
    result,
    figure,
    section(
      "How it is computed",
      preset,
      grid.element,
      method.element,
      solver.element,
      preconditioned.element,
      about,
      ...createPlace(app),
      memory,
      advanced,
    ),
  );
}

/** What the chosen combination is, as a sentence. */
export function sayOptions(options: BindOptions): string {
  const { method, solver, preconditioner } = options;
  if (solver === "cg") {
    return preconditioner === "v_cycle"
      ? "Conjugate gradients, each step begun by a V-cycle. Compare the curve with multigrid's and Jacobi's."
      : "Conjugate gradients: no step undoes what those before have reached. Compare the curve with multigrid's and Jacobi's.";
  }
  if (method === "embedded") {
    return solver === "multigrid"
      ? "Ours: the cage cuts the cells exactly where it is, coarse grids do the long distances."
      : "Our cells with the paper's sweeps: as exact, but slower. Watch the curve flatten.";
  }
  return solver === "jacobi"
    ? "The paper's own: whole cells, Jacobi sweeps. Compare its rest error with ours below."
    : "The paper's cells, solved by multigrid: the same weights in a fraction of the sweeps.";
}
