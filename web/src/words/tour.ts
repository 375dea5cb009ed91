/** What the tour says, in the language of the page; apart from the rest, because only who takes it needs it. */

export { EN_TOUR as TOUR } from "./en/tour";
