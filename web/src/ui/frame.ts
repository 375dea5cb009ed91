import { useLayoutEffect } from "preact/hooks";
import type { App } from "../app";
import type { Engine } from "../contract";

/**
 * Calls `place` after each rendering of the component and after each drawn frame, to move elements with the view. The
 * session must be open.
 */
export function useFrames(app: App, place: (engine: Engine) => void): void {
  useLayoutEffect(() => {
    const session = app.ctx.session();
    const hear = () => place(session.engine);
    hear();
    return session.onFrame(hear);
  });
}
