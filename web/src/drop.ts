/** What dropped files are, by their names: a model, a cage, a project, or what the page cannot open. */

import { extension, isModel, rankOf } from "@cagework/core/names";
import { T } from "./words";

export { extension, isModel };

export type DropKind = "model" | "controls" | "project" | "textures" | "nothing" | "unknown";

export interface DropPlan {
  kind: DropKind;
  /** Index of the file to open. */
  main?: number;
  /** Other models, which share its cage, in the order given. */
  more?: readonly number[];
  /** The file that is their cage. */
  second?: number;
  /** What will happen, as a sentence. */
  sentence: string;
}

const COMPANIONS = ["bin", "png", "jpg", "jpeg", "webp", "avif", "ktx2", "mtl"] as const;
const CAGE_NAME = /(^|[^a-z])cage([^a-z]|$)/i;
const CONTROLS_NAME = /(^|[^a-z])controls?([^a-z].*)?\.obj$/i;
const PROJECT_NAME = /\.cagework\.glb$/i;

/** Says what opening these files means. Files named "...cage..." are cages when another model is among them. */
export function planDrop(names: readonly string[]): DropPlan {
  if (names.length === 0) return { kind: "nothing", sentence: T.opening.dropped };
  const project = names.findIndex((name) => PROJECT_NAME.test(name));
  if (project >= 0) {
    return { kind: "project", main: project, sentence: `Opens the project ${base(names[project])}.` };
  }
  const [only] = names;
  if (only !== undefined && names.length === 1 && CONTROLS_NAME.test(base(only))) {
    return { kind: "controls", main: 0, sentence: T.opening.asControls(base(only)) };
  }
  const all = names.map((name, index) => ({ name, index })).filter(({ name }) => isModel(name));
  // Controls come alone, when the cage is there.
  const plain = all.filter(({ name }) => !CONTROLS_NAME.test(base(name)));
  const models = oneFormatEach(plain.length > 0 ? plain : all);
  const model = models.find(({ name }) => !CAGE_NAME.test(base(name))) ?? models[0];
  if (!model) {
    const companions = names.every((name) => (COMPANIONS as readonly string[]).includes(extension(name)));
    return companions
      ? {
          kind: "textures",
          sentence: T.opening.companions,
        }
      : { kind: "unknown", sentence: T.opening.kinds };
  }
  const second = models.find((other) => other !== model && CAGE_NAME.test(base(other.name)));
  const more = models.filter((other) => other !== model && !CAGE_NAME.test(base(other.name)));
  const companions = names.length - all.length;
  const files = companions > 0 ? ` with ${companions} ${companions === 1 ? "file" : "files"}` : "";
  const what = T.models.several(base(model.name), more.length) + files;
  const sentence = second
    ? `Opens ${what} with ${base(second.name)} as ${more.length > 0 ? "their" : "its"} cage.`
    : `Opens ${what} and makes a cage for ${more.length > 0 ? "all of them" : "it"}.`;
  return {
    kind: "model",
    main: model.index,
    sentence,
    ...(more.length > 0 ? { more: more.map(({ index }) => index) } : {}),
    ...(second ? { second: second.index } : {}),
  };
}

/** Of a model that came in several formats, as downloads do, the one that says most. */
function oneFormatEach<T extends { readonly name: string }>(models: readonly T[]): T[] {
  const path = (name: string) => name.slice(0, name.length - extension(name).length);
  const isBest = ({ name }: T) =>
    !models.some((other) => path(other.name) === path(name) && rankOf(other.name) < rankOf(name));
  return models.filter(isBest);
}

/** What the page can say while files hover over it: browsers tell how many there are, and types of some. */
export function hoverSentence(files: number, hasModel: boolean, onCagePanel: boolean): string {
  if (files > 1) {
    return T.opening.together;
  }
  if (hasModel && onCagePanel) return T.opening.onCageStep;
  return hasModel ? T.opening.replaces : T.opening.getsCage;
}

function base(name: string | undefined): string {
  return name?.split("/").at(-1) ?? "";
}
