/** Curves of the convergence plot: the current bind and the latest bind of each other solver. */

import type { BindReport } from "../contract";
import type { AppState } from "../state";
import { T } from "../words";
import { type Curve, historyPoints, KINDS } from "./plot";

/**
 * During a bind, returns only its curve. Otherwise returns the curve of the last bind, then the latest curve of each
 * other solver, up to `KINDS.length` curves in all.
 */
export function curvesOf({ bindRun, report, earlier }: CurveState): Curve[] {
  const reports = report ? [report, ...earlier] : [];
  const now = bindRun
    ? {
        name: bindRun.pass === "coarse" ? T.bind.coarse : T.report.solvers[bindRun.options.solver],
        points: bindRun.curve,
      }
    : reports.slice(0, 1).map(pointsOf)[0];
  if (!now) return [];
  if (bindRun) return [{ ...now, kind: "now" }];
  const names = new Set([now.name]);
  const others = reports.map(pointsOf).filter(({ name }) => !names.has(name) && names.add(name));
  const shown = [now, ...others].slice(0, KINDS.length);
  return shown.map((curve, k) => ({ ...curve, kind: KINDS[k] ?? "now" }));
}

export type CurveState = Pick<AppState, "bindRun" | "report" | "earlier">;

function pointsOf(report: BindReport) {
  return {
    name: T.report.solvers[report.solver],
    points: historyPoints(report.delta_history, report.delta_interval),
  };
}
