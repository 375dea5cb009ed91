/** Text of the tour, downloaded when the tour starts. */

import type { BindReport } from "../../contract";
import { count, duration, scientific } from "../../format";

type Reports = readonly BindReport[];

export const tourWords = {
  name: "Tour",
  of: (stop: number, all: number) => `${stop} of ${all}`,
  all: "Stops of the tour",
  stop: (stop: number, title: string) => `Stop ${stop}: ${title}`,
  back: "Back",
  next: "Next",
  finish: "Finish",
  leave: "Leave the tour",
  link: "Copy a link to this stop",
  task: "Try it:",
  doing: (bind: number, all: number) => (all > 1 ? `Binding, ${bind} of ${all}…` : "Binding…"),
  cells: "Cells",
  ofCells: (grid: number) => `${grid} cells`,
  tau: "Accuracy (tau)",
  ofTau: (tau: number) => `tau = ${scientific(tau)}`,
  errorOf: (what: string) => `Rest error, mean, ${what}`,
  meanError: "Mean rest error of the published method, relative to the cage's size",
  showError: (grid: number, tau: number, error: number) =>
    `${scientific(error)}: show ${grid} cells, tau = ${scientific(tau)}`,
  iterations: (name: string, n: number) => `${name}: ${count(n)}`,
  again: "Measure again",
  bone: "Put a bone into the lower jaw",
  pointAt: "Point at the cow, or tap it.",
  ellipses: ["Splat at rest", "A sphere after the deformation", "Splat in this pose"],
  stops: {
    cage: {
      title: "What a cage does",
      claim: ([report]: Reports) =>
        report
          ? `Move a few of the cage's ${count(report.cage_vertices)} vertices and the rat's ${count(report.vertices)} points follow.`
          : "Move a few of the cage's vertices and the rat's points follow.",
      task: "pull the rat's nose. The cage follows, the feet stay.",
    },
    weight: {
      title: "One weight",
      claim: () =>
        "The weight of a cage vertex is how much each point follows it: between 0 and 1, fading with distance through the inside of the cage, not through the air.",
      task: "choose another handle (click, tap, or the keys [ and ]) and see how far its weight reaches.",
    },
    grid: {
      title: "The grid",
      claim: () =>
        "A weight is a temperature: this cage vertex is held at 1 and all others at 0. Inside, each cell of a grid settles at the mean of its neighbours.",
      task: "move the slice through the rat, then look at the cells themselves.",
    },
    paper: {
      title: "The published method, with 16 cells",
      claim: () =>
        "The published method (Joshi et al. 2007, as K. Smith describes it) gives every point the weights of its grid cell. With 16 cells along each side, all points of a cell land on one spot. The wireframe shows where they should be.",
      task: "choose 32 cells. The steps get smaller but do not vanish.",
    },
    smoothing: {
      title: "Too little smoothing",
      claim: () =>
        "A sweep replaces every cell inside by the mean of its neighbours, so heat gets one cell further. If the sweeps stop at a change of 1e-3 (tau), the heat has not spread everywhere yet, and the rat does not fill its wireframe.",
      task: "continue until a sweep changes less than 1e-5.",
    },
    delta: {
      title: "Three ways to the same weights",
      claim: () =>
        "Three solvers for the same equations: Jacobi needs hundreds of sweeps, conjugate gradients dozens of steps, multigrid a handful of cycles.",
      task: "halve the grid to 16 cells. Which number stays the same?",
    },
    times: {
      title: "Times on this computer",
      claim: (reports: Reports) => {
        const [paper, ours] = reports;
        return paper && ours
          ? `With 32 cells, the published method just took ${duration(paper.timings_ms.total)} here and ours ${duration(ours.timings_ms.total)}.`
          : "The published method and ours, timed on this computer.";
      },
      task: "close other programs and measure again.",
    },
    error: {
      title: "Error over grid and tau",
      claim: () =>
        "A finer grid needs a smaller tau: stopped at 1e-3, the rat comes out worse with 32 cells than with 16.",
      task: "choose a number to see the rat it belongs to.",
    },
    coordinates: {
      title: "Harmonic, mean value, Green",
      claim: () =>
        "The lower jaw opens. With harmonic coordinates the upper jaw stays. Mean value coordinates act across the gap and drag it along. With Green coordinates it moves a little, but details keep their shape best.",
      task: "pull the upper jaw up and see what follows.",
    },
    smooth: {
      title: "A smooth cage, and a bone inside",
      claim: () =>
        "Where it bends, a cage of flat faces leaves its edges on the model. A smooth subdivision surface with the same handles does not. A bone inside adds a handle in the middle of the model.",
      task: "choose 2 steps and watch the bend, then put the bone in and pull it down.",
    },
    splat: {
      title: "What a splat is",
      claim: () =>
        "This cow has no triangles: 10,000 splats, soft ellipsoids with a colour, show it. The cage deforms the space around each splat. Close to the splat, that is a stretch and a rotation, which turn a small sphere into an ellipsoid and a splat into another splat.",
      task: "pull the head, then point at the neck or tap it.",
    },
  },
};
