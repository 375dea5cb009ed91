import { startBind } from "@cagework/core/session/bind";
import type { Client } from "@cagework/core/session/client";
import { expect, it } from "vitest";
import type { Engine } from "../src/contract";
import { BIND_DEFAULTS } from "../src/defaults";

/**
 * Binds a model of `vertices` vertices in a cage of 8. Returns the grid of each pass, the inputs of the `rows` jobs,
 * how often the worker was ended, and how often the points were read.
 */
async function bindOf(vertices: number) {
  const grids: number[] = [];
  const fetched: unknown[] = [];
  let rests = 0;
  let reads = 0;
  const nonzeros = 8 * vertices;
  const client = {
    run(job: string, input: unknown) {
      if (typeof input === "function") grids.push(input().options.grid);
      else if (job === "rows") fetched.push(input);
      const kept = { key: 7, indptr: Uint32Array.of(0, nonzeros), offsets: {}, report: { backend: "cpu" } };
      return { done: Promise.resolve(kept), cancel: () => {} };
    },
    rest: () => {
      rests += 1;
    },
  } as unknown as Client;
  const engine = {
    bound: false,
    revision: 0,
    boundPoints: () => {
      reads += 1;
      return new Float32Array(3 * vertices);
    },
    modelPositions: () => new Float32Array(3 * vertices),
    requireCurrent: () => {},
    adopt: async (_: unknown, rows: (start: number, end: number) => unknown) => void (await rows(0, 1)),
  } as unknown as Engine;
  const positions = new Float32Array(24);
  const cage = () => ({ positions, corners: new Uint32Array(), controls: undefined }) as never;
  await startBind({ client, engine, adapter: "", options: BIND_DEFAULTS, listener: () => {}, cage }).done;
  return { grids, fetched, rests, reads };
}

// Grid 0 is automatic.
it("small models get a coarse pass first; large ones are bound once, and their worker is freed", async () => {
  const range = { key: 7, start: 0, end: 1 };
  expect(await bindOf(1000)).toEqual({ grids: [32, 0], fetched: [range, range], rests: 0, reads: 1 });
  expect(await bindOf(1_100_000)).toEqual({ grids: [0], fetched: [range], rests: 1, reads: 1 });
});
