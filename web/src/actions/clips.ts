/** Plays the clips of a rigged model, deformed as in an exported file. */

import { effect, untracked } from "@preact/signals";
import type { RigOptions } from "../contract";
import { drawn, rigOf } from "../derived";
import { follow } from "../queue";
import type { ClipState } from "../state";
import { T } from "../words";
import { attempt, type Context } from "./context";

export interface ClipActions {
  /** Shows the clip with this index, and plays it unless the user prefers reduced motion; null calls `stop`. */
  choose(clip: number | null): Promise<void>;
  toggle(): Promise<void>;
  /** Seeks to a time in seconds and pauses. */
  scrub(seconds: number): Promise<void>;
  speed(factor: number): void;
  loop(on: boolean): void;
  /** Sets the weight of a morph target that no clip drives. */
  target(index: number, weight: number): Promise<void>;
  rig(patch: Partial<RigOptions>): void;
  /** Ends the clip and shows the cage's pose. */
  stop(): void;
}

/** Computes the lattice by which the cage deforms a moving model, if the options need one and the engine has none. */
export async function loadLattice(ctx: Context): Promise<void> {
  const { engine } = ctx.session();
  if (!rigOf(ctx.store.get()).dynamic || engine.hasLattice) return;
  ctx.tell.say(T.clips.preparing);
  const { grid } = ctx.store.get().bindOptions;
  await ctx.queue.add("lattice", (signal) => follow(signal, ctx.session().loadLattice(grid)));
}

export function createClips(ctx: Context, settle: () => void): ClipActions {
  const { store } = ctx;
  const engine = () => ctx.session().engine;
  let frame = 0;
  let last = 0;

  const set = (patch: Partial<ClipState>) => store.set({ clip: { ...store.get().clip, ...patch } });

  const show = () => {
    const { clip, seconds, targets } = store.get().clip;
    engine().showClip(clip ?? undefined, seconds, Float32Array.from(targets));
  };

  const pause = () => {
    cancelAnimationFrame(frame);
    if (store.get().clip.playing) set({ playing: false });
  };

  const stop = () => {
    pause();
    if (engine().showsClip) engine().stopClip();
    if (store.get().clip.clip !== null || store.get().clip.targets.length > 0)
      set({ clip: null, seconds: 0, targets: [] });
  };

  // Undo steps, gestures and blends pose the cage, which ends the clip in the engine: reset the state.
  effect(() => {
    store.get().steps;
    store.get().gesture;
    store.get().shares;
    untracked(() => {
      if (store.get().clip.clip !== null && !engine().showsClip) stop();
    });
  });

  /** Prepares the model in its current pose for playback. False if that fails. */
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
    // Posing the cage has ended the clip.
    if (!engine().showsClip || length <= 0) {
      stop();
      return;
    }
    const next = seconds + ((now - last) / 1000) * speed;
    last = now;
    if (next >= length && !loop) {
      set({ seconds: length });
      show();
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
    // Two calls must not start two animation loops.
    cancelAnimationFrame(frame);
    frame = requestAnimationFrame(step);
  };

  return {
    async choose(clip) {
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
    async scrub(seconds) {
      pause();
      if (store.get().clip.clip === null || !(await ready())) return;
      set({ seconds });
      show();
    },
    speed: (speed) => set({ speed }),
    loop: (loop) => set({ loop }),
    async target(index, weight) {
      if (!(await ready())) return;
      const defaults = store.get().model?.targets.map((target) => target.default) ?? [];
      const targets = [...(store.get().clip.targets.length > 0 ? store.get().clip.targets : defaults)];
      targets[index] = weight;
      set({ targets });
      show();
    },
    rig(patch) {
      stop();
      store.set({ rigOptions: { ...store.get().rigOptions, ...patch } });
      engine().setScene(drawn(store.get()));
    },
    stop,
  };
}
