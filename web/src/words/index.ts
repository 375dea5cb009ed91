/** The language of the page. To add a language, translate the folder en/ and add a line to `LANGUAGES`. */

import { setLocale } from "../format";
import { EN } from "./en";

/** The locale and sentences of a language. */
export type Language = typeof EN;

const LANGUAGES = new Map<string, () => Promise<Language>>([
  ["en", async () => EN],
  ["pseudo", async () => (await import("./pseudo")).PSEUDO_LANGUAGE],
]);

let language = EN;
/** The sentences of the page in the selected language. */
export let T = EN.words;
/** The sentences of the tour, after `loadTour`. */
export let TOUR: Awaited<ReturnType<Language["tourWords"]>>;
/** The sentences of the shortcut sheet, after `loadSheet`. */
export let SHEET: Awaited<ReturnType<Language["sheetWords"]>>;
/** The sentences of the gallery, after `loadGallery`. */
export let GALLERY: Awaited<ReturnType<Language["galleryWords"]>>;

/** Selects the language that the address names (`?lang=`), or else the first available one of the browser's list. */
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

export async function loadSheet(): Promise<void> {
  SHEET = await language.sheetWords();
}

export async function loadGallery(): Promise<void> {
  GALLERY = await language.galleryWords();
}
