/** Undo and redo: one gesture, one step. A step knows how to go both ways; what it costs is its own affair. */

export interface Step {
  /** What the user did, as the undo button's tool tip says it: "Move 3 vertices". */
  readonly label: string;
  undo(): void | Promise<void>;
  redo(): void | Promise<void>;
}

export interface History {
  /** Adds what has just been done; what was undone before is forgotten. */
  push(step: Step): void;
  undo(): Promise<Step | undefined>;
  redo(): Promise<Step | undefined>;
  clear(): void;
  readonly undoLabel: string | undefined;
  readonly redoLabel: string | undefined;
}

/** Steps kept; a step holds two copies of a cage of at most a few hundred vertices, some kilobytes. */
const LIMIT = 200;

/** A history that calls `changed` after each change. Undo and redo run one after the other, in the order asked for. */
export function createHistory(changed: () => void, limit = LIMIT): History {
  const done: Step[] = [];
  const undone: Step[] = [];
  let queue: Promise<unknown> = Promise.resolve();
  /** Count pushes, and times that the history was cleared. */
  let pushes = 0;
  let clears = 0;

  const go = (way: "undo" | "redo"): Promise<Step | undefined> => {
    const result = queue.then(async () => {
      const step = (way === "undo" ? done : undone).pop();
      if (!step) return undefined;
      const before = { pushes, clears, place: done.length };
      // A step may take time; others may be pushed meanwhile, or another model opened.
      const put = (isDone: boolean) => {
        if (clears !== before.clears) return;
        if (isDone) done.splice(before.place, 0, step);
        else if (pushes === before.pushes) undone.push(step);
        changed();
      };
      try {
        await step[way]();
      } catch (error) {
        put(way === "undo");
        throw error;
      }
      put(way === "redo");
      return step;
    });
    queue = result.catch(() => undefined);
    return result;
  };

  return {
    push(step) {
      done.push(step);
      if (done.length > limit) done.shift();
      undone.length = 0;
      pushes += 1;
      changed();
    },
    undo: () => go("undo"),
    redo: () => go("redo"),
    clear() {
      clears += 1;
      done.length = 0;
      undone.length = 0;
      changed();
    },
    get undoLabel() {
      return done.at(-1)?.label;
    },
    get redoLabel() {
      return undone.at(-1)?.label;
    },
  };
}
