/** Writes the open work as a project file or a link. */

import type { MemberInfo, SceneOptions } from "../contract";
import { optionsInUse } from "../derived";
import { exportStem } from "../format";
import { encodeShare } from "../share";
import type { Context } from "./context";
import type { ControlActions } from "./controls";

export function createProject(ctx: Context, shared: ControlActions["shared"]) {
  const { store } = ctx;

  const settings = (): string => {
    const state = store.get();
    const { cageOptions: cage, tools, rigOptions: rig, model } = state;
    const { symmetry } = tools;
    return JSON.stringify({
      bind: optionsInUse(state),
      cage,
      symmetry,
      rig: model?.rigged ? rig : undefined,
    });
  };

  return {
    // wasm-bindgen copies the bytes out of the wasm memory, so their buffer is an ArrayBuffer of its own.
    /** Returns the bytes of a project file with the open work. */
    write: () => ctx.engine().writeProject(settings()) as Uint8Array<ArrayBuffer>,
    /** As `write`, for the work that is saved while the user works. Throws `TooLarge` above a limit. */
    writeKept(): Blob {
      const pieces: Blob[] = [];
      // A Blob keeps its bytes outside the memory of the page.
      ctx.engine().writeKept(settings(), (piece: Uint8Array<ArrayBuffer>) => pieces.push(new Blob([piece])));
      return new Blob(pieces);
    },
    fileName: (): string => `${exportStem(store.get().model?.name ?? "model")}.cagework.glb`,
    /** Creates a link to the open work; undefined if a link cannot contain it. */
    async link(): Promise<string | undefined> {
      const { sample, sampleCage, posed, scene, model, clip: shown } = store.get();
      const engine = ctx.engine();
      if (!sample || !sampleCage || model?.members.some(hasChoices)) return undefined;
      const fragment = await encodeShare({
        sample,
        pose: posed ? engine.encodePose() : undefined,
        seen: { camera: engine.camera(), selected: [...engine.selection()], scene: ofLink(scene) },
        controls: shared(),
        clip: shown.clip ?? undefined,
      });
      return `${location.origin}${location.pathname}${fragment}`;
    },
  };
}

export type Project = ReturnType<typeof createProject>;

/** Scene options that a link contains: no preferences, such as the theme, and no slices. */
export function ofLink(scene: SceneOptions): Partial<SceneOptions> {
  const { model, cage, floor, base_wireframe, colour, weights_to_one, problems, compare } = scene;
  return { model, cage, floor, base_wireframe, colour, weights_to_one, problems, compare };
}

/**
 * Whether a model has settings that a link cannot contain: it is painted or hidden, or parts do not follow the cage.
 */
function hasChoices({ painted, options: { shown, rigid, stays } }: MemberInfo): boolean {
  return painted || !shown || rigid.length + stays.length > 0;
}
