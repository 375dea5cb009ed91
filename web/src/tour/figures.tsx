/** Figures of the tour's card: measurements of the stop's binds, and the option that the user can change. */

import { useEffect, useState } from "preact/hooks";
import type { App } from "../app";
import type { BindReport } from "../contract";
import { scientific } from "../format";
import { Button, Facts, Segments } from "../ui/controls";
import { curvesOf } from "../ui/curves";
import { Plot } from "../ui/plot";
import { CompareTable } from "../ui/report";
import { Comparison, SlicePosition } from "../ui/see";
import { T, TOUR } from "../words";
import type { Guide } from "./guide";
import { BONE, GRIDS, isOf, paper, STEPS, type StopName, solvers, stopsOf, TAUS } from "./stops";

interface Figure {
  app: App;
  guide: Guide;
  reports: readonly BindReport[];
}

export function TourFigure({ name, ...figure }: Figure & { name: StopName }) {
  const One = FIGURES[name];
  return One ? (
    <div class="tour-figure">
      <One {...figure} />
    </div>
  ) : null;
}

const FIGURES: Partial<Record<StopName, (figure: Figure) => preact.JSX.Element | null>> = {
  grid: Grid,
  paper: (figure) => <ErrorsBy option="grid" {...figure} />,
  smoothing: (figure) => <ErrorsBy option="tau" {...figure} />,
  delta: Delta,
  times: Times,
  error: Errors,
  coordinates: Comparison,
  smooth: Smooth,
  splat: Ellipses,
};

function Grid({ app }: Figure) {
  const { scene } = app.store.get();
  return (
    <>
      <Segments
        label={T.see.slice}
        values={["value", "kinds"]}
        labels={T.see.slices}
        value={scene.slice === "kinds" ? "kinds" : "value"}
        onChange={(kind) => app.view.slice({}, kind)}
      />
      <SlicePosition app={app} />
    </>
  );
}

/** Mean rest errors of binds with the classic method, which differ in one option. */
function ErrorsBy({ app, guide, reports, option }: Figure & { option: "grid" | "tau" }) {
  const { label, values, say } = {
    grid: { label: TOUR.cells, values: GRIDS, say: TOUR.ofCells },
    tau: { label: TOUR.tau, values: TAUS, say: TOUR.ofTau },
  }[option];
  const row = ({ [option]: value, rest_error }: BindReport) =>
    [TOUR.errorOf(say(value)), scientific(rest_error.mean_rel)] as const;
  return (
    <>
      <Segments<number>
        label={label}
        values={values}
        labels={scientific}
        value={app.store.get().bindOptions[option]}
        onChange={(value) => void guide.show({ ...paper(32, 1e-5), [option]: value })}
      />
      <Facts rows={reports.map(row)} />
    </>
  );
}

function Delta({ app, guide, reports }: Figure) {
  const { bindOptions } = app.store.get();
  const [report = null, ...earlier] = [...reports].reverse();
  const curves = curvesOf({ bindRun: null, report, earlier });
  const iterations = (name: string) =>
    reports.find((one) => T.report.solvers[one.solver] === name)?.iterations ?? 0;
  return (
    <>
      <Segments<number>
        label={TOUR.cells}
        values={GRIDS}
        labels={scientific}
        value={bindOptions.grid}
        onChange={(grid) => void guide.measure(solvers(grid))}
      />
      {report && <Plot curves={curves} tau={report.tau} />}
      <ul class="curves">
        {curves.map(({ name, kind }) => (
          <li class={kind} key={kind}>
            {TOUR.iterations(name, iterations(name))}
          </li>
        ))}
      </ul>
    </>
  );
}

function Times({ guide, reports }: Figure) {
  const isOnCard = reports.some(({ backend }) => backend === "gpu");
  return (
    <>
      <CompareTable reports={reports} />
      <Button
        label={TOUR.again}
        icon="reset"
        onClick={() => void guide.measure(stopsOf(isOnCard).times.binds)}
      />
    </>
  );
}

