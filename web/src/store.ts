/** Small items in browser storage: theme, closed notices, last stop of the tour, and the last crash. */

import type { Crash } from "./crash";

const THEME = "cagework.theme";
const SEEN_PREFIX = "cagework.seen.";
const TOUR = "cagework.tour";
const CRASH = "cagework.crash";

/** Returns the result of `work`; undefined if it throws, because storage is forbidden or full. */
export function tryStorage<T>(work: () => T): T | undefined {
  try {
    return work();
  } catch {
    return undefined;
  }
}

/** Stores a crash in this tab, so that the restarted page can report it. Returns false if storage is unavailable. */
export function keepCrash(crash: Crash): boolean {
  tryStorage(() => sessionStorage.setItem(CRASH, JSON.stringify(crash)));
  return lastCrash()?.report === crash.report;
}

/** Reads the crash that this tab stored before it restarted the page. */
export function lastCrash(): Crash | undefined {
  const { during, report } = tryStorage(() => JSON.parse(sessionStorage.getItem(CRASH) ?? "{}")) ?? {};
  return typeof during === "string" && typeof report === "string" ? { during, report } : undefined;
}

export function forgetCrash(): void {
  tryStorage(() => sessionStorage.removeItem(CRASH));
}

export type Theme = "auto" | "light" | "dark";

/** Reads the theme that the user chose last; "auto" if none is stored. */
export function loadTheme(): Theme {
  const theme = readItem(THEME);
  return theme === "light" || theme === "dark" ? theme : "auto";
}

/** The theme that is shown; "auto" follows the operating system. */
export function shownTheme(theme: Theme, dark: MediaQueryList): "light" | "dark" {
  return theme === "auto" ? (dark.matches ? "dark" : "light") : theme;
}

export function saveTheme(theme: Theme): void {
  writeItem(THEME, theme);
}

/** Whether the user has closed a notice. */
export function hasSeen(notice: string): boolean {
  return readItem(SEEN_PREFIX + notice) !== null;
}

export function markSeen(notice: string): void {
  writeItem(SEEN_PREFIX + notice, "yes");
}

/** Reads the link to the stop at which the user left the tour. */
export function loadStop(): string {
  return readItem(TOUR) ?? "";
}

export function saveStop(link: string): void {
  writeItem(TOUR, link);
}

function writeItem(key: string, value: string): void {
  tryStorage(() => localStorage.setItem(key, value));
}

function readItem(key: string): string | null {
  return tryStorage(() => localStorage.getItem(key)) ?? null;
}
