/** The tour's sentences. Not in index.ts, so that they are downloaded only when the tour starts. */

export { EN_TOUR as TOUR } from "./en/tour";
