/** Saves, renames, blends and plays poses. */

import type { CageArrays, PoseView, Transition } from "../contract";
import { fittingPoses } from "../derived";
import { triples } from "../points";
import { follow } from "../queue";
import { T } from "../words";
import { attempt, type Context } from "./context";
import type { Edit } from "./edit";

/** Indices refer to the list of saved poses. */
export interface PoseActions {
  save(): void;
  apply(index: number): void;
  rename(index: number, name: string): void;
  remove(index: number): void;
  /** Replaces a pose by the current one. */
  update(index: number): void;
  /** Inserts a copy after the pose. */
  duplicate(index: number): void;
  move(index: number, to: number): void;
  /** Sets the time of a pose in the animation. Returns whether that is possible. */
  time(index: number, seconds: number): boolean;
  transition(transition: Transition): void;
  /** Sets a pose's share of the blend. `done`: the slider was released, which adds one undo step. */
  blend(index: number, share: number, done: boolean): void;
  /**
   * Converts the poses of the previous cage to poses of the current cage. With a label, this is an undo step of its
   * own, otherwise a part of the last step.
   */
  carry(before: Carriable, label?: string): Promise<boolean>;
  reset(): void;
  togglePlay(): void;
  stop(): void;
}

/** A cage and its poses, stored before the cage is replaced. */
export interface Carriable {
  readonly cage: CageArrays;
  /** The current pose, then each saved pose that fits this cage. `[1 + n_poses, n_controls, 3]` */
  readonly poses: Float32Array;
  readonly shares: readonly number[];
}

/** The current cage and its poses; undefined without a cage. */
export function carriableOf(ctx: Context): Carriable | undefined {
  const { cage, shares } = ctx.store.get();
  const session = ctx.session();
  return cage ? { cage: session.cageArrays(), poses: session.engine.carriable(), shares } : undefined;
}

export function createPoses(ctx: Context, edit: Edit): PoseActions {
  const { store } = ctx;
  const engine = () => ctx.session().engine;
  let frame: number | undefined;

  const stop = () => {
    if (frame === undefined) return;
    cancelAnimationFrame(frame);
    frame = undefined;
    engine().revert();
    store.set({ playing: false, playingPose: null });
  };
  // Undo steps must not contain an intermediate pose of the animation.
  edit.alsoSettles(stop);

  const carry: PoseActions["carry"] = ({ cage, poses, shares }, label) => {
    const n = cage.positions.length;
    const isAtRest = cage.positions.every((x, i) => x === poses[i]);
    return attempt(ctx, T.failed.carry, () =>
      ctx.queue.add("carry", async (signal) => {
        if (!label && isAtRest && poses.length === n) return;
        const carried = await follow(signal, ctx.session().carryPoses(cage, poses));
        stop();
        if (label) edit.setEditingRest(false);
        // A cage that was in its rest pose stays in its rest pose.
        if (!label && (isAtRest || store.get().editingRest)) carried.set(engine().cagePositions());
        const positions = triples(carried);
        engine().apply({ do: "carry_poses", from: n / 3, positions, shares: [...shares] }, label);
        if (!label) engine().amend();
      }),
    );
  };

  const step = (start: number) => (now: number) => {
    const { animationSeconds, transition } = store.get();
    const played = (now - start) / 1000;
    if (played > animationSeconds && !transition.loops) {
      stop();
      return;
    }
    const seconds = played % Math.max(animationSeconds, 0.001);
    engine().playAt(seconds);
    const next = fittingPoses(store.get()).find((pose) => pose.seconds >= seconds);
    store.set({ playingPose: next?.name ?? null });
    frame = requestAnimationFrame(step(start));
  };

  return {
    save() {
      if (!store.get().cage) return;
      const moment = store.get().playing && triples(engine().cagePositions());
      edit.settle();
      if (moment) engine().apply({ do: "set_pose", positions: moment });
      const name = freshName(store.get().poses);
      if (!edit.apply({ do: "save_pose", name }, T.did.save)) return;
      ctx.tell.say((store.get().posed ? T.pose.saved : T.pose.savedRest)(name));
    },
    apply(index) {
      edit.setEditingRest(false);
      edit.apply({ do: "apply_pose", index }, T.did.pose(store.get().poses[index]?.name ?? ""));
    },
    rename(index, text) {
      const name = text.trim();
      if (name === "" || name === store.get().poses[index]?.name) return;
      edit.apply({ do: "rename_pose", index, name }, T.did.rename);
    },
    remove: (index) => void edit.apply({ do: "remove_pose", index }, T.did.delete),
    update: (index) => void edit.apply({ do: "update_pose", index }, T.did.update),
    duplicate(index) {
      const name = T.did.copyName(store.get().poses[index]?.name ?? "");
      edit.apply({ do: "duplicate_pose", index, name }, T.did.duplicate);
    },
    move: (index, to) => void edit.apply({ do: "move_pose", index, to }, T.did.movePose),
    time: (index, seconds) => edit.apply({ do: "set_pose_time", index, seconds }, T.did.time),
    transition: (transition) => void edit.apply({ do: "set_transition", transition }, T.did.transition),
    blend(index, share, done) {
      edit.setEditingRest(false);
      engine().apply({ do: "blend", index, share });
      if (done) engine().commit(T.did.blend);
    },
    carry,
    reset() {
      stop();
      if (store.get().posed) edit.apply({ do: "reset_pose" }, T.did.reset);
    },
    togglePlay() {
      if (frame !== undefined) {
        stop();
        return;
      }
      if (fittingPoses(store.get()).length === 0) {
        ctx.tell.say(T.pose.saveFirst);
        return;
      }
      edit.setEditingRest(false);
      frame = requestAnimationFrame(step(performance.now()));
      store.set({ playing: true });
    },
    stop,
  };
}

/**
 * The default name of a new pose: "Pose" and a number, the first one above the number of poses whose name is not used.
 */
export function freshName(poses: readonly Pick<PoseView, "name">[]): string {
  const taken = new Set(poses.map((pose) => pose.name));
  let number = poses.length + 1;
  while (taken.has(T.did.poseName(number))) number += 1;
  return T.did.poseName(number);
}
