/**
 * The service worker. It keeps all files of one build in the browser and answers from them, so that the page works offline and
 * an open tab never mixes two builds. `BUILD` is defined by web/vite.config.ts.
 */

const SCOPE = registration.scope;
/**
 * Prefix of this page's cache names. It contains the scope, because other copies of the page may be on the same origin.
 */
const PREFIX = `cagework ${SCOPE} `;
const CACHE = PREFIX + BUILD.id;
/** The key of index.html, whose own name some servers redirect. */
const PAGE = new URL("./", SCOPE).href;

addEventListener("install", (event) => event.waitUntil(install()));
addEventListener("activate", (event) => event.waitUntil(clean().then(() => clients.claim())));
addEventListener("message", ({ data }) => data === "take over" && skipWaiting());
addEventListener("fetch", (event) => {
  const { request } = event;
  if (request.method !== "GET" || !request.url.startsWith(SCOPE)) return;
  if (request.mode === "navigate") event.waitUntil(clean());
  event.respondWith(answer(request));
});

/** Downloads the files of the build. Fails if the server now has another build. */
async function install() {
  const cache = await caches.open(CACHE);
  // Names of hashed files never change their content, so the browser's HTTP cache may answer.
  await cache.addAll(BUILD.hashed);
  await cache.addAll(BUILD.named.map((name) => new Request(name, { cache: "no-cache" })));
  const page = await fetch(PAGE, { cache: "no-cache" });
  if (!page.ok || !(await page.clone().text()).includes(BUILD.entry))
    throw new Error("the server has another build");
  await cache.put(PAGE, page);
}

/** Deletes builds that no tab uses: each tab holds a lock with the address of its main script. */
async function clean() {
  const { held } = await navigator.locks.query();
  const used = new Set(held.map(({ name }) => name));
  for (const name of await caches.keys()) {
    if (name === CACHE || !name.startsWith(PREFIX)) continue;
    const files = await (await caches.open(name)).keys();
    if (!files.some(({ url }) => used.has(url))) await caches.delete(name);
  }
}

/** Answers from this build, from an older one that a tab still uses, or from the server. */
async function answer(request) {
  const address = new URL(request.url);
  address.search = "";
  const isPage = request.mode === "navigate" && [PAGE, `${PAGE}index.html`].includes(address.href);
  const key = isPage ? PAGE : request;
  const how = { ignoreSearch: true, ignoreVary: true };
  return (
    (await (await caches.open(CACHE)).match(key, how)) ?? (await caches.match(key, how)) ?? fetch(request)
  );
}
