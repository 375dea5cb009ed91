/** Decides from file names what a drop contains: a model, a cage, a project, or nothing that can be opened. */

import { extension, isModel, rankOf } from "@cagework/core/names";
import { COMPANION_ENDINGS } from "./defaults";
import { T } from "./words";

export { extension, isModel };

export type DropKind = "model" | "controls" | "project" | "textures" | "nothing" | "unknown";

export interface DropPlan {
  kind: DropKind;
  /** Index of the file to open. */
  main?: number;
  /** Indices of further models for the same cage, in the order given. */
  more?: readonly number[];
  /** Index of the file to use as the cage. */
  second?: number;
  /** Says what opening the files will do, or why they cannot be opened. */
  sentence: string;
}

const CAGE_NAME = /(^|[^a-z])cage([^a-z]|$)/i;
const CONTROLS_NAME = /(^|[^a-z])controls?([^a-z].*)?\.obj$/i;
const PROJECT_NAME = /\.cagework\.glb$/i;

/** Plans how to open these files. If there are several models, one whose name contains the word "cage" is the cage. */
export function planDrop(names: readonly string[]): DropPlan {
  if (names.length === 0) return { kind: "nothing", sentence: T.opening.dropped };
  const project = names.findIndex((name) => PROJECT_NAME.test(name));
  if (project >= 0) {
    return { kind: "project", main: project, sentence: T.opening.project(base(names[project])) };
  }
  const [only] = names;
  if (only !== undefined && names.length === 1 && CONTROLS_NAME.test(base(only))) {
    return { kind: "controls", main: 0, sentence: T.opening.asControls(base(only)) };
  }
  const all = names.map((name, index) => ({ name, index })).filter(({ name }) => isModel(name));
  // A controls file that is dropped together with a model is ignored.
  const plain = all.filter(({ name }) => !CONTROLS_NAME.test(base(name)));
  const models = oneFormatEach(plain.length > 0 ? plain : all);
  const model = models.find(({ name }) => !CAGE_NAME.test(base(name))) ?? models[0];
  if (!model) {
    const endings: readonly string[] = COMPANION_ENDINGS;
    const isCompanions = names.every((name) => endings.includes(extension(name)));
    if (isCompanions) return { kind: "textures", sentence: T.opening.companions };
    return { kind: "unknown", sentence: T.opening.kinds };
  }
  const second = models.find((other) => other !== model && CAGE_NAME.test(base(other.name)));
  const more = models.filter((other) => other !== model && !CAGE_NAME.test(base(other.name)));
  const companions = names.length - all.length;
  const what = T.models.several(base(model.name), more.length);
  const sentence = T.opening.plan(what, companions, more.length > 0, second && base(second.name));
  const indices = more.length > 0 ? more.map(({ index }) => index) : undefined;
  return { kind: "model", main: model.index, sentence, more: indices, second: second?.index };
}

/** If files differ only in their extension, as in many downloads, keeps the format that stores most information. */
function oneFormatEach<T extends { readonly name: string }>(models: readonly T[]): T[] {
  const path = (name: string) => name.slice(0, name.length - extension(name).length);
  const isBest = ({ name }: T) =>
    !models.some((other) => path(other.name) === path(name) && rankOf(other.name) < rankOf(name));
  return models.filter(isBest);
}

/**
 * While files are dragged, says what dropping them will do. Until the drop, browsers reveal only the number of files.
 */
export function hoverSentence(files: number, hasModel: boolean, onCagePanel: boolean): string {
  if (files > 1) return T.opening.together;
  if (hasModel && onCagePanel) return T.opening.onCageStep;
  return hasModel ? T.opening.replaces : T.opening.getsCage;
}

function base(name: string | undefined): string {
  return name?.split("/").at(-1) ?? "";
}
