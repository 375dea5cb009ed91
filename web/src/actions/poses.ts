/** Saves, renames, blends and plays poses. */

import type { CageArrays, Interpolation, PoseView, Transition } from "../contract";
import { fittingPoses } from "../derived";
import { triples } from "../points";
import { follow } from "../queue";
import { T } from "../words";
import { attempt, type Context } from "./context";
import type { Edit } from "./edit";
import type { CageAnimation, Player } from "./player";

/** A cage and its poses, stored before the cage is replaced. */
export interface CageSnapshot {
  readonly cage: CageArrays;
  /** Identifies the cage; see `DocumentView.cageId`. */
  readonly id: number;
  /** The current pose, then each saved pose that fits this cage. `[1 + n_poses, n_controls, 3]` */
  readonly poses: Float32Array;
  readonly shares: readonly number[];
}

/** Copies the current cage and its poses; undefined without a cage. */
export function snapshotCage(ctx: Context): CageSnapshot | undefined {
  const { cage, cageId: id, shares } = ctx.store.get();
  const engine = ctx.engine();
  return cage ? { cage: engine.cageArrays(), id, poses: engine.carriable(), shares } : undefined;
}

/** Size of a pose's picture, pixels: twice the CSS pixels at which its card shows it, for high-density screens. */
const PICTURE = [224, 168] as const;

