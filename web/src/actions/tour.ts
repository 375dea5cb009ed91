/** Starts the tour, whose code is downloaded at the first start. */

import { loadPart } from "@cagework/core/session/parts";
import type { TourPlace } from "../state";
import type { Guide, GuideNeeds } from "../tour";
import { loadTour, T } from "../words";
import { attempt, type Context } from "./context";

export function createTour(ctx: Context, needs: GuideNeeds) {
  /** The guide of the tour, and the component that draws its card. */
  let loaded: { readonly guide: Guide; readonly Card: typeof import("../tour").Card } | undefined;
  return {
    /** Starts a tour at a stop, by default where the user left it. */
    async start(place?: TourPlace) {
      await attempt(ctx, T.failed.tour, async () => {
        const [{ Card, createGuide }] = await loadPart(Promise.all([import("../tour"), loadTour()]));
        loaded ??= { guide: createGuide(ctx, needs), Card };
        await loaded.guide.start(place);
      });
    },
    /** The downloaded code of the tour; undefined before the first start. */
    loaded: () => loaded,
    /** The guide of the tour in progress; undefined otherwise. */
    guide: (): Guide | undefined => (ctx.store.get().tour ? loaded?.guide : undefined),
  };
}
