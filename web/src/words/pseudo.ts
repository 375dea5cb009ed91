/**
 * A language for tests, made from the English sentences: letters are accented and words 40 % longer. Text that the page
 * shows without accents does not come from words/.
 */

import type { Language } from ".";
import { EN } from "./en";

const LETTERS = new Map(
  [..."áƀçðéƒĝĥîĵķļɱñöþǫŕšţûṽŵẋýžÅƁÇÐÉƑĜĤÎĴĶĻṀÑÖÞǪŔŠŢÛṼŴẊÝŽ"].map((accented, i) => [
    String.fromCharCode((i < 26 ? 97 : 65 - 26) + i),
    accented,
  ]),
);

/** Accents a text, except the product's name, and lengthens each word by 40 %. */
function accent(text: string): string {
  return text.replace(/[a-z]+/gi, (word) => {
    if (word === EN.words.product) return word;
    const longer = word + word.slice(0, Math.round(0.4 * word.length)).toLowerCase();
    return longer.replace(/[a-z]/gi, (letter) => LETTERS.get(letter) ?? letter);
  });
}

/**
 * Accents the result of a sentence function, but not the strings that it inserts. The function is called with a
 * character of the private use area in place of each string; these characters are replaced afterwards.
 */
function accentResult(sentence: (...values: unknown[]) => unknown, values: unknown[]): unknown {
  const kept: string[] = [];
  const hide = (value: unknown): unknown => {
    if (Array.isArray(value)) return value.map(hide);
    if (typeof value !== "string" || value === "") return value;
    return String.fromCharCode(0xdfff + kept.push(value));
  };
  const result = sentence(...values.map(hide));
  if (typeof result !== "string") return result;
  return accent(result).replace(/[\ue000-\uf8ff]/g, (sign) => kept[sign.charCodeAt(0) - 0xe000] ?? "");
}

/** Copies a catalogue of sentences, with accents. */
export function pseudo<T>(words: T): T {
  const change = (value: unknown): unknown => {
    if (typeof value === "string") return accent(value);
    if (typeof value === "function") return (...values: unknown[]) => accentResult(value as never, values);
    if (Array.isArray(value)) return value.map(change);
    if (typeof value !== "object" || value === null) return value;
    return Object.fromEntries(Object.entries(value).map(([key, inner]) => [key, change(inner)]));
  };
  return change(words) as T;
}

export const PSEUDO_LANGUAGE: Language = {
  // Greek, because its numbers, units and lists differ from English ones.
  locale: "el",
  words: pseudo(EN.words),
  tourWords: async () => pseudo(await EN.tourWords()),
  sheetWords: async () => pseudo(await EN.sheetWords()),
  galleryWords: async () => pseudo(await EN.galleryWords()),
};
