/** Step 3: result, fineness, and, folded, how the bind is computed: options, memory, plot and figures. */

import { useEffect, useState } from "preact/hooks";
import type { App } from "../app";
import type { BindOptions } from "../contract";
import { BIND_DEFAULTS, PAPER_DEFAULTS, SLIDERS } from "../defaults";
import { cageBroken, hasUnappliedOptions, isCapture } from "../derived";
import { inUnit, percent } from "../format";
import type { BindRun } from "../state";
import { T } from "../words";
import { Button, Fold, fieldsOf, Head, NumberField, Say, Segments, Slider } from "./controls";
import { curvesOf } from "./curves";
import { Icon } from "./icons";
import { Plot } from "./plot";
import { CompareTable, ReportCard, sayResult } from "./report";

/** Numbers of cells along the cage's longest side that the panel offers; 0 is automatic. */
const GRIDS = [0, 32, 64, 128, 256] as const;
/** Size of the picture of a weight, pixels: twice its CSS pixels, for high-density screens. */
const PICTURE = [656, 400] as const;
const SPARSIFY = [0, 0.00001, 0.001] as const;

export function BindPanel({ app }: { app: App }) {
  const { bindRun, report, earlier, bound, tour, memory } = app.store.get();
  const result = report && bound ? report : null;
  return (
    <div class="stack loose">
      <Head title={T.bind.title} sentence={result ? sayResult(result) : T.bind.sentence} />
      {bindRun && <Running run={bindRun} />}
      {result && <Weight app={app} />}
      <Fineness app={app} />
      {typeof memory !== "number" && <Memory app={app} />}
      <Fold title={T.bind.how} open={tour !== null}>
        <p class="hint">{T.bind.harmonic}</p>
        {result && <ReportCard report={result} />}
        {report && earlier.length > 0 && (
          <div class="stack tight">
            <h3 class="section-title" data-tip={T.bind.besideSentence}>
              {T.bind.beside}
            </h3>
            <CompareTable reports={[report, ...earlier]} />
          </div>
        )}
        <Figure app={app} />
        <Ways app={app} />
        <Place app={app} />
        {typeof memory === "number" && <Memory app={app} />}
        <Advanced app={app} />
      </Fold>
    </div>
  );
}

/** Picture of the weight of the last selected handle, or of the one whose weight is seen best. */
function Weight({ app }: { app: App }) {
  const { report, selected, model } = app.store.get();
  const [picture, setPicture] = useState<string | null>(null);
  const column = selected.last ?? app.bind.clearestControl();
  useEffect(() => {
    let isCurrent = true;
    let url: string | undefined;
    void app.bind.drawWeight(...PICTURE, column).then((drawn) => {
      if (!drawn || !isCurrent) return;
      url = URL.createObjectURL(drawn);
      setPicture(url);
    });
    return () => {
      isCurrent = false;
      if (url) URL.revokeObjectURL(url);
    };
  }, [app, report, column]);
  if (!picture || isCapture(model)) return null;
  return (
    <figure class="figure">
      <img class="weight-picture" src={picture} alt="" width={PICTURE[0] / 2} height={PICTURE[1] / 2} />
      <figcaption class="hint">{T.bind.weight(column)}</figcaption>
    </figure>
  );
}

/** The number of grid cells, as a slider from coarse to fine. */
function Fineness({ app }: { app: App }) {
  const { bindOptions, bindRun } = app.store.get();
  const { grid } = bindOptions;
  const names = T.bind.finenesses;
  // A project can contain another number of cells than the panel offers.
  const place = GRIDS.findLastIndex((cells) => cells <= grid);
  return (
    <div class="stack tight">
      <Slider
        label={T.bind.fineness}
        tip={T.bind.finenessTip}
        min={0}
        max={GRIDS.length - 1}
        step={1}
        format={(k) =>
          k === 0 ? T.bind.auto : T.bind.cells(names[k - 1] ?? "", k === place ? grid : GRIDS[k])
        }
        value={place}
        onChange={(k) => app.bind.setOptions({ grid: GRIDS[k] ?? 0 })}
      />
      {hasUnappliedOptions(app.store.get()) && !bindRun && (
        <p class="memory">
          <Icon name="info" />
          {T.bind.unapplied}
        </p>
      )}
    </div>
  );
}

function Running({ run }: { run: BindRun }) {
  return (
    <section class="card stack tight" aria-label={T.bind.underWay}>
      <div class="row">
        <strong class="grow">
          {T.bind.stages[run.stage]}
          {run.pass === "coarse" && T.bind.coarseFirst}
        </strong>
        <span class="number">{percent(run.fraction)}</span>
      </div>
      <progress max="1" value={run.fraction} aria-label={T.bind.progress} />
      <p class="hint">{run.etaMs === null ? T.bind.working : timeLeft(run.etaMs)}</p>
    </section>
  );
}

