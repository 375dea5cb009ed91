/** Registers the service worker of worker.js, which stores the page's files in the browser, and offers new versions. */

/**
 * Calls `offer` at most once, when another version of the page is ready. The argument of `offer` is a function that
 * makes the browser use that version from the next load on. Without service workers (over plain http, in some private
 * windows), the page is not stored.
 */
export function keepOffline(offer: (adopt: () => Promise<void>) => void) {
  const { serviceWorker, locks } = navigator;
  if (!serviceWorker || !locks || import.meta.env.DEV) return { register: async () => undefined };
  // While a tab holds this lock, the service worker keeps the files of the build that the tab has loaded.
  const held = locks.request(import.meta.url, { mode: "shared" }, () => new Promise(() => undefined));
  held.catch(() => undefined);
  let isOffered = false;
  const offerOnce = (registration: ServiceWorkerRegistration) => {
    if (!isOffered) offer(() => adopt(registration));
    isOffered = true;
  };
  return {
    /**
     * Registers the service worker, which downloads all files of the page. Call this function when the page is idle.
     */
    async register() {
      // Registration fails if the browser forbids storage.
      const registration = await serviceWorker.register("./sw.js").catch(() => undefined);
      if (!registration) return;
      if (registration.waiting) offerOnce(registration);
      registration.addEventListener("updatefound", () => {
        const { installing } = registration;
        installing?.addEventListener("statechange", () => {
          // If no worker is active, this is the first version that is stored, so there is nothing to offer.
          if (registration.waiting && registration.active) offerOnce(registration);
        });
      });
      document.addEventListener("visibilitychange", () => {
        // The update fails without a connection.
        if (document.visibilityState === "visible") registration.update().catch(() => undefined);
      });
      await serviceWorker.ready;
      // If the server was updated after this page was loaded, the worker has stored the newer version.
      if (!(await caches.match(import.meta.url, { ignoreVary: true }))) offerOnce(registration);
    },
  };
}

export type OfflineCopy = ReturnType<typeof keepOffline>;

/** Activates the service worker of the new version. Tabs with the previous version still get their files. */
async function adopt({ waiting }: ServiceWorkerRegistration): Promise<void> {
  if (!waiting) return;
  const isOver = new Promise<void>((done) => {
    waiting.addEventListener("statechange", () => {
      if (waiting.state !== "activating") done();
    });
  });
  waiting.postMessage("take over");
  await isOver;
}
