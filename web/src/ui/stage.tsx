/** Overlays of the view: tools, legend, status line. */

import { useLayoutEffect, useRef } from "preact/hooks";
import { isComparison } from "../actions/view";
import type { App } from "../app";
import type { Element as CageElement, CageState, GizmoMode } from "../contract";
import { asksToPull, elementInUse } from "../derived";
import type { Command } from "../input/shortcuts";
import { sentence } from "../strings";
import { T } from "../words";
import { Axes } from "./axes";
import { Button, IconButton, Say, Segments } from "./controls";
import { useFrames } from "./frame";
import { Icon, type IconName } from "./icons";
import { LegendOfColours } from "./legend";
import { ReshapeTools } from "./reshape";
import { hintOf, statusOf, underWay } from "./status";
import { Toolbar } from "./toolbar";
import { useTouch } from "./touch";

/** All overlays of the view. Sets `data-rest` and `data-painting` on `stage` for the style sheet. */
export function Overlays({ app, stage }: { app: App; stage: HTMLElement }) {
  const { model, cage, scene, editingRest, painting, tools, gesture } = app.store.get();
  useLayoutEffect(() => {
    stage.toggleAttribute("data-rest", editingRest);
    stage.toggleAttribute("data-painting", painting !== null);
  }, [stage, editingRest, painting]);
  const hasCage = cage !== null;
  // The tools appear with the cage and cover a part of the view, so measure the margins again.
  useLayoutEffect(() => app.view.resized(), [app, hasCage]);
  return (
    <>
      <div class="top-line">
        {cage && <Mode app={app} />}
        {cage && editingRest && <Encloses app={app} />}
        <Looks app={app} />
      </div>
      {cage && editingRest && <ReshapeTools app={app} />}
      {cage && <Tools app={app} />}
      {model && <Axes app={app} />}
      {asksToPull(app.store.get()) && <Cue app={app} />}
      {tools.proportionalOn && gesture !== null && <Reach app={app} />}
      {isComparison(scene.compare) && (
        <div class="compare-labels" aria-hidden="true">
          {scene.compare.map((kind) => (
            <span key={kind}>
              {kind === "harmonic" || isPlain(cage)
                ? T.coordinates[kind]
                : T.view.ofPlain(T.coordinates[kind])}
            </span>
          ))}
        </div>
      )}
      <div class="bottom">
        <LegendOfColours app={app} />
        <Placing app={app} />
        <BottomLine app={app} />
      </div>
      <Busy app={app} />
    </>
  );
}

function Mode({ app }: { app: App }) {
  return (
    <div class="floating mode" data-tip={T.view.modeTip(app.key("restMode"))}>
      <Segments
        label={T.view.mode}
        hideLabel
        labels={T.view.modes}
        value={app.store.get().editingRest ? "rest" : "pose"}
        onChange={(value) => {
          app.edit.setEditingRest(value === "rest");
          app.go(value === "rest" ? "cage" : "pose");
        }}
      />
    </div>
  );
}

/** Whether the bound surface is the cage itself, without smoothing and without inner controls. */
function isPlain(cage: CageState | null): boolean {
  return !cage || (cage.controls.smooth === 0 && cage.controls.inner === 0);
}

/** Button that ends adding controls or painting, for touch screens, which have no Enter and Escape. */
function Placing({ app }: { app: App }) {
  const { placing, painting } = app.store.get();
  const label = placing === "line" || painting ? T.view.done : T.view.cancel;
  const end = painting ? () => app.painting.on(null) : app.controls.finish;
  return (
    (placing || painting) && (
      <div class="floating placing">
        <Button label={label} onClick={end} />
      </div>
    )
  );
}

/** Live result of the cage check while the cage is reshaped. */
function Encloses({ app }: { app: App }) {
  const { cage, check, strays } = app.store.get();
  const fault = check?.find((problem) => problem.severity !== "note");
  const message = strays > 0 ? T.cage.partOutside : fault && sentence(fault.message);
  const kind = cage?.usable === false ? "bad" : message ? "warn" : check ? "good" : "";
  return (
    <div class={`floating badge encloses ${kind}`} role="status">
      {(message || check) && <Icon name={message ? "warning" : "check"} />}
      <Say text={message ?? (check ? T.cage.encloses : T.cage.checking)} />
    </div>
  );
}

const GIZMOS: readonly (readonly [GizmoMode, Command])[] = [
  ["move", "gizmoMove"],
  ["rotate", "gizmoRotate"],
  ["scale", "gizmoScale"],
];
const ELEMENTS: readonly CageElement[] = ["vertex", "edge", "face"];

