/** Amounts typed while something is moved. */

/** The typed amount after a key: digits, one point, a sign that any minus turns, backspace. */
export function nextAmount(typed: string, key: string): string | undefined {
  if (/^\d$/.test(key)) return typed + key;
  if (key === "." || key === ",") return typed.includes(".") ? typed : `${typed}.`;
  if (key === "-") return typed.startsWith("-") ? typed.slice(1) : `-${typed}`;
  if (key === "Backspace") return typed.slice(0, -1);
  return undefined;
}
