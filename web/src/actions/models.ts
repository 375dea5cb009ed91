/** The models that share the cage: more of them, fewer, and which parts of them follow it. */

import type { MemberInfo, ModelInfo, NamedFile, PartOptions } from "../contract";
import { planDrop } from "../drop";
import type { Store } from "../signals";
import { T } from "../words";
import type { CageActions } from "./cage";
import { attempt, type Context, report, waitFor } from "./context";
import { modelsOf, type Named, readModels } from "./read";

/** What a part may do instead of following the cage. */
export type How = "rigid" | "stays";

export interface Models {
  /** Puts models of files into the cage that is open. */
  add(files: readonly NamedFile[]): Promise<boolean>;
  /** The same with those that were read, before there is a cage; not a step of the history. Can be cancelled. */
  join(others: readonly Named[], signal: AbortSignal): Promise<boolean>;
  /** Takes a model out of the cage. */
  bin(id: number): Promise<boolean>;
  /** Shows or hides it; no step of the history, as nothing else of the view is. */
  show(id: number, shown: boolean): void;
  /** A part keeps its shape, or stays as it is; or follows the cage again. "all" is the whole model. */
  part(id: number, name: string, how: How): void;
}

export interface ModelNeeds {
  readonly cage: Pick<CageActions, "adopt" | "load" | "regenerate">;
  openFiles(files: readonly NamedFile[]): Promise<boolean>;
  /** Ends what plays or is under way: another model is another shape. */
  settle(): void;
}

export function createModels(ctx: Context, { cage, openFiles, settle }: ModelNeeds): Models {
  const { store } = ctx;
  const engine = () => ctx.session().engine;
  const members = (): readonly MemberInfo[] => store.get().model?.members ?? [];
  const nameOf = (id: number) => members().find((member) => member.id === id)?.name ?? "";

  const take = (info: ModelInfo) => takeModel(store, info);

  /** Others are in the cage: it is looked at again, and bound again. */
  const changed = async (info: ModelInfo) => {
    take(info);
    const { cage: state, cageClip } = store.get();
    if (!info.clips.some(({ name }) => name === cageClip)) store.set({ cageClip: null });
    if (!state) {
      // One that was being made was for other models.
      void cage.regenerate();
      return false;
    }
    // Another value, so that whoever follows the cage hears of it.
    const isChecked = await cage.adopt({ ...state }, null);
    const isOut = store.get().check?.problems.some(({ code }) => code === "model_outside");
    return isChecked && isOut === true;
  };

  /** What belongs to a step besides the models. */
  const now = () => {
    const { sample, sampleCage } = store.get();
    return { sample, sampleCage };
  };
  /** Some come, or go; `looked`: the cage was looked at again. */
  const turn = async (ids: readonly number[], binned: boolean, others: ReturnType<typeof now>) => {
    settle();
    const info = await engine().bin(Uint32Array.from(ids), binned);
    const looked = changed(info);
    // What adopts a cage takes it for another one than the sample's.
    store.set({ sample: others.sample, sampleCage: others.sampleCage });
    return { looked };
  };
  /** The same, as undo and redo do it. */
  const turnBack = async (...how: Parameters<typeof turn>) => {
    await (await turn(...how)).looked;
  };

  const put = (id: number, options: Omit<PartOptions, "shown">) => {
    settle();
    const shown = members().find((member) => member.id === id)?.options.shown ?? true;
    take(engine().setParts(id, { ...options, shown }));
  };

  const models: Models = {
    async add(files) {
      const plan = planDrop(files.map((file) => file.path || file.name));
      if (!store.get().model) return openFiles(files);
      if (plan.kind !== "model") {
        const message = plan.kind === "project" ? T.models.noProject : plan.sentence;
        ctx.tell.problem({ title: T.models.notAdded, message });
        return false;
      }
      const before = now();
      const went = await attempt(ctx, T.models.notAdded, () => {
        ctx.tell.clear();
        return ctx.queue.replace("open", async (signal) => {
          const reads = await readModels(ctx, signal, modelsOf(files, plan), "add");
          settle();
          const n = members().length;
          await models.join(reads, signal);
          store.set({ busy: null });
          const { model } = store.get();
          const ids = members()
            .slice(n)
            .map(({ id }) => id);
          if (!model || ids.length === 0) return;
          store.set({ sample: null });
          const after = { sample: null, sampleCage: false };
          ctx.history.push({
            label: T.did.addModels(ids.length),
            undo: () => turnBack(ids, true, before),
            redo: () => turnBack(ids, false, after),
          });
          void changed(model).then((isOut) => {
            const around = { label: T.models.makeAround, run: () => void cage.regenerate() };
            if (isOut) ctx.tell.say(T.models.outside, around);
          });
        });
      });
      const second = files[plan.second ?? -1];
      return second && went ? cage.load([second], true) : went;
    },
    join(others, signal) {
      const [first] = others;
      if (!first) return Promise.resolve(true);
      const title = others.length > 1 ? T.models.notAdded : T.failed.open(first.name);
      const say = (k: number) =>
        store.set({ busy: T.opening.fileOf(others[k]?.name ?? "", k, others.length) });
      return attempt(ctx, title, async () => {
        const reads = others.map(({ read }) => read);
        const what = T.opening.fileOf(first.name, 0, others.length);
        take(await waitFor(ctx, signal, what, () => ctx.session().add(reads, say)));
      });
    },
    bin(id) {
      const label = T.did.binModel(nameOf(id));
      const work = async () => {
        const before = now();
        const after = { sample: null, sampleCage: false };
        const { looked } = await turn([id], true, after);
        const [undo, redo] = [() => turnBack([id], false, before), () => turnBack([id], true, after)];
        ctx.history.push({ label, undo, redo });
        await looked;
      };
      return attempt(ctx, T.models.notBinned, () => ctx.queue.add("open", work));
    },
    show(id, shown) {
      const member = members().find((one) => one.id === id);
      if (member) take(engine().setParts(id, { ...member.options, shown }));
    },
    part(id, name, how) {
      const before = members().find((member) => member.id === id)?.options;
      if (!before) return;
      const others = { rigid: rest(before.rigid, name), stays: rest(before.stays, name) };
      const isOn = before[how].includes(name);
      const after = { ...before, ...others, ...(isOn ? {} : { [how]: [...others[how], name] }) };
      try {
        put(id, after);
        ctx.history.push({
          label: T.did.parts(nameOf(id)),
          undo: () => put(id, before),
          redo: () => put(id, after),
        });
      } catch (error) {
        report(ctx, T.models.notParts, error);
      }
    },
  };
  return models;
}

/** The page's side of the models as they are now. */
export function takeModel(store: Store, info: ModelInfo): void {
  const { model } = store.get();
  // What is open alone may be called otherwise: a sample by its label, a project by its file.
  const name = info.members.length === 1 && model?.members.length === 1 ? model.name : info.name;
  // Those of the files were said when they were read.
  const notices = [...new Set([...(model?.notices ?? []), ...info.notices])];
  store.set({ model: { ...info, name, notices } });
}

const rest = (names: readonly string[], name: string) => names.filter((other) => other !== name);
