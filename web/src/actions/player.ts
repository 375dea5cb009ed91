/** Plays an animation of the cage. When it ends, the pose before it returns. */

import type { Context } from "./context";
import type { Edit } from "./edit";

export interface CageAnimation {
  /** Length in seconds, and whether the animation repeats. */
  readonly extent: () => { readonly seconds: number; readonly loops: boolean };
  /** Moves the cage to a time, seconds. Returns false if this is no longer possible. */
  readonly show: (seconds: number) => boolean;
}

export function createPlayer(ctx: Context, edit: Pick<Edit, "alsoSettles" | "settle" | "setEditingRest">) {
  const { store, engine } = ctx;
  let frame: number | undefined;
  /** Position of the playhead before the animation, seconds. */
  let start = 0;

  const stop = () => {
    if (frame === undefined) return;
    cancelAnimationFrame(frame);
    frame = undefined;
    engine().revert();
    store.set({ playing: false, playingPose: null, moment: start });
  };
  // Undo steps must not contain an intermediate pose of the animation.
  edit.alsoSettles(stop);

  return {
    isPlaying: () => frame !== undefined,
    /** Plays from the playhead, or from the start if the playhead is at the end. */
    play({ extent, show }: CageAnimation) {
      edit.settle();
      edit.setEditingRest(false);
      start = store.get().moment;
      let seconds = start < extent().seconds ? start : 0;
      let last = performance.now();
      const step = (now: number) => {
        const { seconds: length, loops } = extent();
        seconds += ((now - last) / 1000) * store.get().clip.speed;
        last = now;
        const isOver = seconds > length && !loops;
        seconds %= Math.max(length, 0.001);
        if (isOver || !show(seconds)) {
          stop();
          return;
        }
        store.set({ moment: seconds });
        frame = requestAnimationFrame(step);
      };
      store.set({ playing: true });
      frame = requestAnimationFrame(step);
    },
    /** Shows a time of an animation, seconds, without an undo step. */
    scrub({ show }: CageAnimation, seconds: number) {
      edit.settle();
      edit.setEditingRest(false);
      if (show(seconds)) store.set({ moment: seconds });
    },
    stop,
  };
}

export type Player = ReturnType<typeof createPlayer>;
