/** A rigged model's clips and morph targets. */

import { plural } from "../../format";

export const clips = {
  title: "Its own movement",
  clip: "Clip",
  rest: "None: the cage poses it",
  named: (name: string, length: string) => `${name}, ${length}`,
  posing: "While a clip is shown, a drag looks around. To pose the model, choose none.",
  play: "Play the clip",
  pause: "Pause the clip",
  time: "Time",
  seconds: (seconds: number) => `${seconds.toFixed(2)} s`,
  speed: "Speed",
  loop: "Loop",
  targets: (n: number) => plural(n, "morph target"),
  follow: "Joints follow the cage",
  followSentence: "Off keeps the skeleton as it is, for clips and files that share it.",
  joints: "Show joints",
  jointsSentence: "Dots inside the cage, rings outside.",
  rigid: (kept: number, all: number) => `Parts that keep their shape (${kept} of ${all})`,
  rigidSentence: "Buckles, eyes, weapons: they hang on a bone, and go along without bending.",
  advanced: "More about joints",
  turn: "Bones turn with the shape",
  turnSentence: "For shapes that are poses. Rotations of clips are written anew.",
  travel: "Keep how far it travels",
  travelSentence: "Off: longer legs go further.",
  keep: "Keep skeleton, targets and clips",
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
    "Experimental: the skeleton first, then the cage, as for squash and stretch. Best with a cage around the clip (step Cage).",
  preparing: "Getting the space around the cage ready",
  baked: (name: string) =>
    `The cage bends the moving model: the frames of ${name ? `“${name}”` : "its clip"} become morph targets, without skeleton.`,
  bindFirst: "Bind the model first: what plays is the shape that the cage gives it.",
};
