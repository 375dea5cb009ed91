/** Formats numbers in the language of the page. */

import { MODEL_ENDINGS } from "./defaults";

/** Language tag of the page, which words/index.ts sets. */
export let LOCALE = "en";

const formats = () => ({
  integer: new Intl.NumberFormat(LOCALE, { maximumFractionDigits: 0 }),
  digits: new Intl.NumberFormat(LOCALE, { maximumSignificantDigits: 3, useGrouping: false }),
  decimals: new Intl.NumberFormat(LOCALE, {
    maximumFractionDigits: 3,
    useGrouping: false,
    signDisplay: "negative",
  }),
  list: new Intl.ListFormat(LOCALE),
  plural: new Intl.PluralRules(LOCALE),
});
let format = formats();

export function setLocale(locale: string): void {
  LOCALE = locale;
  format = formats();
}

/** Formats a number with its unit: 3, "minute" -> "3 min". */
export function inUnit(value: number, unit: string, maximumFractionDigits = 0): string {
  return new Intl.NumberFormat(LOCALE, {
    style: "unit",
    unit,
    unitDisplay: "short",
    maximumFractionDigits,
  }).format(value);
}

/** Formats an integer: 12345 -> "12,345". */
export function count(value: number): string {
  return format.integer.format(value);
}

/** Formats a count with its noun: 1 -> "1 vertex", 2 -> "2 vertices". */
export function plural(value: number, one: string, many = `${one}s`): string {
  return `${count(value)} ${format.plural.select(value) === "one" ? one : many}`;
}

/** Lists the extensions of model files: ".glb, .obj, and .stl". */
export function endings(type: "conjunction" | "disjunction"): string {
  return new Intl.ListFormat(LOCALE, { type }).format(MODEL_ENDINGS.map((ending) => `.${ending}`));
}

/** Joins names with commas and "and": "a, b, and c". */
export function list(names: readonly string[]): string {
  return format.list.format(names);
}

/** Formats a number of bytes in the largest unit that leaves at least 1: 1536 -> "1.5 kB". */
export function bytes(value: number): string {
  const units = ["byte", "kilobyte", "megabyte", "gigabyte", "terabyte"] as const;
  // Round before the unit is chosen, so that 999,600 bytes are not "1000 kB".
  const rounded = Math.max(1, Number(value.toPrecision(3)));
  const power = Math.min(units.length - 1, Math.floor(Math.log10(rounded) / 3));
  const scaled = value / 1000 ** power;
  return inUnit(scaled, units[power] ?? "byte", power === 0 || scaled >= 100 ? 0 : 1);
}

/** Formats milliseconds as a duration: 45 -> "45 ms", 1234 -> "1.2 sec", 90000 -> "1 min 30 sec". */
export function duration(ms: number): string {
  if (ms < 999.5) return inUnit(ms, "millisecond", ms < 1 ? 2 : 0);
  if (ms < 59_950) return inUnit(ms / 1000, "second", 1);
  const seconds = Math.round(ms / 1000);
  return `${inUnit(Math.floor(seconds / 60), "minute")} ${inUnit(seconds % 60, "second")}`;
}

/**
 * Formats a number with three significant digits, and with an exponent if it is small or large: 0.000123 -> "1.23e-4".
 */
export function scientific(value: number): string {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 0.01 && size < 10_000) return format.digits.format(value);
  const [mantissa, exponent] = value.toExponential(2).split("e");
  return `${format.digits.format(Number(mantissa))}e${Number(exponent)}`;
}

/** Formats a number with at most three decimals: -0.00012 -> "0". */
export function decimals(value: number): string {
  return format.decimals.format(value);
}

/** Formats a fraction as a percentage, clamped to the range from 0 to `max`, by default 100 %. */
export function percent(share: number, maximumFractionDigits = 0, max = 1): string {
  const clamped = Math.min(max, Math.max(0, share));
  return new Intl.NumberFormat(LOCALE, { style: "percent", maximumFractionDigits }).format(clamped);
}

/** Number of characters that fit into a number field of the panel. */
const FIELD = 9;

/**
 * Formats a coordinate for a number field: up to five significant digits, no trailing zeros, no negative zero. Values
 * below 1e-6 of `size`, the size of the object, are rounding errors and become zero.
 */
export function coordinate(value: number, size = 0): string {
  if (Math.abs(value) <= 1e-6 * size) return "0";
  const rounded = [5, 4, 3].map((digits) => String(Number(value.toPrecision(digits))));
  return rounded.find((text) => text.length <= FIELD) ?? scientific(value);
}

/**
 * Returns the name of a file without its extension. The extension of a project, `.cagework.glb`, is removed as a whole.
 */
export function stem(name: string): string {
  const base = (name.split(/[\\/]/).at(-1) ?? name).replace(/\.cagework(\.glb)?$/i, "");
  const dot = base.lastIndexOf(".");
  return dot > 0 ? base.slice(0, dot) : base;
}

/** Returns the stem of exported files: without the endings of earlier exports, which would otherwise accumulate. */
export function exportStem(name: string): string {
  return stem(name).replace(/(?<=.)(-pose[ds])+$/i, "");
}
