/** Entry point of the tour, which is downloaded when it is first started. */

import type { FunctionComponent } from "preact";
import type { Context } from "../actions/context";
import type { App } from "../app";
import type { TourState } from "../state";
import { Card } from "./card";
import { createGuide, type Guide, type GuideNeeds } from "./guide";

export type { Guide, GuideNeeds } from "./guide";

/** The guide of the tour, and the component that draws its card. */
export interface TourParts {
  readonly guide: Guide;
  readonly Card: FunctionComponent<{ app: App; tour: TourState; guide: Guide }>;
}

export function load(ctx: Context, needs: GuideNeeds): TourParts {
  return { guide: createGuide(ctx, needs), Card };
}
