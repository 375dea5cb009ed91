/** The result card: what a bind did and how exact it is, in words first. */

import type { BindReport, MeanMax } from "../contract";
import { bytes, count, duration, percent, plural, scientific } from "../format";
import { sentence } from "../strings";
import { facts } from "./controls";
import { h } from "./dom";
import { icon } from "./icons";

export const METHODS = { embedded: "Embedded (ours)", classic: "Classic (the paper)" } as const;
const SOLVERS = { multigrid: "multigrid", jacobi: "Jacobi", cg: "conjugate gradients" } as const;

/** A largest rest error below this share of the cage's diagonal cannot be seen: a tenth of a pixel of 4K. */
const INVISIBLE = 2.5e-5;

/** The verdict as one sentence. */
export function verdict(report: Pick<BindReport, "converged" | "rest_error">): string {
  if (!report.converged)
    return "Stopped before it was done; raise the iteration limit for converged weights.";
  if (report.rest_error.max_rel < INVISIBLE)
    return [
      "At rest the model is where it was, to less than can be seen: after the solve, each vertex's weights are restored to",
      "add up to 1 and to give its place.",
      "The solver error is how far off they were before.",
    ].join(" ");
  return `At rest the model is off by up to ${scientific(report.rest_error.max_rel * 100)} % of the cage's size.`;
}

export function reportCard(report: BindReport): HTMLElement {
  const good = report.converged && report.outside_vertices === 0;
  const where = report.backend === "gpu" ? `GPU${report.adapter ? ` (${report.adapter})` : ""}` : "processor";
  return h(
    "section",
    { class: "card stack", attrs: { "aria-label": "Result of the bind" } },
    h(
      "div",
      { class: "row" },
      h("strong", { class: "grow", text: `Bound in ${duration(report.timings_ms.total)}` }),
      h(
        "span",
        { class: `badge ${good ? "good" : "warn"}` },
        icon(good ? "check" : "warning"),
        report.at_round_off ? "Converged to f32" : report.converged ? "Converged" : "Not converged",
      ),
    ),
    h("p", { class: "hint", text: verdict(report) }),
    facts([
      ["Method", `${METHODS[report.method]}, ${solverName(report)}`],
      ["Grid", `${report.dims.join(" × ")} cells`],
      ["Computed on", where],
      ["Rest error, mean", scientific(report.rest_error.mean_rel)],
      ["Rest error, largest", scientific(report.rest_error.max_rel)],
      ...rawFacts("Solver error", report.raw_error.point_rel),
      ["Weights", `${scientific(report.weights.min)} to ${scientific(report.weights.max)}`],
    ]),
    h(
      "details",
      { class: "fold" },
      h("summary", { text: "All numbers" }),
      h(
        "div",
        { class: "stack" },
        facts([
          ["Iterations", count(report.iterations)],
          ["Threshold", scientific(report.tau)],
          ["Cells inside", count(report.cells.interior)],
          ["Cells on the cage", count(report.cells.boundary)],
          ["Cells outside", count(report.cells.exterior)],
          ["Voxelize", duration(report.timings_ms.voxelize)],
          ["Solve", duration(report.timings_ms.solve)],
          ["Sample", duration(report.timings_ms.sample)],
          ["Memory, estimated", bytes(report.memory_bytes.estimated)],
          ["Memory, most used", bytes(report.memory_bytes.peak)],
          ...rawFacts("Solver: sums off by", report.raw_error.sum),
          ["Sum of a row off by", scientific(report.weights.max_sum_error)],
          ["Weights stored", `${count(report.weights.nonzeros)} (${percent(density(report))})`],
          ["Outside the cage", plural(report.outside_vertices, "vertex", "vertices")],
          ["Ambiguous cells", count(report.ambiguous_cells)],
        ]),
      ),
    ),
    ...report.notices.map((notice) => h("p", { class: "hint", text: sentence(notice) })),
  );
}

/** What the solver left of something. */
function rawFacts(name: string, error: MeanMax): [string, string][] {
  return [
    [`${name}, mean`, scientific(error.mean)],
    [`${name}, largest`, scientific(error.max)],
  ];
}

/** Solver and preconditioner, in words. */
export function solverName(by: Pick<BindReport, "solver" | "preconditioner">): string {
  const isPreconditioned = by.solver === "cg" && by.preconditioner === "v_cycle";
  return `${SOLVERS[by.solver]}${isPreconditioned ? " with V-cycles" : ""}`;
}

/** Method, solver, grid and place of a bind, in short. */
function wayOf(report: BindReport): string {
  const { method, grid, backend } = report;
  return `${method === "classic" ? "Classic" : "Embedded"}, ${solverName(report)}, ${grid}, ${backend.toUpperCase()}`;
}

/** Share of the weights that is stored. */
export function density(report: BindReport): number {
  const all = report.vertices * report.cage_vertices;
  return all === 0 ? 0 : report.weights.nonzeros / all;
}

/** Binds of this cage side by side. */
export function compareTable(reports: readonly BindReport[]): HTMLElement {
  const body = h("tbody");
  for (const report of reports) {
    body.append(
      h(
        "tr",
        {},
        h("th", {
          attrs: { scope: "row" },
          text: wayOf(report),
        }),
        h("td", { text: duration(report.timings_ms.total) }),
        h("td", { text: scientific(report.rest_error.mean_rel) }),
      ),
    );
  }
  return h(
    "table",
    { class: "compare" },
    h("caption", { class: "visually-hidden", text: "Binds of this cage" }),
    h(
      "thead",
      {},
      h(
        "tr",
        {},
        h("th", { attrs: { scope: "col" }, text: "Bind" }),
        h("th", { attrs: { scope: "col" }, text: "Time" }),
        h("th", { attrs: { scope: "col" }, text: "Rest error" }),
      ),
    ),
    body,
  );
}
