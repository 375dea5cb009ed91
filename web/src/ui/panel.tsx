/** The panel of the current step, with the next action at the bottom. On narrow screens it is a bottom sheet. */

import { useLayoutEffect, useRef } from "preact/hooks";
import type { App } from "../app";
import { cageBroken, hasUnmadeCage, isCapture, neededFix, shapeFormatOf } from "../derived";
import type { AppState, StepName } from "../state";
import { T } from "../words";
import { BindPanel } from "./bind";
import { CagePanel, fixLabel } from "./cage";
import { Button } from "./controls";
import { ExportPanel } from "./export";
import type { IconName } from "./icons";
import { ModelPanel } from "./model";
import { PosePanel } from "./pose";

interface Action {
  label: string;
  icon?: IconName;
  /** Whether the button has no accent colour, as for Cancel. */
  plain?: true;
  run: () => void;
}

/** The next action of a step, and a second one where there is an alternative. */
export function nextActions(state: AppState, app: App): { primary: Action; second?: Action } {
  const bind = (label: string): Action => ({ label, icon: "bind", run: () => app.run("bind") });
  const pose: Action = { label: T.panel.pose, icon: "pose", run: () => app.go("pose") };
  const open: Action = { label: T.panel.open, icon: "open", run: app.chooseModel };
  switch (state.step) {
    case "model":
      if (!state.model) return { primary: open };
      return { primary: state.bound ? pose : { label: T.panel.next, run: () => app.go("cage") } };
    case "cage": {
      const needed = cageAction(state, app);
      if (needed) return { primary: needed };
      const next = state.bound ? pose : bind(T.panel.bindModel);
      const make = makeAction(state, app);
      return hasUnmadeCage(state) ? { primary: make, second: next } : { primary: next, second: make };
    }
    case "bind":
      if (state.bindRun) return { primary: cancel(app.bind.cancel) };
      if (!state.bound) return { primary: bind(T.panel.bind) };
      return { primary: pose, second: { label: T.panel.bindAgain, run: () => app.run("bind") } };
    case "pose":
      if (!state.bound && !state.bindRun) return { primary: bind(T.panel.bindFirst) };
      return {
        primary: { label: T.panel.export, icon: "export", run: () => app.go("export") },
        second: { label: T.panel.savePose, icon: "plus", run: () => app.run("savePose") },
      };
    case "export": {
      const kind = isCapture(state.model) ? "shape" : "glb";
      const format = kind === "glb" ? kind : shapeFormatOf(state);
      const label = (state.model?.members.length ?? 0) > 1 ? T.panel.downloadAs : T.panel.download;
      return {
        primary: {
          label: label(format.toUpperCase()),
          icon: "download",
          run: () => void app.exports.save(kind),
        },
      };
    }
    default:
      return state.step satisfies never;
  }
}

const cancel = (run: () => void): Action => ({ label: T.cancel, icon: "stop", plain: true, run });

/** The action that makes a cage with the settings of the panel, or opens a cage file. */
function makeAction({ cageSource }: AppState, app: App): Action {
  if (cageSource === "file") return { label: T.cage.load, icon: "file", run: app.chooseCage };
  return { label: T.cage.make, run: () => void app.cage.make() };
}

/** The action that is needed before the model can be bound to the cage; undefined if none is. */
function cageAction(state: AppState, app: App): Action | undefined {
  if (state.cageProgress !== null) return cancel(app.cage.cancel);
  const make = (label: string): Action => ({ label, icon: "cage", run: () => void app.cage.make() });
  if (!state.cage) return make(T.panel.makeCage);
  if (!cageBroken(state) || hasUnmadeCage(state)) return undefined;
  const needed = neededFix(state);
  if (!needed) return make(T.panel.newCage);
  const { fix, count } = needed;
  return { label: fixLabel(fix, count), icon: "patch", run: () => app.cage.applyFix(fix) };
}

const BODIES: Record<StepName, (props: { app: App }) => preact.JSX.Element> = {
  model: ModelPanel,
  cage: CagePanel,
  bind: BindPanel,
  pose: PosePanel,
  export: ExportPanel,
};

export function Panel({ app }: { app: App }) {
  const { step } = app.store.get();
  const handle = useRef<HTMLButtonElement>(null);
  const body = useRef<HTMLDivElement>(null);
  useLayoutEffect(() => {
    const panel = body.current?.parentElement;
    if (panel && handle.current) attachSheet(panel, handle.current);
  }, []);
  useLayoutEffect(() => {
    body.current?.parentElement?.setAttribute("aria-label", T.panel.step(T.bar.names[step]));
    if (body.current) body.current.scrollTop = 0;
  }, [step]);
  const Body = BODIES[step];
  return (
    <>
      <button type="button" class="sheet-handle" aria-label={T.panel.size} ref={handle} />
      <div class="panel-body" tabIndex={-1} ref={body}>
        <Body app={app} key={step} />
      </div>
      <Foot app={app} />
    </>
  );
}

function Foot({ app }: { app: App }) {
  const { primary, second } = nextActions(app.store.get(), app);
  const { label, icon, plain, run } = primary;
  return (
    <div class="panel-foot">
      {second && (
        <Button key="second" label={second.label} icon={second.icon} kind="secondary" onClick={second.run} />
      )}
      <Button key="main" label={label} icon={icon} kind={plain ? "main" : "primary main"} onClick={run} />
    </div>
  );
}

/** Heights to which the bottom sheet snaps, as fractions of the window. */
const RESTS = [0.12, 0.42, 0.78] as const;

function attachSheet(panel: HTMLElement, handle: HTMLElement): void {
  let rest = 1;
  let start: { y: number; height: number } | undefined;
  let moved = false;
  const settle = (share: number) => {
    const distances = RESTS.map((value) => Math.abs(value - share));
    rest = distances.indexOf(Math.min(...distances));
    document.documentElement.style.setProperty("--sheet", `${(RESTS[rest] ?? 0.42) * 100}dvh`);
  };
  handle.addEventListener("pointerdown", (event) => {
    start = { y: event.clientY, height: panel.offsetHeight };
    moved = false;
    handle.setPointerCapture(event.pointerId);
    panel.dataset.dragging = "";
  });
  handle.addEventListener("pointermove", (event) => {
    if (!start) return;
    const height = start.height + start.y - event.clientY;
    moved ||= Math.abs(start.y - event.clientY) > 4;
    document.documentElement.style.setProperty("--sheet", `${Math.max(60, height)}px`);
  });
  const end = () => {
    if (!start) return;
    start = undefined;
    delete panel.dataset.dragging;
    if (moved) settle(panel.offsetHeight / window.innerHeight);
  };
  // A step that the user chooses must be visible.
  document.querySelector("#bar")?.addEventListener("click", ({ target }) => {
    if (rest === 0 && target instanceof Element && target.closest(".step")) settle(RESTS[1]);
  });
  handle.addEventListener("pointerup", end);
  handle.addEventListener("pointercancel", end);
  handle.addEventListener("click", () => {
    if (!moved) settle(RESTS[rest === 2 ? 0 : rest + 1] ?? 0.42);
    moved = false;
  });
}