export function createPoses(
  ctx: Context,
  edit: Edit,
  player: Player,
  walk: { readonly animation: CageAnimation },
) {
  const { store, engine } = ctx;
  const { stop } = player;

  /** The animation of the saved poses. */
  const animation: CageAnimation = {
    extent: () => ({ seconds: store.get().animationSeconds, loops: store.get().transition.loops }),
    show(seconds) {
      engine().playAt(seconds);
      const next = fittingPoses(store.get()).find((pose) => pose.seconds >= seconds);
      store.set({ playingPose: next?.name ?? null });
      return true;
    },
  };
  /** What the timeline plays: the clip of a rig that the cage follows, or the saved poses. */
  const shown = () => (store.get().walk ? walk.animation : animation);

  const carry = ({ cage, id, poses, shares }: CageSnapshot, label?: string): Promise<boolean> => {
    const n = cage.positions.length;
    const isAtRest = cage.positions.every((x, i) => x === poses[i]);
    return attempt(ctx, T.failed.carry, () =>
      ctx.queue.add("carry", async (signal) => {
        if (!label && isAtRest && poses.length === n) return;
        const carried = await follow(signal, ctx.session().carryPoses(cage, poses));
        stop();
        if (label) edit.setEditingRest(false);
        // `carried` starts with the current pose. If the conversion is not an undo step of its own, keep the new cage's
        // current pose if the old cage was at rest or the cage is being reshaped.
        if (!label && (isAtRest || store.get().editingRest)) carried.set(engine().cagePositions());
        const positions = triples(carried);
        engine().apply({ do: "carry_poses", from: id, positions, shares: [...shares] }, label);
        if (!label) engine().amend();
      }),
    );
  };

  let isDrawing = false;
  /**
   * Makes the missing pictures of saved poses, one after the other: that of one pose, or of all. While a picture is
   * drawn, the view cannot be picked.
   */
  const drawPictures = async (only?: number) => {
    if (isDrawing) return;
    isDrawing = true;
    try {
      for (;;) {
        const { poses, pictures, bound, gesture, playing } = store.get();
        const index = poses.findIndex(
          ({ fits, hash }, k) => fits && pictures[hash] === undefined && (only === undefined || k === only),
        );
        const hash = poses[index]?.hash;
        if (hash === undefined || !bound || gesture !== null || playing) return;
        const picture = await ctx.session().posePicture(...PICTURE, index);
        // The list may have changed before the picture was drawn.
        if (store.get().poses[index]?.hash !== hash) continue;
        store.set({ pictures: { ...store.get().pictures, [hash]: URL.createObjectURL(picture) } });
      }
    } catch {
      // The cards stay without pictures. The next frame reports a lost device.
    } finally {
      isDrawing = false;
    }
  };

  return {
    /**
     * Finds the pose that was at `index` when its row was drawn. Undefined if it was removed since. The press of a
     * button may change the order or the name before its click arrives, because it commits what was typed.
     */
    indexOf({ name, hash }: PoseView, index: number): number | undefined {
      const { poses } = store.get();
      const is = (k: number) => poses[k]?.hash === hash;
      return (
        [index, ...poses.keys()].find((k) => is(k) && poses[k]?.name === name) ??
        (is(index) ? index : undefined)
      );
    },
    save() {
      if (!store.get().cage) return;
      const moment = store.get().playing && triples(engine().cagePositions());
      edit.settle();
      if (moment) engine().apply({ do: "set_pose", positions: moment });
      const name = freshName(store.get().poses);
      if (!edit.apply({ do: "save_pose", name }, T.did.save)) return;
      void drawPictures(store.get().poses.length - 1);
      ctx.tell.say((store.get().posed ? T.pose.saved : T.pose.savedRest)(name));
    },
    apply(index: number) {
      edit.setEditingRest(false);
      edit.apply({ do: "apply_pose", index }, T.did.pose(store.get().poses[index]?.name ?? ""));
      void drawPictures(index);
    },
    /** Renames a pose. Returns false if the name is empty. */
    rename(index: number, text: string): boolean {
      const name = text.trim().replace(/\s+/g, " ");
      if (name === "") return false;
      return (
        name === store.get().poses[index]?.name ||
        edit.apply({ do: "rename_pose", index, name }, T.did.rename)
      );
    },
    remove: (index: number) => void edit.apply({ do: "remove_pose", index }, T.did.delete),
    /** Replaces a pose by the current one. */
    update(index: number) {
      if (edit.apply({ do: "update_pose", index }, T.did.update)) void drawPictures(index);
    },
    drawPictures,
    /** Inserts a copy after the pose. */
    duplicate(index: number) {
      const name = T.did.copyName(store.get().poses[index]?.name ?? "");
      edit.apply({ do: "duplicate_pose", index, name }, T.did.duplicate);
    },
    move: (index: number, to: number) => void edit.apply({ do: "move_pose", index, to }, T.did.movePose),
    /** Sets the time of a pose in the animation. Returns false if the time is not allowed. */
    time: (index: number, seconds: number): boolean =>
      edit.apply({ do: "set_pose_time", index, seconds }, T.did.time, T.failed.time),
    /** Sets the interpolation of the animation towards a pose; null uses that between all poses. */
    interpolation: (index: number, interpolation: Interpolation | null) =>
      void edit.apply({ do: "set_pose_interpolation", index, interpolation }, T.did.interpolation),
    transition: (transition: Transition) =>
      void edit.apply({ do: "set_transition", transition }, T.did.transition),
    /** Sets a pose's share of the blend. `done`: the slider was released, which adds one undo step. */
    blend(index: number, share: number, done: boolean) {
      edit.setEditingRest(false);
      engine().apply({ do: "blend", index, share });
      if (done) engine().commit(T.did.blend);
    },
    /**
     * Converts the poses of the previous cage to poses of the current cage. With a label, the conversion is an undo
     * step of its own, otherwise a part of the last step.
     */
    carry,
    reset() {
      stop();
      if (store.get().posed) edit.apply({ do: "reset_pose" }, T.did.reset);
    },
    togglePlay() {
      if (player.isPlaying()) stop();
      else if (store.get().walk) player.play(walk.animation);
      else if (fittingPoses(store.get()).length > 0) player.play(animation);
      else ctx.tell.say(T.pose.saveFirst);
    },
    /** Moves the playhead. */
    scrub: (seconds: number) => player.scrub(shown(), seconds),
    /** Keeps the pose at the playhead as one undo step. */
    keepMoment: () => void engine().commit(T.did.scrub),
    stop,
  };
}

/** Actions of the list of saved poses. Indices refer to this list. */
export type PoseActions = ReturnType<typeof createPoses>;

/**
 * Returns the default name of a new pose: "Pose" and the smallest number above the number of poses that makes an unused
 * name.
 */
export function freshName(poses: readonly Pick<PoseView, "name">[]): string {
  const taken = new Set(poses.map((pose) => pose.name));
  let number = poses.length + 1;
  while (taken.has(T.did.poseName(number))) number += 1;
  return T.did.poseName(number);
}
