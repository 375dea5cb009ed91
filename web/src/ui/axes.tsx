/** The axes of the view: each end is a button that looks along its axis. */

import { useRef } from "preact/hooks";
import type { App } from "../app";
import { T } from "../words";
import { useFrames } from "./frame";
import { Toolbar } from "./toolbar";

const ENDS = ([0, 1, 2] as const).flatMap((axis) =>
  [false, true].map((negative) => ({ axis, negative, sign: negative ? -1 : 1 })),
);

export function Axes({ app }: { app: App }) {
  const picture = useRef<HTMLDivElement>(null);
  useFrames(app, (engine) => {
    if (picture.current) placeEnds(picture.current, engine.axes());
  });
  return (
    <Toolbar label={T.view.axes} kind="axes">
      <div ref={picture}>
        <svg viewBox="-1 -1 2 2" aria-hidden="true">
          {([0, 1, 2] as const).map((axis) => (
            <line key={axis} data-axis={axis} />
          ))}
        </svg>
        {ENDS.map(({ axis, negative }, k) => (
          <button
            key={k}
            type="button"
            class="axis-end"
            data-axis={axis}
            data-negative={negative ? "" : undefined}
            aria-label={T.view.from[k]}
            data-tip={T.view.from[k]}
            onClick={() => app.ctx.engine().axisView(axis, negative)}
          >
            {negative ? "" : T.axes[axis]}
          </button>
        ))}
      </div>
    </Toolbar>
  );
}

/** Moves buttons and lines to the ends of the axes. `axes`: components right, up and towards the eye, for each axis. */
function placeEnds(picture: HTMLElement, axes: Float32Array): void {
  for (const [axis, line] of picture.querySelectorAll("line").entries()) {
    line.setAttribute("x2", String(axes[3 * axis]));
    line.setAttribute("y2", String(-(axes[3 * axis + 1] ?? 0)));
  }
  const ends = picture.querySelectorAll<HTMLElement>(".axis-end");
  for (const [k, { axis, sign }] of ENDS.entries()) {
    const [right = 0, up = 0, near = 0] = Array.from(axes.subarray(3 * axis, 3 * axis + 3), (x) => sign * x);
    const end = ends[k];
    if (!end) continue;
    end.style.setProperty("--right", String(right));
    end.style.setProperty("--up", String(up));
    end.style.zIndex = String(Math.round(10 * near) + 10);
  }
}
