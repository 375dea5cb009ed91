/** A live example: opens a share link on a canvas, and moves from rest to its pose or plays its clip. */

import { takeControls } from "../actions/controls";
import type { SceneOptions } from "../contract";
import { BIND_DEFAULTS, CAGE_DEFAULTS, RIG_DEFAULTS, SCENE_DEFAULTS } from "../defaults";
import { openSession } from "../session";
import type { ShareLink } from "../share";

/** Duration of a movement, ms. Movements longer than five seconds would need a button that stops them (WCAG 2.2.2). */
const MOVE_MS = 1800;
const CLIP_MS = 4000;
/** Maximum device pixel ratio. It is low, because the gallery draws six views. */
const MAX_PIXEL_RATIO = 1.5;

export type LiveExample = Awaited<ReturnType<typeof openLive>>;

/** Opens the link in `holder`, bound and in its pose. `lost` is called if the GPU device is lost. */
export async function openLive(
  holder: HTMLElement,
  link: ShareLink,
  theme: SceneOptions["theme"],
  lost: (reason: string) => void,
) {
  let canvas: HTMLCanvasElement | undefined;
  const freshCanvas = () => {
    canvas?.remove();
    canvas = document.createElement("canvas");
    canvas.setAttribute("aria-hidden", "true");
    holder.append(canvas);
    return canvas;
  };
  /** Number of saved poses. */
  let saved = 0;
  const session = await openSession(
    { canvas: freshCanvas, freshCanvas },
    {
      fresh: Promise.resolve(false),
      changed: ({ poses }) => {
        saved = poses.length;
      },
    },
  ).catch((error: unknown) => {
    canvas?.remove();
    throw error;
  });
  const { engine } = session;
  const { sample, pose, seen, controls, clip } = link;
  let frame = 0;
  const sizes = new ResizeObserver(() => resize());
  const close = () => {
    cancelAnimationFrame(frame);
    sizes.disconnect();
    canvas?.remove();
    session.rest();
  };
  session.onLost((reason) => {
    close();
    lost(reason);
  });

  const resize = () => {
    const { clientWidth, clientHeight } = holder;
    if (clientWidth > 0 && clientHeight > 0)
      engine.resize(clientWidth, clientHeight, Math.min(MAX_PIXEL_RATIO, devicePixelRatio));
  };
  const applyTheme = (theme: SceneOptions["theme"]) =>
    engine.setScene({ ...SCENE_DEFAULTS, ...seen?.scene, theme });

  try {
    resize();
    sizes.observe(holder);
    applyTheme(theme);
    const { model } = await session.openSample(sample);
    if (!engine.cageState())
      session.takeCage(await session.generateCage(CAGE_DEFAULTS, () => undefined).done);
    if (controls) takeControls(engine, controls);
    await session.bind({ ...BIND_DEFAULTS, backend: "cpu" }, () => undefined).done;
    if (model.splats > 0) await session.loadLattice(BIND_DEFAULTS.grid).done;
    if (seen) engine.setCamera(seen.camera);
    // Each kind makes the pictures narrower, and the engine moves the camera away accordingly.
    for (const kind of seen?.scene.compare ?? [])
      if (kind !== "harmonic") await session.bindByFormula(kind).done;
    if (pose) engine.decodePose(pose);
    // `blend` interpolates between the cage at rest and a saved pose.
    engine.apply({ do: "save_pose", name: sample }, sample);
    if (clip !== undefined) await engine.startClip(RIG_DEFAULTS);
  } catch (error) {
    close();
    throw error;
  }
  session.rest();

  const length = clip === undefined ? MOVE_MS : CLIP_MS;
  const at = (ms: number) => {
    if (clip === undefined) engine.apply({ do: "blend", index: saved - 1, share: ms / MOVE_MS });
    else {
      const { seconds = 1 } = engine.modelInfo().clips[clip] ?? {};
      engine.showClip(clip, (ms / 1000) % seconds, new Float32Array(), false);
    }
  };

  return {
    applyTheme,
    /** Moves the example once; if `isStill`, shows only the end of the movement. Draws nothing afterwards. */
    play(isStill: boolean) {
      cancelAnimationFrame(frame);
      const start = performance.now();
      const step = (now: number) => {
        const ms = isStill ? length : Math.min(length, Math.max(0, now - start));
        at(ms);
        if (ms < length) frame = requestAnimationFrame(step);
      };
      step(start);
    },
    /** Ends the movement. */
    stop() {
      cancelAnimationFrame(frame);
      at(length);
    },
    orbit: (dx: number, dy: number) => engine.orbit(dx, dy),
  };
}
