/** The language of the page. */

import { EN, type Words } from "./en";

export const T: Words = EN;
