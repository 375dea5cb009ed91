// Serves a folder (dist/ by default) at the root and below the path SUBFOLDER. Sets no header except Content-Type.

import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";

// The port is an option, so that tests of two working copies can run at once. With 0 the system chooses a free port.
const PORT = Number(process.env.E2E_PORT ?? 4179);
const FOLDER = process.env.E2E_FOLDER ?? join(import.meta.dirname, "../../dist");
const SUBFOLDER = "/~student/some%20where/cagework";

const TYPES = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".css": "text/css",
  ".wasm": "application/wasm",
  ".svg": "image/svg+xml",
  ".webp": "image/webp",
  ".png": "image/png",
  ".json": "application/json",
  ".webmanifest": "application/manifest+json",
  ".txt": "text/plain; charset=utf-8",
};

createServer(async (request, response) => {
  const { pathname } = new URL(request.url ?? "/", "http://localhost");
  const inner = pathname.startsWith(`${SUBFOLDER}/`) ? pathname.slice(SUBFOLDER.length) : pathname;
  const path = normalize(decodeURIComponent(inner.endsWith("/") ? `${inner}index.html` : inner));
  try {
    const bytes = await readFile(join(FOLDER, path));
    response.setHeader("Content-Type", TYPES[extname(path)] ?? "application/octet-stream");
    response.end(bytes);
  } catch {
    response.statusCode = 404;
    response.end("not found");
  }
})
  .listen(PORT, "127.0.0.1")
  .on("listening", function () {
    console.log(`http://127.0.0.1:${this.address().port}/`);
  });
