/**
 * The service worker. It stores all files of one build in the browser and answers requests with them, so that the page
 * works offline and an open tab never mixes files of two builds. web/vite.config.ts defines `BUILD`, the list of the
 * files.
 */

const SCOPE = registration.scope;
/**
 * Prefix of this page's cache names. It contains the scope, because other copies of the page may be on the same origin.
 */
const PREFIX = `cagework ${SCOPE} `;
const CACHE = PREFIX + BUILD.id;
/** Key under which index.html is stored. It is the folder's address, because some servers redirect index.html to it. */
const PAGE = new URL("./", SCOPE).href;
/** Names under which servers offer index.html and gallery.html, which have the same script. */
const NAMES = ["", "index.html", "gallery", "gallery.html"];

addEventListener("install", (event) => event.waitUntil(install()));
addEventListener("activate", (event) => event.waitUntil(clean().then(() => clients.claim())));
addEventListener("message", ({ data }) => data === "take over" && skipWaiting());
addEventListener("fetch", (event) => {
  const { request } = event;
  if (request.method !== "GET" || !request.url.startsWith(SCOPE)) return;
  if (request.mode === "navigate") event.waitUntil(clean());
  event.respondWith(answer(request));
});

/** Downloads and stores the files of the build. Fails if the server now has another build. */
async function install() {
  const cache = await caches.open(CACHE);
  // The names of these files contain a hash of their content, so copies in the browser's HTTP cache are never outdated.
  await cache.addAll(BUILD.hashed);
  await cache.addAll(BUILD.named.map((name) => new Request(name, { cache: "no-cache" })));
  const page = await fetch(PAGE, { cache: "no-cache" });
  if (!page.ok || !(await page.clone().text()).includes(BUILD.entry))
    throw new Error("the server has another build");
  await cache.put(PAGE, page);
}

/** Deletes the files of builds that no tab uses. Each tab holds a lock named by the address of its main script. */
async function clean() {
  const { held } = await navigator.locks.query();
  const used = new Set(held.map(({ name }) => name));
  for (const name of await caches.keys()) {
    if (name === CACHE || !name.startsWith(PREFIX)) continue;
    const files = await (await caches.open(name)).keys();
    if (!files.some(({ url }) => used.has(url))) await caches.delete(name);
  }
}

/** Answers a request with a file of this build, of an older build that a tab still uses, or from the server. */
async function answer(request) {
  const address = new URL(request.url);
  address.search = "";
  const isPage = request.mode === "navigate" && NAMES.some((name) => address.href === PAGE + name);
  const key = isPage ? PAGE : request;
  const how = { ignoreSearch: true, ignoreVary: true };
  return (
    (await (await caches.open(CACHE)).match(key, how)) ?? (await caches.match(key, how)) ?? fetch(request)
  );
}