/**
 * Table of mean rest errors by grid and `tau`. Each number is a button that runs its bind again and shows the result.
 */
function Errors({ app, guide, reports }: Figure) {
  const { grid: gridNow, tau: tauNow } = app.store.get().bindOptions;
  return (
    <table class="compare errors">
      <caption>{TOUR.meanError}</caption>
      <thead>
        <tr>
          <th scope="col">{TOUR.cells}</th>
          {TAUS.map((tau) => (
            <th scope="col" key={tau}>
              {TOUR.ofTau(tau)}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {GRIDS.map((grid) => (
          <tr key={grid}>
            <th scope="row">{grid}</th>
            {TAUS.map((tau) => {
              const report = reports.find((report) => isOf(report, { grid, tau }));
              return (
                <td key={tau}>
                  {report && (
                    <Button
                      label={scientific(report.rest_error.mean_rel)}
                      name={TOUR.showError(grid, tau, report.rest_error.mean_rel)}
                      pressed={grid === gridNow && tau === tauNow}
                      onClick={() => void guide.show(paper(grid, tau))}
                    />
                  )}
                </td>
              );
            })}
          </tr>
        ))}
      </tbody>
    </table>
  );
}

/**
 * Three ellipses for the splat under the pointer: its outline at rest, the image of the unit circle under the
 * deformation gradient there, and its outline in the pose.
 */
function Ellipses({ app }: Figure) {
  const [outlines, setOutlines] = useState<readonly number[]>([]);
  useEffect(() => {
    const canvas = document.querySelector("canvas");
    const look = ({ clientX, clientY }: { clientX: number; clientY: number }) => {
      const { left = 0, top = 0 } = canvas?.getBoundingClientRect() ?? {};
      const found = app.ctx.engine().outlinesAt(clientX - left, clientY - top);
      if (found.length > 0) setOutlines(Array.from(found));
    };
    // A tap sends pointerdown, but no pointermove.
    const kinds = ["pointermove", "pointerdown"] as const;
    for (const kind of kinds) window.addEventListener(kind, look);
    return () => {
      for (const kind of kinds) window.removeEventListener(kind, look);
    };
  }, [app]);
  // The splats at rest and in the pose share one scale. The ellipse of the gradient has its own scale, and is drawn
  // over the unit circle, whose image it is.
  const longest = (first: number) => Math.max(outlines[first] ?? 0, outlines[first + 6] ?? 0);
  const scales = [24 / longest(0), 24 / Math.max(outlines[3] ?? 0, 1.5), 24 / longest(0)];
  return outlines.length === 0 ? (
    <p class="hint">{TOUR.pointAt}</p>
  ) : (
    <div class="row">
      {TOUR.ellipses.map((name, k) => {
        const [rx = 0, ry = 0, angle = 0] = outlines.slice(3 * k, 3 * k + 3);
        const scale = scales[k] ?? 0;
        return (
          <figure key={name} class="ellipse">
            <svg viewBox="-26 -26 52 52" role="img" aria-label={name}>
              {k === 1 && <circle r={scale} class="unit" />}
              <ellipse rx={scale * rx} ry={scale * ry} transform={`rotate(${(-180 / Math.PI) * angle})`} />
            </svg>
            <figcaption>{name}</figcaption>
          </figure>
        );
      })}
    </div>
  );
}

/** Choice of subdivision steps, and a button that adds a bone inside the cage. */
function Smooth({ app }: Figure) {
  const { cage } = app.store.get();
  if (!cage) return null;
  const { smooth, inner } = cage.controls;
  return (
    <>
      <Segments<number>
        label={T.cage.steps}
        values={STEPS}
        labels={scientific}
        value={smooth}
        onChange={app.cage.setSmooth}
      />
      <Button
        label={TOUR.bone}
        icon="bone"
        disabled={inner > 0}
        onClick={() => void app.controls.add("line", BONE)}
      />
    </>
  );
}
