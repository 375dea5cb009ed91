/** Parts of the program that are loaded after the page: scripts, workers and wasm. */

import { unloaded } from "./client";

/** Awaits a dynamic import. */
export async function loadPart<T>(part: Promise<T>): Promise<T> {
  try {
    return await part;
  } catch (error) {
    throw unloaded(String(error));
  }
}

/** Fetches a file of the program and passes the response to `take`. */
export async function fetchPart<T>(url: string, take: (response: Response) => Promise<T>): Promise<T> {
  try {
    const response = await fetch(url);
    if (!response.ok) throw new TypeError(`${url}: ${response.status}`);
    return await take(response);
  } catch (error) {
    // The type of network errors, also while the body is read.
    throw error instanceof TypeError ? unloaded(error.message) : error;
  }
}
