/** Work that the page has saved in the browser's database. */

import type { Page } from "@playwright/test";

/** Whether the browser has work saved after `moment`, ms since 1970, of a model whose name contains `name`. */
export const savedSince = (page: Page, moment: number, name = ""): Promise<boolean> =>
  page.evaluate(
    ({ moment, name }) =>
      new Promise<boolean>((answer) => {
        const opened = indexedDB.open("cagework");
        opened.onsuccess = () => {
          const { result } = opened;
          const saved = result.objectStoreNames.contains("entries")
            ? result.transaction("entries").objectStore("entries").getAll()
            : undefined;
          result.close();
          const isIt = (entry: { when: number; name: string }) =>
            entry.when > moment && entry.name.includes(name);
          if (!saved) answer(false);
          else saved.onsuccess = () => answer(saved.result.some(isIt));
        };
      }),
    { moment, name },
  );
