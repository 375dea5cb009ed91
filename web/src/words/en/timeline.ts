/** Text of the timeline. */

import { plural } from "../../format";

const seconds = (time: number) => time.toFixed(2);

export const timeline = {
  title: "Timeline",
  source: "Clip",
  poses: (n: number) => (n > 0 ? `My poses (${n})` : "My poses"),
  chooseClip: "Choose a clip to play it.",
  play: "Play",
  stop: "Stop and return to the pose before",
  loop: "Loop",
  time: (now: number, length: number) => `${seconds(now)} / ${seconds(length)} s`,
  playhead: "Playhead",
  key: (name: string, at: number) => `${name} at ${seconds(at)} s: drag, or press an arrow key, to move it`,
  end: (at: number) => `End at ${seconds(at)} s: drag it to change the length`,
  options: "Speed, name and motion",
  speed: "Speed",
  times: (speed: number) => `${speed} ×`,
  name: "Name of the animation",
  between: "Between poses",
  interpolations: { step: "Jump", linear: "Straight", cubic: "Smooth" },
  interpolationTips: {
    step: "Each pose stays until the next one",
    linear: "The shortest way from pose to pose",
    cubic: "A smooth curve, which may swing past a pose",
  },
  timeOf: (name: string) => `Time of ${name}, seconds`,
  motionOf: (name: string) => `Motion to ${name}`,
  motionOfAll: "Same as for all poses",
  include: "Include my animation",
  includeSentence: (n: number, name: string) =>
    `Adds the clip “${name}”, which plays ${plural(n, "pose")} as morph targets.`,
};
