/** Lets the cage follow a clip of a humanoid rig that is fitted to the open model. */

import type { NamedFile } from "../contract";
import { sentence } from "../strings";
import { T } from "../words";
import { attemptLatest, type Context } from "./context";
import type { Edit } from "./edit";
import type { CageAnimation, Player } from "./player";
import { readModels } from "./read";

export function createWalk(ctx: Context, edit: Pick<Edit, "settle">, player: Player) {
  const { store, engine } = ctx;

  /** The chosen clip. */
  const animation: CageAnimation = {
    extent() {
      const { walk } = store.get();
      return { seconds: walk?.clips[walk.clip]?.[1] ?? 0, loops: true };
    },
    show(seconds) {
      const { walk } = store.get();
      if (walk && engine().walkAt(walk.clip, seconds)) {
        store.set({ playingPose: walk.clips[walk.clip]?.[0] ?? null });
        return true;
      }
      store.set({ walk: null });
      ctx.tell.say(T.walk.again);
      return false;
    },
  };

  return {
    animation,
    /** Reads a rig with clips, fits it to the model and plays its first clip, unless the user prefers reduced motion. */
    open(files: readonly NamedFile[]): Promise<boolean> {
      ctx.tell.clear();
      return attemptLatest(ctx, T.walk.failed, "open", async (signal) => {
        edit.settle();
        try {
          const [rig] = await readModels(ctx, signal, [files], "add");
          if (!rig) return;
          const { clips, notice } = await ctx.session().openWalk(rig.read);
          store.set({ walk: { clips, clip: 0, name: rig.name }, moment: 0 });
          if (notice !== null) ctx.tell.say(sentence(notice));
        } finally {
          store.set({ busy: null });
        }
        if (!matchMedia("(prefers-reduced-motion: reduce)").matches) player.play(animation);
      });
    },
    /** Selects a clip; null stops the clip and closes the rig. */
    choose(clip: number | null) {
      const { walk } = store.get();
      if (clip === null) player.stop();
      store.set({ walk: walk && clip !== null ? { ...walk, clip } : null });
    },
  };
}
