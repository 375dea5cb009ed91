/** The tour: not among the rest, because only who takes it needs it. */

import type { BindReport } from "../../contract";
import { count, duration, scientific } from "../../format";

type Reports = readonly BindReport[];

export const EN_TOUR = {
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
  tau: "Stop below (tau)",
  ofTau: (tau: number) => `tau = ${scientific(tau)}`,
  errorOf: (what: string) => `Rest error, mean, ${what}`,
  meanError: "Mean rest error of the paper's method, of the cage's size",
  showError: (grid: number, tau: number, error: number) =>
    `${scientific(error)}: show ${grid} cells, tau = ${scientific(tau)}`,
  iterations: (name: string, n: number) => `${name}: ${count(n)}`,
  again: "Measure again",
  bone: "Put a bone into the lower jaw",
  stops: {
    cage: {
      title: "What a cage does",
      claim: ([report]: Reports) =>
        report
          ? `Move a few of the cage's ${count(report.cage_vertices)} vertices and the rat's ${count(report.vertices)} points follow.`
          : "Move a few of the cage's vertices and the rat's points follow.",
      task: "take the rat by the nose and pull. The cage goes along, the feet stay.",
    },
    weight: {
      title: "One weight",
      claim: () =>
        "How much each point follows one vertex of the cage is that vertex's weight: never below 0, never above 1, and fading with the way through the inside, not through the air.",
      task: "choose another handle (click, tap, or the keys [ and ]) and look how far its weight reaches.",
    },
    grid: {
      title: "The grid",
      claim: () =>
        "A weight is a temperature: the cage is kept at 1 in this vertex and at 0 in all others, and inside, in the cells of a grid, each place becomes the mean of its neighbours.",
      task: "move the slice through the rat, then look at the cells themselves.",
    },
    paper: {
      title: "The paper's way, with 16 cells",
      claim: () =>
        "The paper gives every point the weights of the cell that it lies in: with 16 cells along each side, all points of a cell land on one spot (the wires are where they should be).",
      task: "take 32 cells. The steps get smaller, but there are still steps.",
    },
    smoothing: {
      title: "Too little smoothing",
      claim: () =>
        "A sweep carries heat one cell further. Stop at 1e-3 and the heat has not spread everywhere yet: the rat does not fill its wires.",
      task: "go on until a sweep changes less than 1e-5.",
    },
    delta: {
      title: "Three ways to the same weights",
      claim: () =>
        "The same equations solved in three ways: Jacobi needs hundreds of sweeps, conjugate gradients dozens of steps, multigrid a handful of cycles.",
      task: "take half as many cells, 16. Whose number stays?",
    },
    times: {
      title: "Times on this computer",
      claim: (reports: Reports) => {
        const [paper, ours] = reports;
        return paper && ours
          ? `With 32 cells the paper's way took ${duration(paper.timings_ms.total)} here just now, ours ${duration(ours.timings_ms.total)}.`
          : "The paper's way and ours, measured here and now.";
      },
      task: "close what else is running, and measure again.",
    },
    error: {
      title: "Error over grid and tau",
      claim: () =>
        "A finer grid needs a smaller tau: stopped at 1e-3, the rat comes out worse with 32 cells than with 16.",
      task: "choose a number to see the rat that it stands for.",
    },
    coordinates: {
      title: "Harmonic, mean value, Green",
      claim: () =>
        "The lower jaw opens: with harmonic coordinates the upper one stays, with mean value coordinates, which look across the gap, it is dragged along, and with Green coordinates it moves a little, but details keep their shape best.",
      task: "pull the upper jaw up, and see who follows.",
    },
    smooth: {
      title: "A smooth cage, and a bone inside",
      claim: () =>
        "A cage of flat faces leaves its edges on the model where it bends; with the same handles, a surface that subdivision makes smooth leaves none, and a bone inside is one handle more, in the middle of things.",
      task: "take 2 steps and watch the bend, then put the bone in and pull it down.",
    },
  },
};
