/** The models that share the cage. */

import { plural } from "../../format";

export const models = {
  title: "In this cage",
  vertices: (n: number) => plural(n, "vertex", "vertices"),
  /** "body.glb", "body.glb and 2 more" */
  several: (first: string, more: number) => (more > 0 ? `${first} and ${more} more` : first),
  hide: (name: string) => `Hide ${name}`,
  hideTip: "Hide it; it is bound and exported all the same",
  show: "Show it again",
  rigid: (name: string) => `${name} keeps its shape`,
  stays: (name: string) => `${name} stays as it is`,
  tips: {
    rigid: "Keeps its shape: goes along without bending, as a buckle or an eye does",
    stays: "Stays as it is: the cage does not move it",
  },
  bin: (name: string) => `Take ${name} out of the cage`,
  is: { hidden: "hidden", rigid: "keeps its shape", stays: "stays as it is", painted: "painted" },
  some: (rigid: number, stays: number) =>
    [
      rigid > 0 && `${plural(rigid, "part")} ${rigid === 1 ? "keeps its" : "keep their"} shape`,
      stays > 0 && `${plural(stays, "part")} ${stays === 1 ? "stays" : "stay"}`,
    ]
      .filter(Boolean)
      .join(", "),
  parts: "What follows the cage",
  whole: "All of it",
  kinds: { material: "Materials", node: "Nodes", joint: "Joints", group: "Groups" } as Record<string, string>,
  paint: "Paint what stays",
  paintSentence:
    "Drag over the model: what turns grey stays as it is. Beside the model a drag turns the view.",
  size: "Size of the brush",
  brush: "What it touches",
  brushes: { paint: "Stays", erase: "Follows again" },
  clear: "Clear",
  done: "Done",
  add: "Add to this cage",
  addHint: "Clothes, hair, gear. Or drop them on this list.",
  makeAround: "Make a cage around all",
  outside: "What was added reaches outside of this cage.",
  together: (n: number) => `${n} models share this cage.`,
  showList: "Show the list",
  notAdded: "Nothing was added",
  noProject: "A project has a cage of its own. Open it, or add the files of its models.",
  notBinned: "The model could not be taken out",
  notPainted: "This cannot be painted now",
  notParts: "This part cannot be told apart",
  painting: "Painting what stays",
  hint: "Drag over the model to paint, beside it to turn the view. Esc ends painting.",
  hintTouch: "Paint with a finger. Beside the model it turns the view, two fingers move and zoom.",
};
