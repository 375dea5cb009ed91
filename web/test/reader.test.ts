import type { Package } from "@cagework/core/session/artifact";
import { type Client, named } from "@cagework/core/session/client";
import { readFiles, siblingOf } from "@cagework/core/session/files";
import { createSeparateWorkers, load } from "@cagework/core/session/reader";
import { expect, it, vi } from "vitest";
import type { NamedFile } from "../src/contract";
import { T } from "../src/words";

const file = (name: string, size = 10): NamedFile => ({ name, path: name, file: { size } as Blob });

/** Simulated workers: the test ends their jobs by `answer` or `fail`; `closed` counts calls of `close`. */
function workers() {
  const opened: { closed: number; answer: (output: object) => void; fail: (error: Error) => void }[] = [];
  const open = (): Client => {
    const worker = { closed: 0, answer: (_: object) => {}, fail: (_: Error) => {} };
    const done = new Promise<never>((resolve, reject) => {
      worker.answer = (output) => resolve(output as never);
      worker.fail = reject;
    });
    const close = () => {
      worker.closed += 1;
      worker.fail(named("Cancelled", "the page is closing"));
    };
    opened.push(worker);
    return { run: () => ({ done, cancel: close }), isBusy: () => true, rest: () => {}, close };
  };
  return { opened, open };
}

it("each file is read by a worker of its own", async () => {
  const { opened, open } = workers();
  const apart = createSeparateWorkers(open);
  for (const k of [0, 1]) {
    const job = apart("read", { files: [file("a.obj")], up: undefined });
    opened[k]?.answer({ vertices: 3 });
    expect(await job.done).toEqual({ vertices: 3 });
    expect(opened[k]?.closed).toBeGreaterThan(0);
  }
  expect(opened.length).toBe(2);
});

it("shared reading uses one worker until it breaks or sharing ends", async () => {
  const { opened, open } = workers();
  const apart = createSeparateWorkers(open);
  const release = apart.share();
  const read = () => apart("read", { files: [file("a.obj")], up: undefined });
  const first = read();
  opened[0]?.answer({ vertices: 3 });
  await first.done;
  const again = read();
  expect([(await again.done).vertices, opened.length, opened[0]?.closed]).toEqual([3, 1, 0]);
  release();
  expect(opened[0]?.closed).toBe(1);
  const alone = read();
  opened[1]?.fail(named("Worker", "unreachable"));
  await expect(alone.done).rejects.toThrow("reading this file failed unexpectedly");
});

it("the worker of a large file is closed at once, because its memory never shrinks", async () => {
  const { opened, open } = workers();
  const apart = createSeparateWorkers(open);
  apart.share();
  const first = apart("read", { files: [file("a.glb", 17 << 20)], up: undefined });
  opened[0]?.answer({ vertices: 3 });
  await first.done;
  expect(opened[0]?.closed).toBe(1);
});

it("a cancellation or another file ends the current read", async () => {
  const { opened, open } = workers();
  const apart = createSeparateWorkers(open);
  const first = apart("read", { files: [file("a.obj")], up: undefined });
  const second = apart("read", { files: [file("b.obj")], up: undefined });
  await expect(first.done).rejects.toMatchObject({ name: "Cancelled" });
  expect(opened[1]?.closed).toBe(0);
  second.cancel();
  await expect(second.done).rejects.toMatchObject({ name: "Cancelled" });
});

it("a broken worker becomes a readable error; errors of the file are passed on", async () => {
  const { opened, open } = workers();
  const apart = createSeparateWorkers(open);
  const broken = apart("read", { files: [file("a.obj")], up: undefined });
  opened[0]?.fail(named("Worker", "unreachable"));
  await expect(broken.done).rejects.toThrow("reading this file failed unexpectedly");
  const bad = apart("read", { files: [file("b.obj")], up: undefined });
  opened[1]?.fail(named("Format", "not a GLB"));
  await expect(bad.done).rejects.toMatchObject({ name: "Format", message: "not a GLB" });
});

it("a file above the size limit starts no worker", async () => {
  const { opened, open } = workers();
  const job = createSeparateWorkers(open)("read", {
    files: [file("a.glb"), file("huge.bin", 5 * 2 ** 30)],
    up: undefined,
  });
  await expect(job.done).rejects.toThrow("huge.bin has 5.0 GiB");
  expect(opened.length).toBe(0);
});

it("progress shows a percentage if the stage has one", () => {
  const { far, stages } = T.opening;
  expect(far(stages.geometry, 0)).toBe("Finding vertices and faces");
  expect(far(stages.textures, 0.4)).toBe("Decoding textures, 40%");
});

it("OBJ and glTF read their sibling files, other formats none", async () => {
  const dropped = (name: string) => ({ name, path: `fox/${name}`, file: new Blob([name]) });
  const beside = [dropped("fox.mtl"), { ...dropped("fur.png"), path: "fox/textures/fur.png" }];
  const text = (bytes: Uint8Array | undefined) => bytes && new TextDecoder().decode(bytes);
  for (const name of ["fox.obj", "fox.gltf"]) {
    const find = siblingOf((await readFiles([dropped(name), ...beside])).siblings);
    expect([text(find("./fox.mtl")), text(find("textures/fur.png"))]).toEqual(["fox.mtl", "fur.png"]);
  }
  expect((await readFiles([dropped("fox.stl"), ...beside])).siblings.size).toBe(0);
});

it("in a browser's worker, a sibling file is read when the model asks for it", async () => {
  const asked: Blob[] = [];
  vi.stubGlobal(
    "FileReaderSync",
    class {
      readAsArrayBuffer(blob: Blob) {
        asked.push(blob);
        return new ArrayBuffer(3);
      }
    },
  );
  const [used, unused] = [file("fur.png"), file("other.png")];
  const find = siblingOf((await readFiles([file("fox.obj"), used, unused])).siblings);
  expect([find("fur.png")?.length, asked]).toEqual([3, [used.file]]);
  vi.unstubAllGlobals();
});

it("each model and each texture is copied in a task of its own", async () => {
  const events: string[] = [];
  vi.stubGlobal(
    "MessageChannel",
    class extends MessageChannel {
      constructor() {
        super();
        events.push("turn");
      }
    },
  );
  const restore = () => {
    events.push("model");
    return { setTexture: (index: number) => events.push(`texture ${index}`) };
  };
  const texture = { width: 1, height: 1, rgba: new Uint8Array(4) };
  const read = {
    models: [[], []],
    textures: [[texture, null, texture], []],
    held: { pixels: 2, bytes: 0 },
    cage: undefined,
    notices: [],
    vertices: 0,
  };
  const all = await load({ LoadedModel: { restore } } as unknown as Package, read);
  vi.unstubAllGlobals();
  expect(all.length).toBe(2);
  expect(events).toEqual(["turn", "model", "turn", "texture 0", "turn", "texture 2", "turn", "model"]);
});
