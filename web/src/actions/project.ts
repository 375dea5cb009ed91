/** What is open as a project file and as a link. */

import type { SceneOptions, Settings } from "../contract";
import { optionsInUse } from "../derived";
import { stem } from "../format";
import { encodeShare, fromBase64Url, toBase64Url } from "../share";
import type { Context } from "./context";
import type { ControlActions } from "./controls";

export interface Project {
  /** The project file's bytes. */
  write(): Uint8Array<ArrayBuffer>;
  fileName(): string;
  /** The link to copy; undefined when what is open cannot be linked to. */
  link(): Promise<string | undefined>;
}

export function createProject(ctx: Context, shared: ControlActions["shared"]): Project {
  const { store } = ctx;

  const settings = (): string => {
    const state = store.get();
    const controls = shared()?.controls;
    const pose = state.posed ? toBase64Url(ctx.session().engine.encodePose()) : undefined;
    const models = ctx.session().engine.memberSettings();
    const all: Omit<Settings, "notices"> = {
      bind: optionsInUse(state),
      cage: state.cageOptions,
      ...(state.model?.rigged ? { rig: state.rigOptions } : {}),
      symmetry: state.symmetry,
      ...(state.pins.length > 0 ? { pins: [...state.pins] } : {}),
      ...(state.poses.some((pose) => pose.pins?.length)
        ? { pose_pins: state.poses.map(({ pins }) => [...(pins ?? [])]) }
        : {}),
      ...(pose && state.shares.some((share) => share !== 0) ? { pose_shares: [...state.shares] } : {}),
      ...(state.sample && state.sampleCage ? { sample: state.sample } : {}),
      ...(models.length > 0 ? { models } : {}),
      ...(pose ? { pose } : {}),
      ...(controls ? { controls } : {}),
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
      const { sample, sampleCage, posed, scene } = store.get();
      const { engine } = ctx.session();
      if (!sample || !sampleCage || engine.memberSettings().length > 0) return undefined;
      const pose = posed ? engine.encodePose() : undefined;
      const seen = { camera: engine.camera(), selected: [...engine.selection()], scene: ofLink(scene) };
      const controls = shared();
      const link = { sample, seen, ...(pose ? { pose } : {}), ...(controls ? { controls } : {}) };
      const fragment = await encodeShare(link);
      return `${location.origin}${location.pathname}${fragment}`;
    },
  };
}

/** What a link keeps of what is shown: nothing that belongs to the visitor or that must be computed first. */
export function ofLink(scene: SceneOptions): Partial<SceneOptions> {
  const { model, cage, floor, base_wireframe, colour, weights_to_one, problems } = scene;
  return { model, cage, floor, base_wireframe, colour, weights_to_one, problems };
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
