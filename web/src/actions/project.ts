/** Keeping work: autosave in the browser, the project file, the share link, and coming back from each. */

import type { NamedFile, Settings } from "../contract";
import { isFatal } from "../crash";
import { stem } from "../format";
import { encodeShare, fromBase64Url, toBase64Url } from "../share";
import { forgetLocally, loadLocally, saveLocally } from "../store";
import { attempt, type Context } from "./context";

export interface Project {
  /** The project file's bytes. */
  write(): Uint8Array<ArrayBuffer>;
  fileName(): string;
  /** The link to copy; undefined when what is open cannot be linked to. */
  link(): Promise<string | undefined>;
  /** Saves a little later; many calls make one. */
  touch(): void;
  /** The project of the last visit. */
  restore(): Promise<{ files: NamedFile[]; when: number; name: string } | undefined>;
  forget(): Promise<void>;
}

const PAUSE_MS = 1500;
/** Larger projects are not kept by themselves: writing them would be felt with each change. */
const LARGEST = 200 * 1024 ** 2;

export function createProject(ctx: Context): Project {
  const { store } = ctx;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let saving = false;
  let failed = false;

  const settings = (): string => {
    const state = store.get();
    const pose = state.posed ? toBase64Url(ctx.session().engine.encodePose()) : undefined;
    const all: Settings = {
      bind: state.bindOptions,
      cage: state.cageOptions,
      symmetry: state.symmetry,
      ...(state.sample && state.sampleCage ? { sample: state.sample } : {}),
      ...(pose ? { pose } : {}),
    };
    return JSON.stringify(all);
  };

  const write = (): Uint8Array<ArrayBuffer> => {
    const { poses } = store.get();
    return new Uint8Array(
      ctx.session().engine.writeProject(
        poses.map((pose) => pose.name),
        poses.map((pose) => pose.positions),
        settings(),
      ),
    );
  };

  const fileName = () => `${stem(store.get().model?.name ?? "model")}.cagework.glb`;

  const save = async () => {
    const { cage, model, bindRun, gesture, playing, editingRest } = store.get();
    if (!cage?.usable || !model || failed) return;
    if (saving || bindRun || gesture || playing || editingRest) {
      touch();
      return;
    }
    saving = true;
    try {
      const bytes = write();
      if (bytes.length > LARGEST) return;
      const when = Date.now();
      await saveLocally({ bytes, name: model.name, when });
      store.set({ savedAt: when });
    } catch (error) {
      if (isFatal(error)) {
        reportError(error);
        return;
      }
      // Private windows and full disks refuse: say it once, and do not try again.
      failed = true;
      ctx.tell.say(
        "This browser does not let the page keep your work. Save a project file before you close it.",
      );
    } finally {
      saving = false;
    }
  };

  const touch = () => {
    clearTimeout(timer);
    timer = setTimeout(() => void save(), PAUSE_MS);
  };

  return {
    write,
    fileName,
    async link() {
      const { sample, sampleCage, posed } = store.get();
      if (!sample || !sampleCage) return undefined;
      const pose = posed ? ctx.session().engine.encodePose() : undefined;
      const fragment = await encodeShare(pose ? { sample, pose } : { sample });
      return `${location.origin}${location.pathname}${fragment}`;
    },
    touch,
    async restore() {
      try {
        const saved = await loadLocally();
        if (!saved) return undefined;
        const name = `${stem(saved.name)}.cagework.glb`;
        const file = new Blob([new Uint8Array(saved.bytes)]);
        return { files: [{ name, path: name, file }], when: saved.when, name: saved.name };
      } catch {
        // No storage in this browser: there is nothing to come back to.
        return undefined;
      }
    },
    async forget() {
      clearTimeout(timer);
      await attempt(ctx, "The saved work could not be removed", forgetLocally);
      store.set({ savedAt: null });
    },
  };
}

/** The pose of settings as bytes, if it has one that can be read. */
export function poseOf(settings: Settings): Uint8Array | undefined {
  if (settings.pose === undefined) return undefined;
  try {
    return fromBase64Url(settings.pose);
  } catch {
    // A damaged pose is no reason to refuse the project; it opens at rest.
    return undefined;
  }
}
