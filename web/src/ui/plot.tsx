/**
 * Live plot of the weights' change per iteration on a logarithmic scale, like figure 7 of K. Smith's paper
 * (docs/method.md).
 */

import { count } from "../format";
import { T } from "../words";

export interface Curve {
  name: string;
  points: readonly (readonly [iteration: number, delta: number])[];
  /** CSS class that determines the colour of the curve. */
  kind: (typeof KINDS)[number];
}

/** Class names of the curves: the current bind, and two earlier binds to compare with it. */
export const KINDS = ["now", "before", "earlier"] as const;

/**
 * If the longest curve has more than this many times the iterations of the shortest, the horizontal axis is
 * logarithmic. On a linear axis the short curve would look like a vertical line.
 */
const MIN_LENGTH_RATIO = 20;

/** Size and margins of the plot, in units of the `viewBox`. */
const WIDTH = 328;
const HEIGHT = 168;
const LEFT_MARGIN = 38;
const RIGHT_MARGIN = 8;
const TOP_MARGIN = 8;
const BOTTOM_MARGIN = 26;

export interface Scale {
  lowest: number;
  highest: number;
  last: number;
  /** Whether the horizontal axis is logarithmic. */
  logarithmic: boolean;
}

/**
 * Computes the ranges of the axes. The vertical axis extends between powers of ten that enclose all deltas and the
 * threshold, the horizontal axis to the last iteration.
 */
export function scaleOf(curves: readonly Curve[], tau: number): Scale {
  const deltas = curves
    .flatMap((curve) => curve.points.map(([, delta]) => delta))
    .filter((delta) => delta > 0);
  const lasts = curves.flatMap((curve) => curve.points.at(-1)?.[0] ?? []);
  const last = Math.max(1, ...lasts);
  const all = tau > 0 ? [...deltas, tau] : deltas;
  const lowest = Math.floor(Math.log10(Math.min(...all, 1)));
  const highest = Math.ceil(Math.log10(Math.max(...all, 1e-9)));
  return {
    lowest,
    highest: Math.max(highest, lowest + 1),
    last,
    logarithmic: last > MIN_LENGTH_RATIO * Math.min(...lasts),
  };
}

export function Plot({ curves, tau }: { curves: readonly Curve[]; tau: number }) {
  const { lowest, highest, last, logarithmic } = scaleOf(curves, tau);
  const along = (iteration: number) =>
    logarithmic ? Math.log(Math.max(1, iteration)) / Math.log(last) : iteration / last;
  const x = (iteration: number) => LEFT_MARGIN + along(iteration) * (WIDTH - LEFT_MARGIN - RIGHT_MARGIN);
  const y = (delta: number) => {
    const share = (Math.log10(Math.max(delta, 1e-30)) - lowest) / (highest - lowest);
    return HEIGHT - BOTTOM_MARGIN - Math.min(1, Math.max(0, share)) * (HEIGHT - TOP_MARGIN - BOTTOM_MARGIN);
  };
  const stride = Math.ceil((highest - lowest) / 5);
  const powers = Array.from(
    { length: Math.floor((highest - lowest) / stride) + 1 },
    (_, k) => lowest + k * stride,
  );
  const now = curves.find((curve) => curve.kind === "now")?.points.at(-1);
  const bottom = HEIGHT - 8;
  const right = WIDTH - RIGHT_MARGIN;
  return (
    <svg
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      class="plot"
      role="img"
      aria-label={T.bind.plot(now ? T.bind.reached(now[1], now[0]) : "")}
    >
      {powers.map((power) => (
        <g key={power}>
          <line x1={LEFT_MARGIN} x2={right} y1={y(10 ** power)} y2={y(10 ** power)} class="grid" />
          <Label x={LEFT_MARGIN - 6} y={y(10 ** power) + 3.5} text={`1e${power}`} anchor="end" />
        </g>
      ))}
      <Label x={LEFT_MARGIN} y={bottom} text={logarithmic ? "1" : "0"} anchor="middle" />
      <Label x={right} y={bottom} text={count(last)} anchor="end" />
      <Label
        x={(LEFT_MARGIN + right) / 2}
        y={bottom}
        text={logarithmic ? T.bind.iterationsLogarithmic : T.bind.iterations}
        anchor="middle"
      />
      {tau > 0 && <line x1={LEFT_MARGIN} x2={right} y1={y(tau)} y2={y(tau)} class="tau" />}
      {curves.map(({ kind, points }) => {
        const line = points.map(([i, delta]) => [x(i), y(delta)] as const);
        const end = line.at(-1);
        if (!end) return null;
        return (
          <g key={kind}>
            <polyline
              points={line.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ")}
              class={`curve ${kind}`}
            />
            <circle cx={end[0]} cy={end[1]} r={3} class={`point ${kind}`} />
          </g>
        );
      })}
      {/* The key of the threshold's line is in the upper right corner, because curves fall. */}
      {tau > 0 && (
        <>
          <line x1={right - 20} x2={right} y1={TOP_MARGIN + 8} y2={TOP_MARGIN + 8} class="tau" />
          <Label x={right - 24} y={TOP_MARGIN + 11.5} text={T.bind.doneBelow} anchor="end" />
        </>
      )}
    </svg>
  );
}

function Label(props: { x: number; y: number; text: string; anchor: "middle" | "end" }) {
  const { x, y, text, anchor } = props;
  return (
    <text x={x} y={y} text-anchor={anchor}>
      {text}
    </text>
  );
}

/** Points of the curve of a report. Consecutive entries of `history` are `interval` iterations apart. */
export function historyPoints(history: readonly number[], interval: number): Curve["points"] {
  return history
    .map((delta, index) => [(index + 1) * Math.max(1, interval), delta] as const)
    .filter(([, delta]) => delta > 0);
}
