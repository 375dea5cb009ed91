/** Parts of the program that are loaded after the page: scripts, workers and wasm. */

import { unloaded } from "./client";

/** Awaits a dynamic import. If it fails, throws an error named Unloaded. */
export async function loadPart<T>(part: Promise<T>): Promise<T> {
  try {
    return await part;
  } catch (error) {
    throw unloaded(String(error));
  }
}

/**
 * Fetches a file of the program and passes the response to `take`. If the download fails, throws an error named
 * Unloaded.
 */
export async function fetchPart<T>(url: string, take: (response: Response) => Promise<T>): Promise<T> {
  try {
    const response = await fetch(url);
    if (!response.ok) throw new TypeError(`${url}: ${response.status}`);
    return await take(response);
  } catch (error) {
    // Network errors are TypeErrors, also while the body is read.
    throw error instanceof TypeError ? unloaded(error.message) : error;
  }
}
