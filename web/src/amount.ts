/** The amount that is typed during a gesture, such as "-0.5". */

/**
 * Returns the typed text after a key press: digits append, one decimal point is allowed, minus toggles the sign,
 * Backspace deletes. Undefined for other keys.
 */
export function nextAmount(typed: string, key: string): string | undefined {
  if (/^\d$/.test(key)) return typed + key;
  if (key === "." || key === ",") return typed.includes(".") ? typed : `${typed}.`;
  if (key === "-") return typed.startsWith("-") ? typed.slice(1) : `-${typed}`;
  if (key === "Backspace") return typed.slice(0, -1);
  return undefined;
}
