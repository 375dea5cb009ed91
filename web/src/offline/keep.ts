/** Keeps the page's files in the browser by the service worker in worker.js, and offers new versions of the page. */

export interface Offline {
  /** Registers the service worker, which then downloads all files of the page: call it when nothing else is urgent. */
  register(): Promise<void>;
}

/**
 * `offer` is called when another version of the page is ready, at most once. Its argument makes the browser use that version
 * from the next load on. Without service workers (over plain http, in some private windows) nothing is kept.
 */
export function keepOffline(offer: (adopt: () => Promise<void>) => void): Offline {
  const { serviceWorker, locks } = navigator;
  if (!serviceWorker || !locks || import.meta.env.DEV) return { register: async () => undefined };
  // As long as a tab holds this lock, the service worker keeps the files of its build.
  const held = locks.request(import.meta.url, { mode: "shared" }, () => new Promise(() => undefined));
  held.catch(() => undefined);
  let isOffered = false;
  const offerOnce = (registration: ServiceWorkerRegistration) => {
    if (!isOffered) offer(() => adopt(registration));
    isOffered = true;
  };
  return {
    async register() {
      // Fails where storage is forbidden.
      const registration = await serviceWorker.register("./sw.js").catch(() => undefined);
      if (!registration) return;
      if (registration.waiting) offerOnce(registration);
      registration.addEventListener("updatefound", () => {
        const { installing } = registration;
        installing?.addEventListener("statechange", () => {
          // Without an active worker this is the first version.
          if (registration.waiting && registration.active) offerOnce(registration);
        });
      });
      document.addEventListener("visibilitychange", () => {
        // Fails offline.
        if (document.visibilityState === "visible") registration.update().catch(() => undefined);
      });
      await serviceWorker.ready;
      // The server may have got another version since this page was loaded.
      if (!(await caches.match(import.meta.url, { ignoreVary: true }))) offerOnce(registration);
    },
  };
}

/** Activates the waiting version. Other tabs keep the files of theirs. */
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
