/** Entries of the list of saved work: what is stored with each project file. */

import { LOCALE } from "../format";
import { T } from "../words";

export interface Entry {
  readonly id: string;
  /** Name of the model, which the list of saved work shows. */
  readonly name: string;
  /** Time of the last save, ms since 1970. */
  readonly when: number;
  /** Size of the project file, bytes. */
  readonly size: number;
  /** Set if the page has crashed twice with this work open. The work is then not opened automatically. */
  readonly stopped?: true;
}

/** An entry, and whether this tab, another tab or no tab has it open. */
export interface Work extends Entry {
  readonly where: "here" | "elsewhere" | "nowhere";
}

const DAY_MS = 86_400_000;
/** Number of days after the last save for which work is kept. */
export const KEPT_DAYS = 30;

/** Magic number of a GLB (glTF 2.0, section 4.4.1). */
const GLB = 0x46546c67;
/** Position of the file's length in the header, and length of the header, bytes. */
const GLB_LENGTH_OFFSET = 8;
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

/** Whether this is a complete project file: a GLB whose header states the file's length. */
export async function isWhole(file: Blob): Promise<boolean> {
  if (file.size < GLB_HEAD) return false;
  const head = new DataView(await file.slice(0, GLB_HEAD).arrayBuffer());
  return head.getUint32(0, true) === GLB && head.getUint32(GLB_LENGTH_OFFSET, true) === file.size;
}

export function isExpired({ when }: Entry, now: number): boolean {
  return now - when > KEPT_DAYS * DAY_MS;
}

export function newestFirst<T extends Entry>(entries: readonly T[]): T[] {
  return [...entries].sort((a, b) => b.when - a.when);
}

/**
 * Chooses the work to open at startup: the work that this tab had open before a reload, even if the old page still
 * holds its lock, or else the only work that no other tab has open. Returns undefined if there is no such work, or if
 * the page has crashed twice with it.
 */
export function toOpen(works: readonly Work[], own: string | null): Work | undefined {
  const free = works.filter(({ where }) => where !== "elsewhere");
  const chosen = works.find(({ id }) => id === own) ?? (free.length === 1 ? free[0] : undefined);
  return chosen?.stopped ? undefined : chosen;
}

/** Says how long ago a time was: 300000 -> "5 minutes ago". */
export function ago(ms: number): string {
  const minutes = Math.round(ms / 60_000);
  if (minutes < 1) return T.works.moment;
  const say = new Intl.RelativeTimeFormat(LOCALE);
  if (minutes < 60) return say.format(-minutes, "minute");
  const hours = Math.round(minutes / 60);
  return hours < 24 ? say.format(-hours, "hour") : say.format(-Math.round(hours / 24), "day");
}
