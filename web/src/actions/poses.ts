/** Poses: saved, named, blended and played. */

import type { Pose } from "../contract";
import { fittingPoses } from "../derived";
import { follow } from "../queue";
import { T } from "../words";
import type { Posed } from "./cage";
import { attempt, type Context } from "./context";
import type { Edit } from "./edit";

export interface PoseActions {
  save(): void;
  apply(pose: Pose): void;
  rename(pose: Pose, name: string): void;
  remove(pose: Pose): void;
  /** Sets one pose's share of the blend; `done` when the slider is let go, which makes it one step. */
  blend(pose: Pose, share: number, done: boolean): void;
  /** The pose and the poses that a cage of before had, for the one that is open. */
  carry(before: Posed): Promise<boolean>;
  /** The same as part of a step that there is already. */
  carryAlong(before: Posed): Promise<boolean>;
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
    store.set({ playing: false, playingPose: null });
    edit.sync();
  };

  const carry = (before: Posed, isStep: boolean): Promise<boolean> => {
    stop();
    return attempt(ctx, T.failed.carry, () =>
      ctx.queue.add("carry", async (signal) => {
        const { poses, shares } = store.get();
        const old = poses.filter((pose) => pose.positions.length === before.positions.length);
        const rested = before.cage.positions.every((x, i) => x === before.positions[i]);
        if (!isStep && rested && old.length === 0) return;
        const all = [before.positions, ...old.map((pose) => pose.positions)];
        const [positions, ...carried] = await follow(signal, ctx.session().carryPoses(before.cage, all));
        if (!positions) return;
        const set = (positions: Float32Array, poses: readonly Pose[], shares: readonly number[]) => {
          if (isStep) edit.setEditingRest(false);
          if (!store.get().editingRest) engine().setCagePositions(positions);
          setPoses(poses, shares);
          edit.sync();
        };
        const now = engine().cagePositions();
        const next = poses.map((pose) => ({
          ...pose,
          positions: carried[old.indexOf(pose)] ?? pose.positions,
        }));
        const redo = () => set(rested && !isStep ? now : positions, next, before.shares);
        redo();
        if (isStep) ctx.history.push({ label: T.did.carry, undo: () => set(now, poses, shares), redo });
      }),
    );
  };

  return {
    save() {
      if (!store.get().cage) return;
      edit.settle();
      const { poses, shares, pins } = store.get();
      const pose = { name: freshName(poses), positions: engine().cagePositions(), pins };
      // It is what is shown: its slider leads from here to rest.
      change(T.did.save, [...poses, pose], [...shares.map(() => 0), 1]);
      ctx.tell.say((store.get().posed ? T.pose.saved : T.pose.savedRest)(pose.name));
    },
    apply(pose) {
      stop();
      const { poses } = store.get();
      edit.pose(
        T.did.pose(pose.name),
        pose.positions,
        poses.map((other) => (other === pose ? 1 : 0)),
        pose.pins,
      );
    },
    rename(pose, name) {
      const clean = name.trim();
      if (clean === "" || clean === pose.name) return;
      const { poses, shares } = store.get();
      change(
        T.did.rename,
        poses.map((other) => (other === pose ? { ...pose, name: clean } : other)),
        shares,
      );
    },
    remove(pose) {
      const { poses, shares } = store.get();
      const index = poses.indexOf(pose);
      change(
        T.did.delete,
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
      const ofFitting = (all: readonly number[]) =>
        Float32Array.from(fitting, (p) => all[poses.indexOf(p)] ?? 0);
      engine().blend(
        fitting.map((p) => p.positions),
        beforeBlend.positions,
        ofFitting(beforeBlend.shares),
        ofFitting(shares),
      );
      store.set({ shares });
      if (done) {
        edit.posedSince(T.did.blend, beforeBlend.positions, beforeBlend.shares);
        beforeBlend = undefined;
      }
    },
    carry: (before) => carry(before, true),
    carryAlong: (before) => carry(before, false),
    reset() {
      stop();
      if (store.get().posed)
        edit.pose(
          T.did.reset,
          engine().restPositions(),
          store.get().shares.map(() => 0),
        );
    },
    togglePlay() {
      if (playing) {
        stop();
        return;
      }
      const fitting = fittingPoses(store.get());
      const poses = fitting.map((pose) => pose.positions);
      if (poses.length === 0) {
        ctx.tell.say(T.pose.saveFirst);
        return;
      }
      edit.setEditingRest(false);
      const start = performance.now();
      const cycle = poses.length + 1;
      const step = (now: number) => {
        if (!playing) return;
        const time = ((now - start) / 1000) % cycle;
        engine().playAt(poses, time);
        store.set({ playingPose: fitting[Math.floor(time)]?.name ?? null });
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
  while (taken.has(T.did.poseName(number))) number += 1;
  return T.did.poseName(number);
}
