/** Changes the proportions of a humanoid: sliders, presets, and the joints of its bones. */

import type { Bone } from "../contract";
import { follow } from "../queue";
import { T } from "../words";
import type { Context } from "./context";
import type { Edit } from "./edit";

export function createProportions(ctx: Context, edit: Pick<Edit, "apply" | "setEditingRest">) {
  const { store, engine } = ctx;
  return {
    /** Sets a factor, such as that of "leg" or "left_leg". */
    set(name: string, factor: number) {
      edit.setEditingRest(false);
      engine().apply({ do: "set_proportion", name, factor });
    },
    /** Adds an undo step with the changes of the slider with this title. */
    commit: (title: string) => void engine().commit(T.did.proportion(title)),
    /** Sets all factors to those of a preset; null sets them to 1. */
    preset(name: string | null) {
      edit.setEditingRest(false);
      edit.apply({ do: "set_preset", name }, T.did.proportions);
    },
    /** Sets whether left and right have sliders of their own. If they are joined, the right side follows the left. */
    apart(on: boolean) {
      if (!on) edit.apply({ do: "mirror_proportions" }, T.did.proportions);
      store.set({ apart: on });
    },
    /** Names the joint of a bone; null takes the joint that was found. */
    bone: (bone: Bone, joint: string | null) =>
      void edit.apply({ do: "set_bone", bone, joint }, T.did.bone, T.failed.bone),
    /** Measures in the worker where the model begins to fold, unless this is known. */
    async measure() {
      const { humanoid, bound, bindRun, folds } = store.get();
      if (!humanoid?.source || !bound || bindRun !== null || folds !== null) return;
      // An empty list until the ranges are known prevents a second measurement.
      store.set({ folds: [] });
      const measure = (signal: AbortSignal) => follow(signal, ctx.session().proportionRanges());
      try {
        store.set({ folds: await ctx.queue.replace("folds", measure) });
      } catch {
        // The sliders stay without these marks.
      }
    },
  };
}

export type ProportionActions = ReturnType<typeof createProportions>;
