/** Poses: saved, named, blended and played. */

import type { Pose } from "../contract";
import { fittingPoses } from "../state";
import type { Context } from "./context";
import type { Edit } from "./edit";

export interface PoseActions {
  save(): void;
  apply(pose: Pose): void;
  rename(pose: Pose, name: string): void;
  remove(pose: Pose): void;
  /** Sets one pose's share of the blend; `done` when the slider is let go, which makes it one step. */
  blend(pose: Pose, share: number, done: boolean): void;
  reset(): void;
  togglePlay(): void;
  stop(): void;
}

export function createPoses(ctx: Context, edit: Edit): PoseActions {
  const { store } = ctx;
  const engine = () => ctx.session().engine;
  let beforeBlend: { readonly positions: Float32Array; readonly shares: readonly number[] } | undefined;
  let playing: { frame: number; before: Float32Array } | undefined;

  const setPoses = (poses: readonly Pose[], shares: readonly number[]) => store.set({ poses, shares });

  /** Changes the list as a step of the history. */
  const change = (label: string, poses: readonly Pose[], shares: readonly number[]) => {
    const { poses: before, shares: sharesBefore } = store.get();
    setPoses(poses, shares);
    ctx.history.push({
      label,
      undo: () => setPoses(before, sharesBefore),
      redo: () => setPoses(poses, shares),
    });
  };

  const stop = () => {
    if (!playing) return;
    cancelAnimationFrame(playing.frame);
    engine().setCagePositions(playing.before);
    playing = undefined;
    store.set({ playing: false });
    edit.sync();
  };

  return {
    save() {
      if (!store.get().cage) return;
      const { poses, shares } = store.get();
      const pose = { name: freshName(poses), positions: engine().cagePositions() };
      change("Save a pose", [...poses, pose], [...shares, 0]);
      ctx.tell.say(`Saved as "${pose.name}"${store.get().posed ? "" : ": it is the rest pose"}.`);
    },
    apply(pose) {
      stop();
      edit.pose(`Pose "${pose.name}"`, pose.positions);
    },
    rename(pose, name) {
      const clean = name.trim();
      if (clean === "" || clean === pose.name) return;
      const { poses, shares } = store.get();
      change(
        "Rename a pose",
        poses.map((other) => (other === pose ? { ...pose, name: clean } : other)),
        shares,
      );
    },
    remove(pose) {
      const { poses, shares } = store.get();
      const index = poses.indexOf(pose);
      change(
        "Delete a pose",
        poses.filter((other) => other !== pose),
        shares.filter((_, i) => i !== index),
      );
    },
    blend(pose, share, done) {
      stop();
      edit.setEditingRest(false);
      beforeBlend ??= { positions: edit.positions(), shares: store.get().shares };
      const { poses } = store.get();
      const shares = store.get().shares.map((old, i) => (poses[i] === pose ? share : old));
      const fitting = fittingPoses(store.get());
      engine().blend(
        fitting.map((p) => p.positions),
        Float32Array.from(fitting, (p) => shares[poses.indexOf(p)] ?? 0),
      );
      store.set({ shares });
      if (done) {
        edit.posedSince("Blend poses", beforeBlend.positions, beforeBlend.shares);
        beforeBlend = undefined;
      }
    },
    reset() {
      stop();
      if (store.get().posed) edit.pose("Reset the pose", engine().restPositions());
    },
    togglePlay() {
      if (playing) {
        stop();
        return;
      }
      const poses = fittingPoses(store.get()).map((pose) => pose.positions);
      if (poses.length === 0) {
        ctx.tell.say("Save a pose first; then it can be played.");
        return;
      }
      edit.setEditingRest(false);
      const start = performance.now();
      const cycle = poses.length + 1;
      const step = (now: number) => {
        if (!playing) return;
        engine().playAt(poses, ((now - start) / 1000) % cycle);
        playing.frame = requestAnimationFrame(step);
      };
      playing = { before: edit.positions(), frame: requestAnimationFrame(step) };
      store.set({ playing: true });
    },
    stop,
  };
}

/** "Pose 3", or the next number that is free. */
export function freshName(poses: readonly Pose[]): string {
  const taken = new Set(poses.map((pose) => pose.name));
  let number = poses.length + 1;
  while (taken.has(`Pose ${number}`)) number += 1;
  return `Pose ${number}`;
}
