/** Text about the models that share the cage. */

import { plural } from "../../format";

export const models = {
  title: "In this cage",
  vertices: (n: number) => plural(n, "vertex", "vertices"),
  /** Name of one or several models: "body.glb", "body.glb and 2 more". */
  several: (first: string, more: number) => (more > 0 ? `${first} and ${more} more` : first),
  hide: (name: string) => `Hide ${name}`,
  hideTip: "Hide it; it is still bound and exported",
  show: "Show it again",
  rigid: (name: string) => `${name} keeps its shape`,
  stays: (name: string) => `${name} stays as it is`,
  tips: {
    rigid: "Keeps its shape: moves without bending, like a buckle or an eye",
    stays: "Stays as it is: the cage does not move it",
  },
  copyRig: (body: string) => `Rig like ${body}`,
  copyRigTip: (body: string) =>
    `Copies the joints, weights and morph targets of ${body}; its clips then move this model`,
  copyingRig: (name: string) => `Copying joints to ${name}`,
  remove: (name: string) => `Remove ${name} from the cage`,
  is: { hidden: "hidden", rigid: "keeps its shape", stays: "stays as it is", painted: "painted" },
  some: (rigid: number, stays: number) =>
    [
      rigid > 0 && `${plural(rigid, "part")} ${rigid === 1 ? "keeps its" : "keep their"} shape`,
      stays > 0 && `${plural(stays, "part")} ${stays === 1 ? "stays" : "stay"}`,
    ]
      .filter(Boolean)
      .join(", "),
  parts: "How parts follow the cage",
  whole: "Whole model",
  kinds: { material: "Materials", node: "Nodes", joint: "Joints", group: "Groups" } as Record<string, string>,
  paint: "Paint fixed areas",
  paintSentence: "Drag over the model: blue areas stay as they are. Drag the background to turn the view.",
  size: "Size of the brush",
  brush: "Painted areas",
  brushes: { paint: "Stay", erase: "Follow again" },
  clear: "Clear",
  done: "Done",
  add: "Add to this cage",
  addHintTouch: "Clothes, hair, gear.",
  addHint: "Clothes, hair, gear. You can also drop them on this list.",
  makeAround: "Make a cage around all",
  outside: "The added model reaches outside the cage.",
  together: (n: number) => `${n} models share this cage.`,
  showList: "Show the list",
  notAdded: "Nothing was added",
  noProject: "A project has its own cage. Open it, or add its models' files instead.",
  rigNotCopied: (name: string) => `${name} could not be rigged`,
  notRemoved: "The model could not be removed",
  notPainted: "The model cannot be painted now",
  notParts: "How this part follows the cage could not be changed",
  painting: "Painting fixed areas",
  hint: "Drag over the model to paint, or the background to turn the view. Esc ends painting.",
  hintTouch: "Paint with one finger. On the background it turns the view; two fingers move and zoom.",
};
