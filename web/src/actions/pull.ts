/** Pulls points of the model: a worker computes the pose of the cage that moves them to their targets. */

import type { SurfacePoint } from "../contract";
import { clamped, SLIDERS } from "../defaults";
import { follow } from "../queue";
import { T } from "../words";
import { attempt, attemptLatest, type Context } from "./context";
import { type Edit, NUDGE_PAUSE_MS } from "./edit";

/** Distance of a grabbed point from its target above which the target is shown, as a fraction of the model's size. */
const MIN_SHOWN_DISTANCE = 0.01;
/** Maximum number of frames that are solved after the pointer is released. */
const MAX_SETTLING_FRAMES = 30;
/** Reach, as a fraction of the model's size, above which the pull moves the whole model. */
const MAX_LOCAL_REACH = SLIDERS.reach.max / 2;
/** Distances from the middle of the view, CSS pixels, and number of directions, in which `nudge` looks for the model. */
const SEARCH_RADII = [40, 80, 160, 320];
const SEARCH_DIRECTIONS = 8;

interface Drag {
  /** Pose of the cage at the start of the drag. */
  readonly before: Float32Array;
  /** Engine revision that the grabbed points belong to. */
  readonly revision: number;
  /** Points of the model, or vertices of the cage. */
  readonly grabs: readonly (SurfacePoint | number)[];
  /** Position of the pointer at the start of the drag, CSS pixels. */
  readonly from: { readonly x: number; readonly y: number };
  /** Initial position of the first grabbed point. */
  place: Float32Array;
  /** Target of the first grabbed point. */
  to: Float32Array;
  /** Number of times that `to` was set. A frame is current if the number has not changed since its request. */
  wanted: number;
  /** Reach of the pull as a fraction of the model's size; null until the solver has chosen it. */
  reach: number | null;
  /** Whether the pointer was released. */
  letGo: boolean;
  /** Movement of the pointer since the start of the drag, CSS pixels. */
  by: { right: number; up: number };
}

