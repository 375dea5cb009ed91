/** The way to the tour, which is downloaded when somebody takes it. */

import type { Guide, GuideNeeds, Loaded } from "../tour";
import { T } from "../words";
import { attempt, type Context } from "./context";

export interface TourActions {
  /** Begins at a stop, counted from 0, or where it was left. */
  start(stop?: number): Promise<void>;
  /** Drives it, and what shows it; nothing before it has begun. */
  loaded(): Loaded | undefined;
  /** Where it is on. */
  guide(): Guide | undefined;
}

export function createTour(ctx: Context, needs: GuideNeeds): TourActions {
  let loaded: Loaded | undefined;
  return {
    async start(stop) {
      await attempt(ctx, T.failed.tour, async () => {
        loaded ??= (await import("../tour")).load(ctx, needs);
        await loaded.guide.start(stop);
      });
    },
    loaded: () => loaded,
    guide: () => (ctx.store.get().tour ? loaded?.guide : undefined),
  };
}

/** The stop that a link leads to, from 0. */
export function stopOf(fragment: string): number | undefined {
  const said = new URLSearchParams(fragment.slice(1)).get("tour");
  return said === null ? undefined : Math.max(0, (Number.parseInt(said, 10) || 1) - 1);
}

export const linkOf = (stop: number): string => `#tour=${stop + 1}`;
