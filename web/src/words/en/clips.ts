/** Text about clips, morph targets and skeletons of rigged models. */

import { plural } from "../../format";

export const clips = {
  rest: "No clip",
  named: (name: string, length: string) => `${name}, ${length}`,
  play: "Play the clip",
  pause: "Pause the clip",
  seconds: (seconds: number) => `${seconds.toFixed(2)} s`,
  follow: "Joints follow the cage",
  followSentence: "Off: the skeleton does not change, so other files made for it still fit.",
  joints: "Show joints",
  jointsSentence: "A dot for a joint inside the cage, a ring for one outside.",
  rigid: (kept: number, all: number) => `Parts that keep their shape (${kept} of ${all})`,
  rigidSentence: "For buckles, eyes or weapons: each moves with its joint and does not bend.",
  advanced: "More options",
  turn: "Bones turn with the shape",
  turnSentence:
    "For a cage that poses the model, for example raises an arm: joints turn too, and rotations in clips are adapted.",
  travel: "Keep travel distance",
  travelSentence: "Off: longer legs walk farther.",
  ground: "Stand on the same ground",
  groundSentence: "The lowest point keeps its height, at rest and in each clip.",
  feet: "Hold planted feet",
  feetSentence: "In clips, thighs and shins turn so that feet on the ground do not slide.",
  keep: "Keep skeleton, morph targets and clips",
  keepSentence: (joints: number, targets: number, clips: number) =>
    [
      joints > 0 && plural(joints, "joint"),
      targets > 0 && plural(targets, "morph target"),
      clips > 0 && plural(clips, "clip"),
    ]
      .filter(Boolean)
      .join(", "),
  dynamic: "The cage bends the moving model",
  dynamicSentence:
    "Experimental: the skeleton moves the model, then the cage bends it, for example for squash and stretch. Works best with a cage that encloses the whole movement (step Cage, Enclose).",
  preparing: "Computing how the cage bends the moving model",
  baked: (name: string) =>
    `The cage bends the moving model: the frames of ${name ? `“${name}”` : "its clip"} are exported as morph targets, without a skeleton.`,
  bindFirst: "Bind the model first: clips play on the deformed shape.",
};