/** The remaining time in words, rounded to seconds or, from one minute on, to minutes. */
export function timeLeft(ms: number): string {
  if (ms < 1500) return T.eta.second;
  const isShort = ms < 60_000;
  return T.eta.left(inUnit(Math.round(ms / (isShort ? 1000 : 60_000)), isShort ? "second" : "minute"));
}

/** Plot of the weights' change per iteration, for this bind and earlier ones by other solvers. */
function Figure({ app }: { app: App }) {
  const state = app.store.get();
  const curves = curvesOf(state).filter((curve) => curve.points.length > 0);
  const last = curves[0]?.points.at(-1);
  if (!last) return null;
  const tau = state.bindRun?.options.tau ?? state.report?.tau ?? state.bindOptions.tau;
  return (
    <figure class="figure">
      <figcaption class="section-title">{T.bind.change}</figcaption>
      <Plot curves={curves} tau={tau} />
      <ul class="curves">
        {curves.length > 1 &&
          curves.map(({ name, kind }, k) => (
            <li class={kind} key={kind}>
              {k > 0 && name === curves[0]?.name ? T.bind.before(name) : name}
            </li>
          ))}
      </ul>
      <p class="hint">{T.bind.reached(last[1], last[0])}</p>
    </figure>
  );
}

function Ways({ app }: { app: App }) {
  const { bindOptions: options } = app.store.get();
  const option = fieldsOf(options, app.bind.setOptions);
  const preset = ({ grid: _, backend: __, ...way }: BindOptions) => app.bind.setOptions(way);
  return (
    <>
      <div class="row even">
        <Button label={T.bind.ours} onClick={() => preset(BIND_DEFAULTS)} tip={T.bind.oursTip} />
        <Button label={T.bind.published} onClick={() => preset(PAPER_DEFAULTS)} tip={T.bind.publishedTip} />
      </div>
      <Segments
        label={T.bind.method}
        labels={T.bind.methods}
        tips={T.bind.methodTips}
        {...option("method")}
      />
      <Segments
        label={T.bind.solver}
        labels={T.bind.solvers}
        tips={{ cg: T.bind.cgTip }}
        {...option("solver")}
      />
      <p class="hint">{sayOptions(options)}</p>
    </>
  );
}

/** Choice between graphics card and processor. Without WebGPU it explains why only the processor is offered. */
function Place({ app }: { app: App }) {
  const { adapter, lack, bindOptions } = app.store.get();
  const { backend, solver } = bindOptions;
  const card = solver === "cg" ? T.bind.cgOnCpu : T.bind.card(adapter);
  return (
    <>
      <Segments<BindOptions["backend"]>
        label={T.bind.place}
        labels={T.bind.places}
        disabled={lack ? ["gpu"] : []}
        value={lack ? "cpu" : backend}
        onChange={(backend) => app.bind.setOptions({ backend })}
      />
      {lack && <p class="hint">{T.bind.noGpu}</p>}
      {!lack && adapter !== "" && backend !== "cpu" && <p class="hint">{card}</p>}
      {lack && (
        <div class="row">
          <Button label={T.without.title} onClick={() => app.store.set({ waysOpen: true })} />
        </div>
      )}
    </>
  );
}

function Memory({ app }: { app: App }) {
  const state = app.store.get();
  const { memory } = state;
  if (!state.cage || cageBroken(state)) return null;
  const isWrong = typeof memory !== "number";
  return (
    <div class={isWrong ? "memory bad" : "memory"}>
      <Icon name={isWrong ? "warning" : "info"} />
      <Say text={isWrong ? memory : T.bind.needs(memory)} />
    </div>
  );
}

function Advanced({ app }: { app: App }) {
  const { bindOptions: options } = app.store.get();
  const option = fieldsOf(options, app.bind.setOptions);
  return (
    <Fold title={T.bind.advanced}>
      <Slider
        label={T.bind.tau}
        {...SLIDERS.tau}
        format={(power) => `1e${power}`}
        value={Math.round(Math.log10(options.tau))}
        onChange={(power) => option("tau").onChange(10 ** power)}
      />
      <NumberField label={T.bind.limit} {...SLIDERS.max_iterations} {...option("max_iterations")} />
      <Segments
        label={T.bind.sparsify}
        values={SPARSIFY}
        labels={T.bind.sparsifies}
        value={options.sparsify === 0 ? 0 : options.sparsify < 1e-4 ? 0.00001 : 0.001}
        onChange={option("sparsify").onChange}
      />
      <Segments
        label={T.bind.outside}
        labels={T.bind.outsides}
        tips={T.bind.outsideTips}
        {...option("outside")}
      />
    </Fold>
  );
}

/** One sentence about the chosen method and solver. */
export function sayOptions({ method, solver }: BindOptions): string {
  const say = T.bind.options;
  if (solver === "cg") return say.cg;
  if (method === "embedded") return solver === "multigrid" ? say.ours : say.oursJacobi;
  return solver === "jacobi" ? say.published : say.publishedMultigrid;
}
