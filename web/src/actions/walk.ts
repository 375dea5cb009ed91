/** Lets the cage follow a clip of a humanoid rig that is fitted to the open model. */

import type { NamedFile } from "../contract";
import type { WalkState } from "../state";
import { sentence } from "../strings";
import { T } from "../words";
import { attemptLatest, type Context } from "./context";
import type { Edit } from "./edit";
import { readModels } from "./read";

const nameOf = (walk: WalkState | null) => walk?.clips[walk.clip]?.[0] ?? null;

export function createWalk(ctx: Context, edit: Pick<Edit, "alsoSettles" | "settle" | "setEditingRest">) {
  const { store, engine } = ctx;
  let frame: number | undefined;

  const stop = () => {
    if (frame === undefined) return;
    cancelAnimationFrame(frame);
    frame = undefined;
    engine().revert();
    store.set({ playing: false, playingPose: null });
  };
  // Undo steps must not contain a pose of the clip.
  edit.alsoSettles(stop);

  const step = (start: number) => (now: number) => {
    const { walk } = store.get();
    const length = walk?.clips[walk.clip]?.[1] ?? 0;
    const seconds = ((now - start) / 1000) % Math.max(length, 0.001);
    if (!walk || !engine().walkAt(walk.clip, seconds)) {
      stop();
      store.set({ walk: null });
      ctx.tell.say(T.walk.again);
      return;
    }
    frame = requestAnimationFrame(step(start));
  };

  const play = () => {
    edit.settle();
    edit.setEditingRest(false);
    frame = requestAnimationFrame(step(performance.now()));
    store.set({ playing: true, playingPose: nameOf(store.get().walk) });
  };

  return {
    /** Reads a rig with clips, fits it to the model and plays its first clip, unless the user prefers reduced motion. */
    open(files: readonly NamedFile[]): Promise<boolean> {
      ctx.tell.clear();
      return attemptLatest(ctx, T.walk.failed, "open", async (signal) => {
        edit.settle();
        try {
          const [rig] = await readModels(ctx, signal, [files], "add");
          if (!rig) return;
          const { clips, notice } = ctx.session().openWalk(rig.read);
          store.set({ walk: { clips, clip: 0, name: rig.name } });
          if (notice !== null) ctx.tell.say(sentence(notice));
        } finally {
          store.set({ busy: null });
        }
        if (!matchMedia("(prefers-reduced-motion: reduce)").matches) play();
      });
    },
    /** Selects a clip; null stops the clip and closes the rig. */
    choose(clip: number | null) {
      const { walk } = store.get();
      if (clip === null) stop();
      const next = walk && clip !== null ? { ...walk, clip } : null;
      store.set({ walk: next, playingPose: frame === undefined ? null : nameOf(next) });
    },
    toggle() {
      if (frame === undefined) play();
      else stop();
    },
  };
}