export function createPulling(ctx: Context, edit: Pick<Edit, "alsoSettles" | "apply" | "settle">) {
  const { store, engine } = ctx;
  let current: Drag | undefined;
  /** Settles when the last drag has ended and its undo step exists. */
  let ended: Promise<unknown> = Promise.resolve();
  let held: SurfacePoint | undefined;
  let timer: ReturnType<typeof setTimeout> | undefined;

  /** Marks the point that is grabbed, or would be by a press, and its target. Without arguments, removes the marks. */
  const show = (held?: SurfacePoint, target?: Float32Array) => engine().showHeld(held ? [held] : [], target);

  /** Grabs the point that `nudge` moves. Returns false if there is none near the middle of the view. */
  const beginAtMiddle = (): boolean => {
    const place = held ? engine().placeOf(held) : (store.get().grip ?? []);
    const [x = 0, y = 0, z = 0] = place.length > 0 ? place : engine().camera().target;
    const [right = 0, down = 0] = engine().project(x, y, z);
    if (pulling.begin(right, down)) return true;
    for (const radius of SEARCH_RADII)
      for (let k = 0; k < SEARCH_DIRECTIONS; k++) {
        const angle = (2 * Math.PI * k) / SEARCH_DIRECTIONS;
        if (pulling.begin(right + radius * Math.cos(angle), down + radius * Math.sin(angle))) return true;
      }
    return false;
  };

  const isReady = () => {
    const { bound, editingRest, playing, pullReady } = store.get();
    return bound && pullReady && !editingRest && !playing;
  };

  /** Sends the grabbed points, and all pins that are not grabbed, to the worker. */
  const grab = async (drag: Drag) => {
    const { pullWhole, tools } = store.get();
    const [rows, seeds, frames] = engine().gripsOf(drag.grabs, drag.from.x, drag.from.y);
    const { place, stays, reach } = await ctx.session().pullGrab({
      start: drag.before,
      rows,
      seeds,
      frames,
      grabs: drag.grabs.length,
      options: {
        reach:
          pullWhole || (drag.reach ?? 0) > MAX_LOCAL_REACH
            ? "whole"
            : drag.reach === null
              ? "automatic"
              : { of: drag.reach },
        symmetry: tools.symmetry && drag.grabs.length > 1,
      },
    }).done;
    if (current !== drag) return;
    drag.place = place.slice(0, 3);
    drag.reach ??= reach;
    engine().showStays(stays.some((share) => share > 0) ? stays : undefined);
    aim(drag);
  };

  const aim = (drag: Drag) => {
    const [first] = drag.grabs;
    const point = typeof first === "object" ? first : undefined;
    drag.to = engine().followed(drag.place, drag.by.right, drag.by.up, point);
    drag.wanted += 1;
  };

  /** Requests frames from the worker until the pull ends. Pauses after the pose has settled, until the target moves. */
  const run = async (drag: Drag) => {
    await grab(drag);
    let answered = -1;
    let settling = 0;
    while (current === drag) {
      const asked = drag.wanted;
      const { cage, settled, error } = await ctx.session().pullFrame(drag.to).done;
      if (current !== drag) return;
      engine().setCagePositions(cage);
      const [first] = drag.grabs;
      if (typeof first === "object") show(first, error > MIN_SHOWN_DISTANCE ? drag.to : undefined);
      answered = asked;
      settling += drag.letGo ? 1 : 0;
      const isDone = settled && answered === drag.wanted;
      if (drag.letGo && (isDone || settling > MAX_SETTLING_FRAMES)) {
        finish(drag);
        return;
      }
      await new Promise(requestAnimationFrame);
      while (current === drag && !drag.letGo && settled && answered === drag.wanted) {
        await new Promise(requestAnimationFrame);
      }
    }
  };

  /** Whether the model or the cage has changed since the drag began. */
  const isStale = (drag: Drag) => drag.revision !== engine().revision;

  const finish = (drag: Drag) => {
    if (current !== drag) return;
    current = undefined;
    engine().showStays();
    show();
    store.set({ gesture: null });
    if (isStale(drag)) return;
    engine().commit(T.did.pull);
  };

  edit.alsoSettles(() => {
    if (current?.letGo) finish(current);
  });

  const start = (grabs: Drag["grabs"], x: number, y: number) => {
    if (current) finish(current);
    edit.settle();
    const place = new Float32Array(3);
    const drag: Drag = {
      before: engine().cagePositions(),
      revision: engine().revision,
      grabs,
      from: { x, y },
      place,
      to: place,
      wanted: 0,
      reach: null,
      letGo: false,
      by: { right: 0, up: 0 },
    };
    current = drag;
    store.set({ gesture: T.pull.pulling, grip: null });
    ended = attempt(ctx, T.failed.pull, () => run(drag)).then((went) => {
      if (!went && current === drag) pulling.end(false);
    });
    return true;
  };

  const pulling = {
    /** Prepares pulls of the bound model and cage. */
    prepare() {
      store.set({ pullReady: false });
      void attemptLatest(ctx, T.failed.pull, "pull", async (signal) => {
        const job = ctx.session().preparePull();
        // Allow pulling right away: a grab waits until the worker is ready.
        store.set({ pullReady: true });
        try {
          await follow(signal, job);
        } catch (error) {
          store.set({ pullReady: false });
          throw error;
        }
        show();
      });
    },
    /** Marks the point of the model that a press at this position would grab. Returns whether there is one. */
    hover(x: number, y: number): boolean {
      const point = isReady() ? engine().surfaceAt(x, y) : undefined;
      show(point);
      return point !== undefined;
    },
    /** Removes the mark of `hover`. */
    leave() {
      if (!current) show();
    },
    /** Grabs the model at a position of the view. False if the model is not there or pulls are not ready. */
    begin(x: number, y: number): boolean {
      const point = isReady() ? engine().surfaceAt(x, y) : undefined;
      if (!point) return false;
      held = point;
      const image = store.get().tools.symmetry ? engine().imageOf(point) : undefined;
      show(point);
      return start(image ? [point, image] : [point], x, y);
    },
    /** Grabs a vertex of the cage. Returns false if pulls are not ready. */
    beginCage: (vertex: number, x: number, y: number): boolean => isReady() && start([vertex], x, y),
    drag(x: number, y: number) {
      if (!current) return;
      current.by = { right: x - current.from.x, up: y - current.from.y };
      aim(current);
    },
    /** Releases the grab and keeps the pose if `keep` is true; otherwise restores the pose before the drag. */
    end(keep: boolean) {
      const drag = current;
      if (!drag) return;
      if (keep) {
        drag.letGo = true;
        return;
      }
      current = undefined;
      if (!isStale(drag)) engine().revert();
      engine().showStays();
      show();
      store.set({ gesture: null });
    },
    active: (): boolean => current !== undefined && !current.letGo,
    /** If the pointer was released, waits until the pull has ended, at most `MAX_SETTLING_FRAMES` frames later. */
    released: (): Promise<unknown> => (current?.letGo ? ended : Promise.resolve()),
    /** Scales how far the drag reaches along the surface. */
    reach(factor: number) {
      const drag = current;
      if (!drag || drag.reach === null) return;
      drag.reach = clamped(drag.reach * factor, SLIDERS.reach);
      void attempt(ctx, T.failed.pull, () => grab(drag));
    },
    /**
     * Moves a point of the model by CSS pixels: the one grabbed last, the one that the page asks to pull, or the one
     * nearest to the middle of the view.
     */
    nudge(right: number, up: number) {
      if ((!current || current.letGo) && !beginAtMiddle()) {
        ctx.tell.say(T.pull.nothingThere);
        return;
      }
      if (!current) return;
      current.by = { right: current.by.right + right, up: current.by.up - up };
      aim(current);
      clearTimeout(timer);
      timer = setTimeout(() => pulling.end(true), NUDGE_PAUSE_MS);
    },
    /** Adds or removes a pin at a position of the view. False if neither is possible. */
    pin(x: number, y: number): boolean {
      const pins = engine().pinsAfter(x, y, isReady());
      const isNew = (pins?.length ?? 0) > store.get().pins.length;
      return pins !== undefined && edit.apply({ do: "set_pins", pins }, isNew ? T.did.pin : T.did.unpin);
    },
    unpinAll: () => void edit.apply({ do: "set_pins", pins: [] }, T.did.unpin),
    whole: (on: boolean) => store.set({ pullWhole: on }),
  };
  return pulling;
}

export type Pulling = ReturnType<typeof createPulling>;
