/** The result card of a bind: a verdict in words, then the numbers. */

import type { BindReport, MeanMax } from "../contract";
import { bytes, count, duration, percent, scientific } from "../format";
import { sentence } from "../strings";
import { T } from "../words";
import { Badge, Facts, Fold, Say } from "./controls";

/**
 * Rest error below which the bound model at rest looks like the original, as a fraction of the cage's diagonal: a tenth
 * of a pixel if the diagonal spans a screen 4,000 pixels wide.
 */
const MAX_INVISIBLE_ERROR = 2.5e-5;

/** Says what a bind has done: its time, how many points follow how many handles, and what is wrong with it. */
export function sayResult(report: BindReport): string {
  const { stopped, still, off, outside } = T.report.verdicts;
  const { vertices, cage_vertices, inner_controls, outside_vertices, converged, rest_error } = report;
  const { max_rel } = rest_error;
  return [
    T.report.plain(report.timings_ms.total, vertices, cage_vertices + inner_controls),
    max_rel < MAX_INVISIBLE_ERROR ? still : off(percent(max_rel, 2)),
    !converged && stopped,
    outside_vertices > 0 && outside(outside_vertices),
  ]
    .filter(Boolean)
    .join(" ");
}

export function ReportCard({ report }: { report: BindReport }) {
  const good = report.converged && report.outside_vertices === 0;
  const { roundOff, converged, notConverged } = T.report;
  return (
    <section class="stack" aria-label={T.report.name}>
      <div class="row">
        <strong class="grow">{T.report.boundIn(report.timings_ms.total)}</strong>
        <Badge
          kind={good ? "good" : "warn"}
          icon={good ? "check" : "warning"}
          text={report.at_round_off ? roundOff : report.converged ? converged : notConverged}
        />
      </div>
      <Facts
        rows={[
          [T.report.method, `${T.report.methods[report.method]}, ${T.report.solvers[report.solver]}`],
          [T.report.grid, T.report.cells(report.dims.join(" × "), report.grid_reason)],
          [T.report.computedOn, report.backend === "gpu" ? T.report.gpu(report.adapter) : T.report.cpu],
        ]}
      />
      <Fold title={T.report.allNumbers}>
        <Facts
          rows={[
            [T.report.restMean, scientific(report.rest_error.mean_rel)],
            [T.report.restLargest, scientific(report.rest_error.max_rel)],
            ...rawFacts(T.report.solverError, report.raw_error?.point_rel),
            [
              T.report.weights,
              T.report.range(scientific(report.weights.min), scientific(report.weights.max)),
            ],
            [T.report.iterations, count(report.iterations)],
            [T.report.threshold, scientific(report.tau)],
            [T.report.inside, count(report.cells.interior)],
            [T.report.boundary, count(report.cells.boundary)],
            [T.report.exterior, count(report.cells.exterior)],
            [T.report.voxelize, duration(report.timings_ms.voxelize)],
            [T.report.solve, duration(report.timings_ms.solve)],
            [T.report.sample, duration(report.timings_ms.sample)],
            [T.report.estimated, bytes(report.memory_bytes.estimated)],
            [T.report.peak, bytes(report.memory_bytes.peak)],
            ...rawFacts(T.report.sums, report.raw_error?.sum),
            [T.report.row, scientific(report.weights.max_sum_error)],
            [T.report.stored, `${count(report.weights.nonzeros)} (${percent(density(report))})`],
            [T.report.smooth, report.smooth > 0 && count(report.smooth)],
            [T.report.innerControls, report.inner_controls > 0 && count(report.inner_controls)],
            [T.report.held, report.inner_controls > 0 && T.report.vertices(report.held_vertices)],
            [T.report.outside, T.report.vertices(report.outside_vertices)],
            [T.report.ambiguous, count(report.ambiguous_cells)],
          ]}
        />
      </Fold>
      {report.notices.map((notice) => (
        <Say key={notice} kind="hint" text={sentence(notice)} />
      ))}
    </section>
  );
}

/** Rows with the mean and the largest value of the error called `name`; none if it was not measured. */
function rawFacts(name: string, error: MeanMax | undefined): [string, string][] {
  return error === undefined
    ? []
    : [
        [T.report.mean(name), scientific(error.mean)],
        [T.report.largest(name), scientific(error.max)],
      ];
}

/** Short name of a bind: method, solver, grid and backend. */
function wayOf(report: BindReport): string {
  const { method, grid, backend } = report;
  return `${T.report.short[method]}, ${T.report.solvers[report.solver]}, ${grid}, ${T.report.backends[backend]}`;
}

/** Fraction of the weight matrix that is stored. */
export function density(report: BindReport): number {
  const all = report.vertices * (report.cage_vertices + report.inner_controls);
  return all === 0 ? 0 : report.weights.nonzeros / all;
}

/** Table that compares binds of the same cage. */
export function CompareTable({ reports }: { reports: readonly BindReport[] }) {
  return (
    <table class="compare">
      <caption class="visually-hidden">{T.bind.all}</caption>
      <thead>
        <tr>
          {T.bind.columns.map((name) => (
            <th scope="col" key={name}>
              {name}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {reports.map((report) => (
          <tr key={wayOf(report)}>
            <th scope="row">{wayOf(report)}</th>
            <td>{duration(report.timings_ms.total)}</td>
            <td>{scientific(report.rest_error.mean_rel)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
