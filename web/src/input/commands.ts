/** What each command of the shortcut table does. */

import type { App } from "../app";
import type { Element as CageElement, Gesture } from "../contract";
import { controlCount, elementInUse } from "../derived";
import { T } from "../words";
import type { Command } from "./shortcuts";

/** Movement of the selection by an arrow key, CSS pixels. */
const NUDGE = 2;
/** Movement of the selection by an arrow key with Shift, CSS pixels. */
const FAR_NUDGE = 20;
const NEXT_ELEMENT: Record<CageElement, CageElement> = { vertex: "edge", edge: "face", face: "vertex" };

export function createCommands(app: App): Record<Command, () => void> {
  const { store, edit, pull, view, poses, cage, bind, painting, exports, tour } = app;
  const { engine } = app.ctx;
  const hasCage = () => store.get().cage !== null;

  const withCage = (work: () => void) => () => {
    if (hasCage()) work();
  };
  const gesture = (kind: Gesture) =>
    withCage(() => {
      if (edit.active()) edit.end(false);
      poses.stop();
      const { x, y } = app.pointer();
      if (!edit.begin(kind, x, y)) app.ctx.tell.say(T.pose.selectFirst);
    });
  const axis = (index: 0 | 1 | 2, plane: boolean) => () => edit.constrain(index, plane);
  const nudge = (right: number, up: number) =>
    withCage(() => {
      if (store.get().selected.count === 0 && store.get().scene.pull) pull.nudge(right, up);
      else edit.nudge(right, up);
    });
  const turn = (way: "undo" | "redo") => () => {
    if (edit.active() || pull.active() || painting.active()) {
      edit.end(false);
      pull.end(false);
      painting.end(false);
      return;
    }
    edit.settle();
    engine()[way]();
  };
  const neighbour = (step: 1 | -1) =>
    withCage(() => {
      const n = controlCount(store.get());
      if (n === 0) return;
      const { last } = store.get().selected;
      const next = last === null ? (step === 1 ? 0 : n - 1) : (last + step + n) % n;
      engine().select(Uint32Array.of(next), "replace");
    });

  const stop = (by: 1 | -1) => void tour.guide()?.go(Math.max(0, (store.get().tour?.stop ?? 0) + by));

  return {
    grab: gesture("grab"),
    rotate: gesture("rotate"),
    scale: gesture("scale"),
    axisX: axis(0, false),
    axisY: axis(1, false),
    axisZ: axis(2, false),
    planeX: axis(0, true),
    planeY: axis(1, true),
    planeZ: axis(2, true),
    keep: () => edit.end(true),
    cancel: () => {
      if (store.get().placing) app.controls.finish();
      else if (edit.active()) edit.end(false);
      else if (pull.active()) pull.end(false);
      else if (painting.active()) painting.end(false);
      else if (store.get().painting) painting.on(null);
      else if (store.get().boxArmed) store.set({ boxArmed: false });
      else if (store.get().playing) poses.stop();
      else if (app.ctx.tell.closeLatest()) return;
      else if (store.get().seeOpen) store.set({ seeOpen: false });
      else void tour.guide()?.end();
    },
    gizmoMove: () => view.gizmo("move"),
    gizmoRotate: () => view.gizmo("rotate"),
    gizmoScale: () => view.gizmo("scale"),
    toolPull: () => view.scene({ gizmo: null, pull: true }),
    toolSelect: () => view.scene({ gizmo: null, pull: false }),
    pin: () => {
      const { x, y } = app.pointer();
      if (store.get().scene.pull) pull.pin(x, y);
    },
    symmetry: () => view.tools({ symmetry: !store.get().tools.symmetry }),
    proportional: () => {
      view.tools({ proportionalOn: !store.get().tools.proportionalOn });
      if (edit.active()) edit.drag(app.pointer().x, app.pointer().y);
    },
    nudgeLeft: nudge(-NUDGE, 0),
    nudgeRight: nudge(NUDGE, 0),
    nudgeUp: nudge(0, NUDGE),
    nudgeDown: nudge(0, -NUDGE),
    nudgeLeftFar: nudge(-FAR_NUDGE, 0),
    nudgeRightFar: nudge(FAR_NUDGE, 0),
    nudgeUpFar: nudge(0, FAR_NUDGE),
    nudgeDownFar: nudge(0, -FAR_NUDGE),
    undo: turn("undo"),
    redo: turn("redo"),

    selectAll: withCage(() => engine().selectAll()),
    selectNone: withCage(() => engine().select(new Uint32Array(), "replace")),
    selectLinked: withCage(() => engine().selectLinked()),
    selectInvert: withCage(() => {
      const all = Uint32Array.from({ length: controlCount(store.get()) }, (_, i) => i);
      engine().select(all, "toggle");
    }),
    boxSelect: withCage(() => store.set({ boxArmed: !store.get().boxArmed })),
    elementMode: () => view.element(NEXT_ELEMENT[elementInUse(store.get())]),
    previousVertex: neighbour(-1),
    nextVertex: neighbour(1),

    frameSelection: () => engine().frameSelection(),
    frameAll: () => engine().frameAll(),
    viewFront: () => engine().axisView(2, false),
    viewRight: () => engine().axisView(0, false),
    viewTop: () => engine().axisView(1, false),
    viewBack: () => engine().axisView(2, true),
    viewLeft: () => engine().axisView(0, true),
    viewBottom: () => engine().axisView(1, true),
    ortho: () => view.ortho(),
    // The keyboard handler calls `view.original` directly, on key down and key up.
    original: () => undefined,
    toggleCage: () => view.scene({ cage: !store.get().scene.cage }),
    toggleWire: () => view.scene({ base_wireframe: !store.get().scene.base_wireframe }),
    heatMap: () => view.scene({ colour: store.get().scene.colour === "weight" ? "material" : "weight" }),
    see: () => store.set({ seeOpen: !store.get().seeOpen }),

    restMode: withCage(() => edit.setEditingRest(!store.get().editingRest)),
    split: () => edit.restEdit("split_edge"),
    collapse: () => edit.restEdit("collapse_edge"),
    extrude: () => edit.restEdit("extrude_face"),
    remove: () => edit.restEdit(store.get().tools.element === "face" ? "delete_face" : "delete_vertex"),

    savePose: () => poses.save(),
    play: () => poses.togglePlay(),
    playClip: () => void app.clips.toggle(),
    resetPose: () => poses.reset(),

    open: () => app.chooseModel(),
    saveProject: withCage(() => void exports.save("project")),
    bind: () => {
      if (!hasCage()) void cage.make().then((made) => made && bind.start());
      else void bind.start();
    },
    tour: () => void tour.start(),
    nextStop: () => stop(1),
    previousStop: () => stop(-1),
    sheet: () => store.set({ sheetOpen: true }),
  };
}
