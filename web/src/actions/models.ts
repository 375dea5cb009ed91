/** Adds models to the cage, removes them, and selects which of their parts follow the cage. */

import type { MemberInfo, NamedFile, PartOptions } from "../contract";
import { planDrop } from "../drop";
import { sentence } from "../strings";
import { T } from "../words";
import type { CageActions } from "./cage";
import { attempt, attemptLatest, type Context, waitFor } from "./context";
import type { Edit } from "./edit";
import { modelsOf, type ReadResult, readModels } from "./read";

/** Treatment of a part that does not follow the cage: it keeps its shape, or it stays in place. */
export type Treatment = "rigid" | "stays";

export interface ModelNeeds {
  readonly cage: Pick<CageActions, "load" | "regenerate">;
  readonly edit: Pick<Edit, "apply" | "settle">;
  /** Resolves when the current cage has been checked. */
  checked(): Promise<unknown>;
  openFiles(files: readonly NamedFile[]): Promise<boolean>;
  /** Ends playback and operations in progress before the models change. */
  settle(): void;
}

export function createModels(ctx: Context, { cage, edit, checked, openFiles, settle }: ModelNeeds) {
  const { store } = ctx;
  const members = (): readonly MemberInfo[] => store.get().model?.members ?? [];
  const memberOf = (id: number) => members().find((member) => member.id === id);

  /** Without a cage, generates one. This cancels a generation in progress, which is for the previous models. */
  const remakeCage = () => {
    if (!store.get().cage) void cage.regenerate();
  };

  const models = {
    /** Adds models from files to the open cage. If no model is open, opens the files instead. */
    async add(files: readonly NamedFile[]): Promise<boolean> {
      const plan = planDrop(files.map((file) => file.path || file.name));
      if (!store.get().model) return openFiles(files);
      if (plan.kind !== "model") {
        const message = plan.kind === "project" ? T.models.noProject : plan.sentence;
        ctx.tell.problem({ title: T.models.notAdded, message });
        return false;
      }
      ctx.tell.clear();
      const went = await attemptLatest(ctx, T.models.notAdded, "open", async (signal) => {
        const held = ctx.session().held();
        const reads = await readModels(ctx, signal, modelsOf(files, plan), "add", held);
        settle();
        const n = members().length;
        await models.join(reads, signal, T.did.addModels);
        store.set({ busy: null });
        if (members().length === n) return;
        remakeCage();
        void checked().then(() => {
          const around = { label: T.models.makeAround, run: () => void cage.regenerate() };
          const isOut = store.get().check?.some(({ code }) => code === "model_outside");
          if (isOut) ctx.tell.say(T.models.outside, around);
        });
      });
      const second = files[plan.second ?? -1];
      return second && went ? cage.load([second], true) : went;
    },
    /**
     * Adds models that were read from files. `label` returns the name of the undo step for a number of models; without
     * it, no step is added.
     */
    join(
      others: readonly ReadResult[],
      signal: AbortSignal,
      label?: (models: number) => string,
    ): Promise<boolean> {
      const [first] = others;
      if (!first) return Promise.resolve(true);
      const title = others.length > 1 ? T.models.notAdded : T.failed.open(first.name);
      return attempt(ctx, title, async () => {
        const reads = others.map(({ read }) => read);
        const what = T.opening.joining(members().length + reads.length);
        const notices = await waitFor(ctx, signal, what, () => ctx.session().add(reads, label));
        const { model } = store.get();
        if (model) store.set({ model: { ...model, notices: [...new Set([...model.notices, ...notices])] } });
      });
    },
    /** Gives a model the joints, joint weights and morph targets of another one. */
    copyRig(id: number, body: number): Promise<boolean> {
      const name = memberOf(id)?.name ?? "";
      ctx.tell.clear();
      return attemptLatest(ctx, T.models.rigNotCopied(name), "open", async (signal) => {
        settle();
        const { report } = await waitFor(ctx, signal, T.models.copyingRig(name), (hear) =>
          ctx.session().copyRig(id, body, T.did.copyRig(name), hear),
        );
        ctx.tell.say(sentence(report));
      });
    },
    /** Removes a model, and remakes the cage. */
    remove(id: number): boolean {
      settle();
      const label = T.did.removeModel(memberOf(id)?.name ?? "");
      const went = edit.apply({ do: "remove_model", id }, label, T.models.notRemoved);
      if (went) remakeCage();
      return went;
    },
    /** Shows or hides a model, without an undo step. */
    show(id: number, shown: boolean) {
      const member = memberOf(id);
      if (!member) return;
      const engine = ctx.engine();
      edit.settle();
      engine.apply({ do: "set_parts", id, options: { ...member.options, shown } });
      engine.amend();
    },
    /**
     * Makes a part keep its shape or stay in place. If it already does, makes it follow the cage again. "all" is the
     * whole model.
     */
    part(id: number, name: string, how: Treatment) {
      const member = memberOf(id);
      if (!member) return;
      const { options } = member;
      const others = { rigid: rest(options.rigid, name), stays: rest(options.stays, name) };
      const isOn = options[how].includes(name);
      const next: PartOptions = { ...options, ...others, ...(isOn ? {} : { [how]: [...others[how], name] }) };
      settle();
      edit.apply({ do: "set_parts", id, options: next }, T.did.parts(member.name), T.models.notParts);
    },
  };
  return models;
}

export type Models = ReturnType<typeof createModels>;

const rest = (names: readonly string[], name: string) => names.filter((other) => other !== name);
