/** The language of the page. To add a language, translate the folder en/ and add a line to `LANGUAGES`. */

import { setLocale } from "../format";
import { EN } from "./en";

/** The locale and sentences of a language. */
export type Language = typeof EN;

const LANGUAGES = new Map<string, () => Promise<Language>>([
  ["en", async () => EN],
  ["pseudo", async () => (await import("./pseudo")).PSEUDO],
]);

let language = EN;
/** The sentences of the page. */
export let T = EN.words;
/** The sentences of the tour, after `loadTour`. */
export let TOUR: Awaited<ReturnType<Language["tourWords"]>>;

/** Selects the language that the address asks for (`?lang=`), or else the first one that the browser prefers. */
export async function chooseLanguage(): Promise<void> {
  const asked = new URLSearchParams(location.search).get("lang") ?? "";
  const preferred = navigator.languages.map((tag) => tag.replace(/-.*/, ""));
  const name = [asked, ...preferred].find((name) => LANGUAGES.has(name));
  // Without a connection, a language that was never downloaded is missing: use English.
  language = (await LANGUAGES.get(name ?? "en")?.().catch(() => undefined)) ?? EN;
  T = language.words;
  setLocale(language.locale);
  document.documentElement.lang = language.locale;
}

export async function loadTour(): Promise<void> {
  TOUR = await language.tourWords();
}
