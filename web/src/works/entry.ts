/** Work that this browser keeps: what is known of each piece, besides its file. */

import { LOCALE } from "../format";
import { T } from "../words";

export interface Entry {
  readonly id: string;
  /** The model's. */
  readonly name: string;
  /** When it was kept last, ms since 1970. */
  readonly when: number;
  /** Of the project file, bytes. */
  readonly size: number;
  /** The page stopped twice with it: it is not opened by itself. */
  readonly stopped?: true;
}

/** An entry, and which tab has it open: this one, another one, or none. */
export interface Work extends Entry {
  readonly where: "here" | "elsewhere" | "nowhere";
}

const DAY_MS = 86_400_000;
/** How long work is kept after its last change. */
export const KEPT_DAYS = 30;

/** Text that a GLB begins with, and where its length is (glTF 2.0, section 4.4.1). */
const GLB = 0x46546c67;
const GLB_LENGTH_AT = 8;
const GLB_HEAD = 12;

export function isEntry(value: unknown): value is Entry {
  if (typeof value !== "object" || value === null) return false;
  const { id, name, when, size } = value as Partial<Entry>;
  return (
    typeof id === "string" &&
    typeof name === "string" &&
    Number.isFinite(when) &&
    Number.isSafeInteger(size) &&
    (size ?? 0) >= 0
  );
}

/** Whether something is all of a project file, by its own word. */
export function isWhole(file: unknown): file is Uint8Array {
  if (!(file instanceof Uint8Array) || file.length < GLB_HEAD) return false;
  const view = new DataView(file.buffer, file.byteOffset, file.byteLength);
  return view.getUint32(0, true) === GLB && view.getUint32(GLB_LENGTH_AT, true) === file.length;
}

export function isExpired({ when }: Entry, now: number): boolean {
  return now - when > KEPT_DAYS * DAY_MS;
}

export function newestFirst<T extends Entry>(entries: readonly T[]): T[] {
  return [...entries].sort((a, b) => b.when - a.when);
}

/**
 * What a visit opens by itself: what this tab had open when it was loaded again (the page before may still hold it), or else
 * the only work that no other tab has open. Never what the page has stopped with.
 */
export function toOpen(works: readonly Work[], own: string | null): Work | undefined {
  const free = works.filter(({ where }) => where !== "elsewhere");
  const chosen = works.find(({ id }) => id === own) ?? (free.length === 1 ? free[0] : undefined);
  return chosen?.stopped ? undefined : chosen;
}

/** How long ago, in words. */
export function ago(ms: number): string {
  const minutes = Math.round(ms / 60_000);
  if (minutes < 1) return T.works.moment;
  const say = new Intl.RelativeTimeFormat(LOCALE);
  if (minutes < 60) return say.format(-minutes, "minute");
  const hours = Math.round(minutes / 60);
  return hours < 24 ? say.format(-hours, "hour") : say.format(-Math.round(hours / 24), "day");
}
