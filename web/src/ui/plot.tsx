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
/** Height of a text line, and width reserved for a letter, with or without accents, in units of the `viewBox`. */
const LABEL = 11;
const LETTER_WIDTH = 5.8;

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

/** A point of the plot, in units of its `viewBox`. */
export type Place = readonly [x: number, y: number];

/**
 * Finds a position for the label of the threshold: the left end of its baseline. Tries positions below and above the
 * threshold's line, which is at height `at`, and returns the first that no curve crosses, or else the first of all.
 */
export function placeLabel(lines: readonly (readonly Place[])[], at: number, width: number) {
  const right = WIDTH - RIGHT_MARGIN - 4 - width;
  const places = [LEFT_MARGIN + 4, right, (LEFT_MARGIN + right) / 2].flatMap((x) =>
    [at + LABEL, at - 4]
      .filter((y) => y <= HEIGHT - BOTTOM_MARGIN && y >= TOP_MARGIN + LABEL)
      .map((y) => ({ x, y })),
  );
  const isFree = ({ x, y }: { x: number; y: number }) =>
    lines.every((line) => {
      const heights = heightsBetween(line, x - 3, x + width + 3);
      return heights.every((one) => one > y + 4) || heights.every((one) => one < y - LABEL);
    });
  return places.find(isFree) ?? places[0] ?? { x: LEFT_MARGIN + 4, y: at - 4 };
}

/** Finds the heights of a polyline between two horizontal positions: at its corners and at both positions. */
function heightsBetween(line: readonly Place[], from: number, to: number): number[] {
  const heights = line.filter(([x]) => x >= from && x <= to).map(([, y]) => y);
  for (const at of [from, to]) {
    const next = line.findIndex(([x]) => x >= at);
    const [a, b] = [line[next - 1], line[next]];
    if (a && b) heights.push(a[1] + ((b[1] - a[1]) * (at - a[0])) / (b[0] - a[0]));
  }
  return heights;
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
  const middle = (LEFT_MARGIN + WIDTH - RIGHT_MARGIN) / 2;
  const lines = curves.map(({ points }) => points.map(([i, delta]): Place => [x(i), y(delta)]));
  const label = placeLabel(lines, y(tau), T.bind.doneBelow.length * LETTER_WIDTH);
  return (
    <svg
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      class="plot"
      role="img"
      aria-label={T.bind.plot(now ? T.bind.reached(now[1], now[0]) : "")}
    >
      {powers.map((power) => (
        <g key={power}>
          <line
            x1={LEFT_MARGIN}
            x2={WIDTH - RIGHT_MARGIN}
            y1={y(10 ** power)}
            y2={y(10 ** power)}
            class="grid"
          />
          <Label x={LEFT_MARGIN - 6} y={y(10 ** power) + 3.5} text={`1e${power}`} anchor="end" />
        </g>
      ))}
      <Label x={LEFT_MARGIN} y={bottom} text={logarithmic ? "1" : "0"} anchor="middle" />
      <Label x={WIDTH - RIGHT_MARGIN} y={bottom} text={count(last)} anchor="end" />
      <Label
        x={middle}
        y={bottom}
        text={logarithmic ? T.bind.iterationsLogarithmic : T.bind.iterations}
        anchor="middle"
      />
      {tau > 0 && (
        <>
          <line x1={LEFT_MARGIN} x2={WIDTH - RIGHT_MARGIN} y1={y(tau)} y2={y(tau)} class="tau" />
          <Label x={label.x} y={label.y} text={T.bind.doneBelow} anchor="start" />
        </>
      )}
      {curves.map(({ kind }, k) => {
        const line = lines[k] ?? [];
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
    </svg>
  );
}

function Label({
  x,
  y,
  text,
  anchor,
}: {
  x: number;
  y: number;
  text: string;
  anchor: "start" | "middle" | "end";
}) {
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
