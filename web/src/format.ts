/** Numbers as people read them. */

const INTEGER = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

/** 12345 -> "12,345". */
export function count(value: number): string {
  return INTEGER.format(value);
}

/** 1 vertex, 2 vertices. */
export function plural(value: number, one: string, many = `${one}s`): string {
  return `${count(value)} ${value === 1 ? one : many}`;
}

/** Bytes in the unit that leaves one to three digits before the point: 1536 -> "1.5 KB". */
export function bytes(value: number): string {
  const units = ["B", "KB", "MB", "GB", "TB"] as const;
  let scaled = value;
  let unit = 0;
  while (scaled >= 1000 && unit < units.length - 1) {
    scaled /= 1000;
    unit += 1;
  }
  const digits = unit === 0 || scaled >= 100 ? 0 : 1;
  return `${scaled.toFixed(digits)} ${units[unit]}`;
}

/** Milliseconds as a duration: 45 -> "45 ms", 1234 -> "1.2 s", 90000 -> "1 min 30 s". */
export function duration(ms: number): string {
  if (ms < 1) return `${ms.toFixed(2)} ms`;
  if (ms < 999.5) return `${Math.round(ms)} ms`;
  if (ms < 59_950) return `${(ms / 1000).toFixed(1)} s`;
  const seconds = Math.round(ms / 1000);
  return `${Math.floor(seconds / 60)} min ${seconds % 60} s`;
}

/** Time left, rounded as one would say it: never more exact than it can be. */
export function timeLeft(ms: number): string {
  if (ms < 1500) return "about a second left";
  if (ms < 60_000) return `about ${Math.round(ms / 1000)} s left`;
  return `about ${Math.round(ms / 60_000)} min left`;
}

/** Small or large numbers with three digits: 0.000123 -> "1.23e-4", 0 -> "0". */
export function scientific(value: number): string {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 0.01 && size < 10_000) return String(Number(value.toPrecision(3)));
  const [mantissa, exponent] = value.toExponential(2).split("e");
  return `${Number(mantissa)}e${Number(exponent)}`;
}

/** A share of one as percent. */
export function percent(share: number): string {
  return `${Math.round(Math.min(1, Math.max(0, share)) * 100)} %`;
}

/** A coordinate as a field shows it, at every scale: five significant digits, no trailing zeros, no minus zero. */
export function coordinate(value: number): string {
  return String(value === 0 ? 0 : Number(value.toPrecision(5)));
}

/** A file's name without its extension, or both of a project's. */
export function stem(name: string): string {
  const base = (name.split(/[\\/]/).at(-1) ?? name).replace(/\.cagework(\.glb)?$/i, "");
  const dot = base.lastIndexOf(".");
  return dot > 0 ? base.slice(0, dot) : base;
}
