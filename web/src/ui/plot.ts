/** The change per iteration, on a logarithmic scale: the paper's figure 7, drawn live. */

import { count, scientific } from "../format";
import { svg } from "./dom";

export interface Curve {
  name: string;
  points: readonly (readonly [iteration: number, delta: number])[];
  /** Class for the colour. */
  kind: (typeof KINDS)[number];
}

/** The bind of the moment, and two to compare it with. */
export const KINDS = ["now", "before", "earlier"] as const;

/** From so many times as many iterations on, curves are drawn over their logarithm: the short one would be a stroke. */
const FAR_APART = 20;

const WIDTH = 328;
const HEIGHT = 168;
const LEFT = 38;
const RIGHT = 8;
const TOP = 8;
const BOTTOM = 26;
/** Height of a line of text. */
const LABEL = 11;

export interface Scale {
  lowest: number;
  highest: number;
  last: number;
  /** Whether iterations are on a logarithmic scale, too. */
  logarithmic: boolean;
}

/** Powers of ten and iterations that hold all points and the threshold. */
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
    logarithmic: last > FAR_APART * Math.min(...lasts),
  };
}

/** Draws into `element`, in place of what was there. */
export function drawPlot(element: SVGSVGElement, curves: readonly Curve[], tau: number): void {
  const scale = scaleOf(curves, tau);
  const along = ({ last, logarithmic }: Scale, iteration: number) =>
    logarithmic ? Math.log(Math.max(1, iteration)) / Math.log(last) : iteration / last;
  const x = (iteration: number) => LEFT + along(scale, iteration) * (WIDTH - LEFT - RIGHT);
  const y = (delta: number) => {
    const share = (Math.log10(delta) - scale.lowest) / (scale.highest - scale.lowest);
    return HEIGHT - BOTTOM - Math.min(1, Math.max(0, share)) * (HEIGHT - TOP - BOTTOM);
  };
  const parts: Node[] = [];
  const stride = Math.ceil((scale.highest - scale.lowest) / 5);
  for (let power = scale.lowest; power <= scale.highest; power += stride) {
    const at = y(10 ** power);
    parts.push(
      svg("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: at, y2: at, class: "grid" }),
      label(LEFT - 6, at + 3.5, `1e${power}`, "end"),
    );
  }
  parts.push(
    label(LEFT, HEIGHT - 8, scale.logarithmic ? "1" : "0", "middle"),
    label(WIDTH - RIGHT, HEIGHT - 8, count(scale.last), "end"),
    label(
      (LEFT + WIDTH - RIGHT) / 2,
      HEIGHT - 8,
      scale.logarithmic ? "iterations, logarithmic" : "iterations",
      "middle",
    ),
  );
  if (tau > 0) {
    // Below the line where there is room: curves come from above.
    const above = y(tau) > HEIGHT - BOTTOM - LABEL;
    parts.push(
      svg("line", { x1: LEFT, x2: WIDTH - RIGHT, y1: y(tau), y2: y(tau), class: "tau" }),
      // Where curves are still high: on the left, or on the right where the short ones end on the left.
      scale.logarithmic
        ? label(WIDTH - RIGHT - 4, y(tau) + (above ? -4 : LABEL), "done below this", "end")
        : label(LEFT + 4, y(tau) + (above ? -4 : LABEL), "done below this", "start"),
    );
  }
  for (const curve of curves) {
    if (curve.points.length === 0) continue;
    const points = curve.points.map(
      ([i, delta]) => `${x(i).toFixed(1)},${y(Math.max(delta, 1e-30)).toFixed(1)}`,
    );
    parts.push(svg("polyline", { points: points.join(" "), class: `curve ${curve.kind}` }));
    const end = curve.points.at(-1);
    if (end) parts.push(svg("circle", { cx: x(end[0]), cy: y(end[1]), r: 3, class: `point ${curve.kind}` }));
  }
  const now = curves.find((curve) => curve.kind === "now")?.points.at(-1);
  element.setAttribute(
    "aria-label",
    now
      ? `Change per iteration, logarithmic: ${scientific(now[1])} after ${count(now[0])} iterations`
      : "Change per iteration, logarithmic",
  );
  element.replaceChildren(...parts);
}

function label(x: number, y: number, text: string, anchor: "start" | "middle" | "end"): SVGTextElement {
  const element = svg("text", { x, y, "text-anchor": anchor });
  element.textContent = text;
  return element;
}

export function createPlot(): SVGSVGElement {
  return svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "plot", role: "img" });
}

/** A report's history as points; `interval` iterations lie between two entries. */
export function historyPoints(history: readonly number[], interval: number): Curve["points"] {
  return history
    .map((delta, index) => [(index + 1) * Math.max(1, interval), delta] as const)
    .filter(([, delta]) => delta > 0);
}
