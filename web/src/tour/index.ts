/** The code of the tour, which is downloaded when it is first started. */

export { Card } from "./card";
export { createGuide, type Guide, type GuideNeeds } from "./guide";
