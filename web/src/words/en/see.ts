/** Text of the See panel and of legends. */

import { count, plural, scientific } from "../../format";

export const see = {
  title: "See",
  close: "Close the See panel",
  colour: "Colour",
  colours: { material: "Material", clay: "Clay", weight: "Weight", error: "Error" },
  about: {
    material: "The model's own materials and textures.",
    clay: "One even colour: the shape is easier to judge.",
    weight: "How much each point follows the last selected handle. Select another handle to see its weight.",
    error:
      "Rest error: distance of each vertex from its place when the cage is at rest, on a logarithmic scale. Our method corrects the weights so that it is almost zero.",
  },
  toOne: "Colours from 0 to 1",
  toOneSentence: "Otherwise from 0 to the handle's largest weight.",
  selectForWeights: "Select a handle of the cage to see its weight.",
  compare: "Coordinates side by side",
  compareSentence: "Two or three kinds of coordinates, in the same pose.",
  grid: "Grid",
  slice: "Slice through the grid",
  slices: { off: "Off", kinds: "Cells", value: "Weight" },
  across: "Slice across",
  where: "Position",
  selectForCoordinate: "Select a handle of the cage to see its weight in the grid.",
  coordinate: (i: number) => `Weight of handle ${i} in the grid: 1 there, 0 at all other handles.`,
  cells: "Grid cells inside, on and outside the cage.",
  show: "Show",
  parts: {
    model: ["Model", ""],
    cage: ["Cage and handles", ""],
    base_wireframe: ["Model at rest, as wireframe", "Shows what moved."],
    floor: ["Floor", ""],
    problems: ["Faults of the cage", ""],
  },
  floaters: (n: number) =>
    [
      `${plural(n, "splat")} outside the cage`,
      "They follow the cage less the farther away they are.",
    ] as const,
  parallel: "Parallel projection",
};

export const legend = {
  cells: "Cells",
  kinds: ["inside", "on the cage", "outside"],
  coordinate: (i: number) => `Weight of handle ${i} in the grid`,
  weight: (i: number) => `Weight of handle ${i}`,
  error: "Rest error",
  largest: (value: number, vertex: number) =>
    `Largest: ${scientific(value)}, at vertex ${count(vertex)} of the model`,
  name: (title: string, low: string, high: string) => `${title}: ${low} to ${high}`,
};
