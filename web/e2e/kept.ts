/** What the page keeps in the browser. */

import type { Page } from "@playwright/test";

/** Whether the browser keeps work that was saved after a moment, ms since 1970. */
export const savedSince = (page: Page, moment: number): Promise<boolean> =>
  page.evaluate(
    (moment) =>
      new Promise<boolean>((answer) => {
        const opened = indexedDB.open("cagework");
        opened.onsuccess = () => {
          const { result } = opened;
          const saved = result.objectStoreNames.contains("projects")
            ? result.transaction("projects").objectStore("projects").get("autosave")
            : undefined;
          result.close();
          if (!saved) answer(false);
          else saved.onsuccess = () => answer((saved.result?.when ?? 0) > moment);
        };
      }),
    moment,
  );