function Tools({ app }: { app: App }) {
  const { scene, boxArmed, additive, tools } = app.store.get();
  const element = elementInUse(app.store.get());
  const command = (icon: IconName, label: string, run: Command, pressed: boolean) => (
    <IconButton icon={icon} label={label} {...app.command(run)} pressed={pressed} />
  );
  return (
    <Toolbar label={T.view.tools} kind="tools">
      {command("pull", T.pull.tool, "toolPull", scene.pull)}
      {command("select", T.view.gizmos.none, "toolSelect", !scene.pull && scene.gizmo === null)}
      {GIZMOS.map(([gizmo, run]) => command(gizmo, T.view.gizmos[gizmo], run, scene.gizmo === gizmo))}
      <span class="line" />
      {ELEMENTS.map((one) => (
        <IconButton
          key={one}
          icon={one}
          label={T.view.elements[one]}
          onClick={() => app.view.element(one)}
          shortcut={app.key("elementMode")}
          pressed={element === one}
        />
      ))}
      <span class="line" />
      {command("box", T.view.box, "boxSelect", boxArmed)}
      <IconButton
        icon="plus"
        label={T.view.add}
        onClick={() => app.store.set({ additive: !additive })}
        kind="touch-only"
        pressed={additive}
      />
      {command("symmetry", T.pose.mirror, "symmetry", tools.symmetry)}
      {command("proportional", T.pose.proportional, "proportional", tools.proportionalOn)}
    </Toolbar>
  );
}

function Looks({ app }: { app: App }) {
  const { seeOpen, ortho } = app.store.get();
  return (
    <Toolbar label={T.view.looks} kind="looks">
      <IconButton icon="eye" label={T.view.see} {...app.command("see")} pressed={seeOpen} />
      <IconButton icon="frame" label={T.view.frame} {...app.command("frameAll")} />
      <IconButton icon="perspective" label={T.see.parallel} {...app.command("ortho")} pressed={ortho} />
    </Toolbar>
  );
}

function BottomLine({ app }: { app: App }) {
  const state = app.store.get();
  const isTouch = useTouch();
  const text = statusOf(state);
  const isQuiet = state.gesture !== null || state.busy !== null;
  return (
    <div class="bottom-line">
      <p
        class="status"
        id="status"
        role="status"
        aria-live="polite"
        data-settled={underWay(state) === null ? "" : undefined}
      >
        {/* The text is the key, so that each new status is a new element, which restarts its fade-out. */}
        {text !== "" && <span key={text}>{text}</span>}
      </p>
      <p class="hint-line" hidden={isQuiet}>
        {hintOf(state, isTouch)}
      </p>
    </div>
  );
}

/** Marks the point of the sample that the user should pull first. The Model panel describes the task in words. */
function Cue({ app }: { app: App }) {
  const element = useRef<HTMLDivElement>(null);
  const { grip } = app.store.get();
  useFrames(app, (engine) => {
    const [x = 0, y = 0, z = 0] = grip ?? [];
    const [right = 0, down = 0, isThere = 0] = engine.project(x, y, z);
    if (!element.current) return;
    element.current.hidden = isThere === 0;
    element.current.style.transform = `translate(${right}px, ${down}px)`;
  });
  return (
    <div class="cue" aria-hidden="true" ref={element}>
      <span>{T.view.cue}</span>
    </div>
  );
}

/** Circle around the selection within which vertices follow a gesture. */
function Reach({ app }: { app: App }) {
  const element = useRef<HTMLDivElement>(null);
  useFrames(app, (engine) => {
    const [right = 0, down = 0, radius = 0] = engine.reachCircle();
    if (!element.current) return;
    element.current.hidden = radius === 0;
    element.current.style.translate = `${right}px ${down}px`;
    element.current.style.width = `${2 * radius}px`;
  });
  return <div class="reach" aria-hidden="true" ref={element} />;
}

/** Progress of opening a file, with a button to cancel. For a large model, also asks whether to continue. */
function Busy({ app }: { app: App }) {
  const { busy, busyStep, busyFraction, cancelBusy, confirmBusy } = app.store.get();
  return (
    <div class="busy" hidden={busy === null}>
      {!confirmBusy && <span class="spinner" />}
      <p>{busy && `${busy}…`}</p>
      <p class="hint">{busyStep}</p>
      {busyFraction > 0 && !confirmBusy && <progress max="1" value={busyFraction} aria-label={busyStep} />}
      <div class="row">
        {cancelBusy && <Button label={T.cancel} onClick={cancelBusy} icon="stop" />}
        {confirmBusy && <Button label={T.opening.anyway} onClick={confirmBusy} kind="small primary" />}
      </div>
    </div>
  );
}
