/** What is open as a project file and as a link. */

import type { Settings } from "../contract";
import { stem } from "../format";
import { encodeShare, fromBase64Url, toBase64Url } from "../share";
import type { Context } from "./context";

export interface Project {
  /** The project file's bytes. */
  write(): Uint8Array<ArrayBuffer>;
  fileName(): string;
  /** The link to copy; undefined when what is open cannot be linked to. */
  link(): Promise<string | undefined>;
}

export function createProject(ctx: Context): Project {
  const { store } = ctx;

  const settings = (): string => {
    const state = store.get();
    const pose = state.posed ? toBase64Url(ctx.session().engine.encodePose()) : undefined;
    const all: Omit<Settings, "notices"> = {
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
  };
}

/** The pose of settings as bytes, if it has one that can be read. */
export function poseOf(settings: Pick<Settings, "pose">): Uint8Array | undefined {
  if (settings.pose === undefined) return undefined;
  try {
    return fromBase64Url(settings.pose);
  } catch {
    // A damaged pose is no reason to refuse the project; it opens at rest.
    return undefined;
  }
}
