/** The panel: one step at a time, its next action at the foot; on narrow screens a sheet that is pulled up. */

import type { App } from "../app";
import { type AppState, cageBroken, STEPS, type StepName } from "../state";
import { button } from "./controls";
import { fill, h } from "./dom";
import type { IconName } from "./icons";

interface Action {
  label: string;
  icon?: IconName;
  /** Not what the user came for: no accent. */
  plain?: true;
  run: () => void;
}

/** The sensible next action, and perhaps another one before it. */
export function nextActions(state: AppState, app: App): { primary: Action; second?: Action } {
  switch (state.step) {
    case "model":
      return state.model
        ? {
            primary: state.bound
              ? { label: "Pose it", icon: "pose", run: () => app.go("pose") }
              : { label: "Next: the cage", run: () => app.go("cage") },
            second: { label: "Open a file", icon: "open", run: () => app.chooseModel() },
          }
        : { primary: { label: "Open a file", icon: "open", run: () => app.chooseModel() } };
    case "cage":
      return cageActions(state, app);
    case "bind":
      if (state.bindRun)
        return { primary: { label: "Cancel", icon: "stop", plain: true, run: () => app.bind.cancel() } };
      if (!state.bound) return { primary: { label: "Bind", icon: "bind", run: () => app.run("bind") } };
      return {
        primary: { label: "Pose it", icon: "pose", run: () => app.go("pose") },
        second: { label: "Bind again", run: () => app.run("bind") },
      };
    case "pose":
      if (!state.bound && !state.bindRun) {
        return { primary: { label: "Bind first", icon: "bind", run: () => app.run("bind") } };
      }
      return {
        primary: { label: "Export", icon: "export", run: () => app.go("export") },
        second: { label: "Save pose", icon: "plus", run: () => app.run("savePose") },
      };
    case "export":
      return {
        primary: { label: "Download the GLB", icon: "download", run: () => void app.exports.save("glb") },
      };
    default:
      return state.step satisfies never;
  }
}

function cageActions(state: AppState, app: App): { primary: Action; second?: Action } {
  if (state.cageProgress !== null) {
    return { primary: { label: "Cancel", icon: "stop", plain: true, run: () => app.cage.cancel() } };
  }
  if (!state.cage) {
    return { primary: { label: "Make a cage", icon: "cage", run: () => void app.cage.make() } };
  }
  const fix = state.check?.problems.find((problem) => problem.severity === "error" && problem.fix)?.fix;
  if (cageBroken(state)) {
    return fix
      ? { primary: { label: fix.label, icon: "patch", run: () => app.cage.mend(fix) } }
      : { primary: { label: "Make a new cage", icon: "cage", run: () => void app.cage.make() } };
  }
  if (state.bound) return { primary: { label: "Pose it", icon: "pose", run: () => app.go("pose") } };
  return { primary: { label: "Bind the model", icon: "bind", run: () => app.run("bind") } };
}

export function createPanel(element: HTMLElement, app: App, bodies: Record<StepName, HTMLElement>): void {
  const handle = h("button", {
    class: "sheet-handle",
    attrs: { type: "button", "aria-label": "Make the panel larger or smaller" },
  });
  const body = h("div", { class: "panel-body", attrs: { tabindex: "-1" } });
  const foot = h("div", { class: "panel-foot" });
  for (const step of STEPS) {
    bodies[step].hidden = true;
    body.append(bodies[step]);
  }
  element.append(handle, body, foot);
  createSheet(element, handle);

  let shown: StepName | undefined;
  app.store.watch(["step"], ({ step }) => {
    if (shown === step) return;
    if (shown) bodies[shown].hidden = true;
    bodies[step].hidden = false;
    shown = step;
    body.scrollTop = 0;
    element.setAttribute("aria-label", `Step: ${step}`);
  });

  let footKey = "";
  app.store.watch(["step", "model", "cage", "check", "bindRun", "bound", "cageProgress"], (state) => {
    const { primary, second } = nextActions(state, app);
    const key = `${state.step}|${primary.label}|${second?.label}`;
    if (key === footKey) return;
    footKey = key;
    const make = (action: Action, kind: string) =>
      button(action.label, () => nextActionsRun(app, kind.includes("main")), {
        kind,
        ...(action.icon ? { icon: action.icon } : {}),
      });
    const hadFocus = foot.contains(document.activeElement);
    fill(
      foot,
      second ? make(second, "secondary") : null,
      make(primary, primary.plain ? "main" : "primary main"),
    );
    if (hadFocus) foot.querySelector<HTMLButtonElement>(".main")?.focus();
  });
}

/** The foot's buttons act on the state of the click, not of the moment they were made. */
function nextActionsRun(app: App, isPrimary: boolean): void {
  const { primary, second } = nextActions(app.store.get(), app);
  (isPrimary ? primary : (second ?? primary)).run();
}

/** Heights the sheet rests at, shares of the window. */
const RESTS = [0.12, 0.42, 0.78] as const;

function createSheet(panel: HTMLElement, handle: HTMLElement): void {
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
  handle.addEventListener("pointerup", end);
  handle.addEventListener("pointercancel", end);
  handle.addEventListener("click", () => {
    if (!moved) settle(RESTS[rest === 2 ? 0 : rest + 1] ?? 0.42);
    moved = false;
  });
}
