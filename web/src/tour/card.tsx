/** The card of the tour below the view: title, explanation, task and measurements of the current stop. */

import { useLayoutEffect, useRef } from "preact/hooks";
import { copyLink } from "../actions/exports";
import type { App } from "../app";
import type { TourState } from "../state";
import { Button, IconButton, Segments } from "../ui/controls";
import { T, TOUR } from "../words";
import { TourFigure } from "./figures";
import type { Guide } from "./guide";
import { STOPS, type StopName } from "./stops";

export function Card({ app, tour, guide }: { app: App; tour: TourState; guide: Guide }) {
  const { name: tourName, stop, reports, doing } = tour;
  const stops = STOPS[tourName];
  const card = useRef<HTMLElement>(null);
  useLayoutEffect(() => {
    // Focus the main button, so that the tour can continue by keyboard.
    card.current?.querySelector<HTMLElement>(".primary")?.focus();
  }, []);
  const name: StopName = stops[stop] ?? "pull";
  const { title, claim, task, alone } = TOUR.stops[name];
  const go = (to: number) => void guide.go(to);
  const isLast = stop === stops.length - 1;
  return (
    <section
      class={`tour tour-${tourName}${isLast ? " tour-last" : ""}`}
      aria-label={TOUR.name}
      aria-busy={doing !== null}
      ref={card}
    >
      <div class="tour-head">
        <Segments
          label={TOUR.name}
          hideLabel
          values={["first", "how"]}
          labels={TOUR.names}
          value={tourName}
          onChange={(other) => void guide.go(0, other)}
        />
        <span class="tour-count">{TOUR.of(stop + 1, stops.length)}</span>
        <h2>{title}</h2>
        <Stops stops={stops} now={stop} go={go} />
        <div class="tour-ways">
          <Button label={TOUR.back} onClick={() => go(stop - 1)} disabled={stop === 0} />
          <Button
            label={isLast ? TOUR.finish : TOUR.next}
            onClick={() => go(stop + 1)}
            kind="small primary"
          />
          <IconButton
            icon="share"
            label={TOUR.link}
            onClick={() => void copyLink(app.ctx, location.href, T.tour.copied)}
            kind="small"
          />
          <IconButton
            icon="close"
            label={TOUR.leave}
            shortcut={app.key("cancel")}
            onClick={() => void guide.end()}
            kind="small"
          />
        </div>
      </div>
      <div class="tour-body">
        <div class="tour-text" aria-live="polite">
          <p class="claim">{claim(reports)}</p>
          <p class="task">
            <strong>{TOUR.task}</strong> {task}
          </p>
          <p class="task alone">
            <strong>{TOUR.alone}</strong> {alone}
          </p>
          {doing && doing[0] > 0 && <p class="hint">{TOUR.doing(...doing)}</p>}
        </div>
        <TourFigure app={app} name={name} reports={reports} guide={guide} />
      </div>
    </section>
  );
}

/** Buttons for all stops, drawn as dots. */
function Stops({ stops, now, go }: { stops: readonly StopName[]; now: number; go: (stop: number) => void }) {
  return (
    <nav class="tour-stops" aria-label={TOUR.all}>
      {stops.map((name, k) => (
        <button
          key={name}
          type="button"
          aria-label={TOUR.stop(k + 1, TOUR.stops[name].title)}
          data-tip={TOUR.stops[name].title}
          aria-current={k === now ? "step" : undefined}
          onClick={() => go(k)}
        />
      ))}
    </nav>
  );
}
