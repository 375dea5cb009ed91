/**
 * Plays the clips of a rigged model, deformed as in an exported file. While a clip is paused, the cage can be moved:
 * the engine shows the frame in each new pose.
 */

import { effect, untracked } from "@preact/signals";
import type { RigOptions } from "../contract";
import { drawn, isCapture, rigOf } from "../derived";
import { follow } from "../queue";
import type { ClipState } from "../state";
import { T } from "../words";
import { attempt, type Context } from "./context";

/** Computes the lattice by which the cage deforms a capture or a moving model, if one is needed and there is none. */
export async function loadLattice(ctx: Context): Promise<void> {
  const engine = ctx.engine();
  const { model, posed } = ctx.store.get();
  const { dynamic } = rigOf(ctx.store.get());
  if (engine.hasLattice || !(dynamic || (isCapture(model) && posed))) return;
  if (dynamic) ctx.tell.say(T.clips.preparing);
  const { grid } = ctx.store.get().bindOptions;
  // Playback and export use the same lattice: neither may cancel the computation that the other has started.
  await ctx.queue.add("lattice", async (signal) => {
    if (!engine.hasLattice) await follow(signal, ctx.session().loadLattice(grid));
  });
}

export function createClips(ctx: Context, settle: () => void) {
  const { store, engine } = ctx;
  let frame = 0;
  let last = 0;
  /** The clip that a change of options has ended, until it is shown again. */
  let interrupted: ClipState | undefined;

  const set = (patch: Partial<ClipState>) => store.set({ clip: { ...store.get().clip, ...patch } });

  const show = () => {
    const { clip, seconds, targets, playing } = store.get().clip;
    engine().showClip(clip ?? undefined, seconds, Float32Array.from(targets), !playing);
  };

  const pause = () => {
    cancelAnimationFrame(frame);
    if (!store.get().clip.playing) return;
    set({ playing: false });
    if (engine().showsClip) show();
  };

  const stop = () => {
    interrupted = undefined;
    pause();
    if (engine().showsClip) engine().stopClip();
    if (store.get().clip.clip !== null || store.get().clip.targets.length > 0)
      set({ clip: null, seconds: 0, targets: [] });
  };

  // A change of models, cage or weights ends the clip in the engine: reset the state. Reshaping the cage and playing
  // the saved poses end the clip, too.
  effect(() => {
    store.get().steps;
    store.get().report;
    const { bound, editingRest, playing, clip } = store.get();
    const isShown = clip.clip !== null || clip.targets.length > 0;
    if (isShown && (!bound || editingRest || playing || !engine().showsClip)) untracked(stop);
  });

  /** Prepares the model in its current pose for playback. False if it is not bound or the preparation fails. */
  const ready = async (): Promise<boolean> => {
    if (engine().showsClip) return true;
    settle();
    if (!store.get().bound) {
      ctx.tell.say(T.clips.bindFirst);
      return false;
    }
    return attempt(ctx, T.failed.clip, async () => {
      await loadLattice(ctx);
      await engine().startClip(rigOf(store.get()));
    });
  };

  const step = (now: number) => {
    const { clip, seconds, speed, loop } = store.get().clip;
    const length = store.get().model?.clips[clip ?? -1]?.seconds ?? 0;
    // A change of models or cage has ended the clip.
    if (!engine().showsClip || length <= 0) {
      stop();
      return;
    }
    const next = seconds + ((now - last) / 1000) * speed;
    last = now;
    if (next >= length && !loop) {
      set({ seconds: length });
      pause();
      return;
    }
    set({ seconds: next % length });
    show();
    frame = requestAnimationFrame(step);
  };

  const play = async () => {
    const first = store.get().model?.clips.length ? 0 : null;
    const clip = store.get().clip.clip ?? first;
    if (clip === null || !(await ready())) return;
    const length = store.get().model?.clips[clip]?.seconds ?? 0;
    const { seconds } = store.get().clip;
    set({ clip, seconds: seconds >= length ? 0 : seconds, playing: true });
    last = performance.now();
    // A second call must not start a second animation loop.
    cancelAnimationFrame(frame);
    frame = requestAnimationFrame(step);
  };

  return {
    /** Shows the clip with this index, and plays it unless the user prefers reduced motion; null calls `stop`. */
    async choose(clip: number | null) {
      pause();
      if (clip === null) {
        stop();
        return;
      }
      if (!(await ready())) return;
      set({ clip, seconds: 0 });
      show();
      if (!matchMedia("(prefers-reduced-motion: reduce)").matches) await play();
    },
    async toggle() {
      if (store.get().clip.playing) pause();
      else await play();
    },
    /** Pauses the clip, so that the cage is shown and can be moved. */
    pause,
    /** Seeks to a time in seconds and pauses. */
    async scrub(seconds: number) {
      pause();
      if (store.get().clip.clip === null || !(await ready())) return;
      set({ seconds });
      show();
    },
    speed: (speed: number) => set({ speed }),
    loop: (loop: boolean) => set({ loop }),
    /** Sets the weight of a morph target that no clip drives. */
    async target(index: number, weight: number) {
      if (!(await ready())) return;
      const defaults = store.get().model?.targets.map((target) => target.default) ?? [];
      const targets = [...(store.get().clip.targets.length > 0 ? store.get().clip.targets : defaults)];
      targets[index] = weight;
      set({ targets });
      show();
    },
    /** Changes options of the skeleton. A shown clip is prepared again with the new options, and continues. */
    async rig(patch: Partial<RigOptions>) {
      const before = store.get().clip.clip === null ? interrupted : store.get().clip;
      stop();
      store.set({ rigOptions: { ...store.get().rigOptions, ...patch } });
      engine().setScene(drawn(store.get()));
      interrupted = before;
      if (!before || !(await ready())) return;
      if (interrupted !== before) {
        // In the meantime, the user has changed another option or ended the clip.
        if (!interrupted && store.get().clip.clip === null) engine().stopClip();
        return;
      }
      interrupted = undefined;
      set({ clip: before.clip, seconds: before.seconds, targets: before.targets });
      show();
      if (before.playing) await play();
    },
    /** Ends the clip and shows the cage's pose. */
    stop,
  };
}
