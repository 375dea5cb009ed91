import { describe, expect, it } from "vitest";
import { createHistory, type Step } from "../src/history";

function numbers() {
  const state = { value: 0 };
  const add = (amount: number): Step => ({
    label: `Add ${amount}`,
    undo: () => {
      state.value -= amount;
    },
    redo: () => {
      state.value += amount;
    },
  });
  return { state, add };
}

describe("history", () => {
  it("undoes and redoes steps in order", async () => {
    const { state, add } = numbers();
    const history = createHistory(() => undefined);
    for (const amount of [1, 10]) {
      state.value += amount;
      history.push(add(amount));
    }
    await history.undo();
    expect(state.value).toBe(1);
    expect(history.undoLabel).toBe("Add 1");
    expect(history.redoLabel).toBe("Add 10");
    await history.redo();
    expect(state.value).toBe(11);
  });

  it("drops undone steps when a new one is pushed", async () => {
    const { add } = numbers();
    const history = createHistory(() => undefined);
    history.push(add(1));
    await history.undo();
    history.push(add(2));
    expect(history.redoLabel).toBeUndefined();
    expect(await history.redo()).toBeUndefined();
  });

  it("runs asynchronous steps in sequence", async () => {
    const order: string[] = [];
    const history = createHistory(() => undefined);
    const slow = (name: string, ms: number): Step => ({
      label: name,
      undo: async () => {
        await new Promise((resolve) => setTimeout(resolve, ms));
        order.push(name);
      },
      redo: () => undefined,
    });
    history.push(slow("first", 0));
    history.push(slow("second", 15));
    await Promise.all([history.undo(), history.undo()]);
    expect(order).toEqual(["second", "first"]);
  });

  /** A step that the test resolves or rejects. */
  function open(label: string) {
    let end = { well: () => {}, badly: () => {} };
    const go = () =>
      new Promise<void>((resolve, reject) => {
        end = { well: resolve, badly: () => reject(new Error("no")) };
      });
    return { step: { label, undo: go, redo: go }, end: () => end };
  }
  const labels = async (history: ReturnType<typeof createHistory>) => {
    const all: string[] = [];
    while (history.undoLabel) {
      all.push(history.undoLabel);
      await history.undo();
    }
    return all;
  };

  it("drops a step whose undo is pending when another one is pushed", async () => {
    const history = createHistory(() => undefined);
    const { step, end } = open("Remove a model");
    history.push(step);
    const undone = history.undo();
    await Promise.resolve();
    history.push(numbers().add(1));
    end().well();
    await undone;
    expect(history.redoLabel).toBeUndefined();
    expect(await labels(history)).toEqual(["Add 1"]);
  });

  it("keeps the order if an undo fails or a redo ends late", async () => {
    const history = createHistory(() => undefined);
    const { step, end } = open("Remove a model");
    history.push(step);
    const failing = history.undo();
    await Promise.resolve();
    history.push(numbers().add(1));
    end().badly();
    await expect(failing).rejects.toThrow("no");
    await history.undo();
    const undoing = history.undo();
    await Promise.resolve();
    end().well();
    await undoing;
    const redoing = history.redo();
    await Promise.resolve();
    history.push(numbers().add(2));
    end().well();
    await redoing;
    expect(history.undoLabel).toBe("Add 2");
    await history.undo();
    expect(history.undoLabel).toBe("Remove a model");
  });

  it("stays empty if it is cleared during an undo", async () => {
    const history = createHistory(() => undefined);
    for (const isWell of [true, false]) {
      const { step, end } = open("Remove a model");
      history.push(step);
      const undone = history.undo();
      await Promise.resolve();
      history.clear();
      if (isWell) end().well();
      else end().badly();
      await undone.catch(() => undefined);
      expect([history.undoLabel, history.redoLabel]).toEqual([undefined, undefined]);
    }
  });

  it("keeps a step whose undo failed", async () => {
    const history = createHistory(() => undefined);
    history.push({
      label: "Broken",
      undo: () => {
        throw new Error("no");
      },
      redo: () => undefined,
    });
    await expect(history.undo()).rejects.toThrow("no");
    expect(history.undoLabel).toBe("Broken");
  });

  it("drops the oldest steps beyond its limit", async () => {
    const { add } = numbers();
    const history = createHistory(() => undefined, 2);
    for (const amount of [1, 2, 3]) history.push(add(amount));
    await history.undo();
    await history.undo();
    expect(await history.undo()).toBeUndefined();
  });

  it("notifies on each change", async () => {
    let calls = 0;
    const { add } = numbers();
    const history = createHistory(() => {
      calls += 1;
    });
    history.push(add(1));
    await history.undo();
    history.clear();
    expect(calls).toBe(3);
  });
});
