/** What panels and input may call; main.ts puts it together. */

import type { BindActions } from "./actions/bind";
import type { CageActions } from "./actions/cage";
import type { Context } from "./actions/context";
import type { Edit } from "./actions/edit";
import type { Exports } from "./actions/exports";
import type { Files } from "./actions/files";
import type { PoseActions } from "./actions/poses";
import type { Project } from "./actions/project";
import type { View } from "./actions/view";
import type { WorkActions } from "./actions/works";
import type { Command } from "./input/shortcuts";
import type { StepName, Store } from "./state";

export interface App {
  readonly ctx: Context;
  readonly store: Store;
  readonly edit: Edit;
  readonly cage: CageActions;
  readonly bind: BindActions;
  readonly poses: PoseActions;
  readonly view: View;
  readonly files: Files;
  readonly project: Project;
  readonly works: WorkActions;
  readonly exports: Exports;
  readonly mac: boolean;
  /** Runs what a shortcut stands for. */
  run(command: Command): void;
  go(step: StepName): void;
  /** Opens the browser's file dialog. */
  chooseModel(): void;
  chooseFolder(): void;
  chooseCage(): void;
  share(): void;
  /** How to switch WebGPU on, where it is missing. */
  showWays(): void;
  /** Begins with the first sample; what is open stays kept. */
  startFresh(): void;
  /** Where the pointer was last, CSS pixels in the view. */
  pointer: () => { x: number; y: number };
  /** "Ctrl+Z" */
  key(command: Command): string;
}
