/** Keeping work: autosave in the browser, the project file, the share link, and coming back from each. */

import type { BindOptions, NamedFile } from "../contract";
import { BIND_DEFAULTS, CAGE_DEFAULTS, type CageWish } from "../defaults";
import { stem } from "../format";
import { encodeShare, fromBase64Url, toBase64Url } from "../share";
import { forgetLocally, loadLocally, saveLocally } from "../store";
import { attempt, type Context } from "./context";

/** The page's own part of a project file. */
export interface Settings {
  bind?: BindOptions;
  cage?: CageWish;
  sample?: string;
  symmetry?: boolean;
  /** `Engine.encodePose`, base 64. */
  pose?: string;
}

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
    } catch {
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

/** Settings from a file, or none: files come from anywhere, so that each part is looked at. */
export function readSettings(text: string): Settings {
  let value: unknown;
  try {
    value = JSON.parse(text || "{}");
  } catch {
    return {};
  }
  if (typeof value !== "object" || value === null) return {};
  const from = value as Record<string, unknown>;
  const settings: Settings = {};
  // Projects from before `preconditioner` and `voxels` have none.
  const bind = typeof from.bind === "object" &&
    from.bind && { preconditioner: BIND_DEFAULTS.preconditioner, ...from.bind };
  if (isBind(bind)) settings.bind = bind;
  const cage = typeof from.cage === "object" && from.cage && { ...CAGE_DEFAULTS, ...from.cage };
  if (isCage(cage)) settings.cage = cage;
  if (typeof from.sample === "string") settings.sample = from.sample;
  if (typeof from.symmetry === "boolean") settings.symmetry = from.symmetry;
  if (typeof from.pose === "string") settings.pose = from.pose;
  return settings;
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

function isBind(value: unknown): value is BindOptions {
  if (typeof value !== "object" || value === null) return false;
  const v = value as Partial<BindOptions>;
  return (
    typeof v.grid === "number" &&
    v.grid >= 8 &&
    v.grid <= 512 &&
    (v.method === "embedded" || v.method === "classic") &&
    (v.solver === "multigrid" || v.solver === "jacobi" || v.solver === "cg") &&
    (v.preconditioner === "none" || v.preconditioner === "v_cycle") &&
    (v.backend === "gpu" || v.backend === "cpu") &&
    (v.cell_shape === "box" || v.cell_shape === "cubic") &&
    (v.delta_norm === "euclidean" || v.delta_norm === "literal") &&
    (v.outside === "closest_point" || v.outside === "refuse") &&
    [v.tau, v.max_iterations, v.sparsify, v.memory_limit].every((n) => typeof n === "number" && n >= 0)
  );
}

function isCage(value: unknown): value is CageWish {
  if (typeof value !== "object" || value === null) return false;
  const v = value as Partial<CageWish>;
  return (
    typeof v.vertices === "number" &&
    typeof v.margin === "number" &&
    typeof v.voxels === "number" &&
    (v.shape === "follow" || v.shape === "hull") &&
    typeof v.per_component === "boolean" &&
    (v.symmetry === "auto" || v.symmetry === "on" || v.symmetry === "off")
  );
}
