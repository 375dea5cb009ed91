/** Text of both tours, downloaded when one starts. */

import type { BindReport } from "../../contract";
import { count, duration, scientific } from "../../format";

type Reports = readonly BindReport[];

export const tourWords = {
  name: "Tour",
  names: { first: "First steps", how: "How it works" },
  of: (stop: number, all: number) => `${stop} of ${all}`,
  all: "Stops of the tour",
  stop: (stop: number, title: string) => `Stop ${stop}: ${title}`,
  back: "Back",
  next: "Next",
  finish: "Finish",
  leave: "Leave the tour",
  link: "Copy a link to this stop",
  task: "Try it:",
  alone: "On your own:",
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
    pull: {
      title: "Pull the model",
      claim: () =>
        "This rat stands in a cage of handles. Pull the rat itself, and the handles move as little as they can.",
      task: "drag the rat's nose. Escape cancels a pull; Undo takes it back.",
      alone: "drop a model on the page. It gets a cage and is ready to be pulled.",
    },
    mirror: {
      title: "Select handles, and mirror",
      claim: () =>
        "The dots are handles. Select some and move them with the arrows of the gizmo. With “Mirror”, the other side moves too.",
      task: "switch “Mirror” on, click a handle at a hand, then drag it. A double click selects the ring around a limb.",
      alone: "Shift+click adds a handle to the selection, Ctrl+drag selects with a box.",
    },
    save: {
      title: "Save poses, and play them",
      claim: () =>
        "A saved pose is a key of an animation. The timeline below the view plays from one pose to the next.",
      task: "pull an arm and choose “Save pose”; pull it elsewhere and save again. Then press “Play”.",
      alone: "drag a key of the timeline to change its time. Each pose also has a slider that blends it in.",
    },
    clip: {
      title: "A figure that moves",
      claim: () =>
        "A figure with joints keeps its clips. What you change, its proportions or its pose, stays while a clip plays.",
      task: "choose “Longer legs” under “Proportions”, then choose a clip at the left of the timeline and press “Play”.",
      alone: "open a rigged .glb, .vrm or .fbx.",
    },
    export: {
      title: "Export",
      claim: () =>
        "The export is the file that you opened with its new shape. Joints, clips, materials and names are kept.",
      task: "choose “Download the GLB” at the end of the panel, and open it in your own program.",
      alone:
        "your work is kept in this browser. “Project” saves it as a file that this page and any viewer open.",
    },
    cage: {
      title: "What a cage does",
      claim: ([report]: Reports) =>
        report
          ? `Move a few of the cage's ${count(report.cage_vertices)} vertices and the rat's ${count(report.vertices)} points follow.`
          : "Move a few of the cage's vertices and the rat's points follow.",
      task: "pull the rat's nose. The cage follows, the feet stay.",
      alone:
        "any closed mesh can be a cage: drop yours together with the model, as model.obj and model-cage.obj.",
    },
    weight: {
      title: "One weight",
      claim: () =>
        "The weight of a cage vertex is how much each point follows it: between 0 and 1, fading with distance through the inside of the cage, not through the air.",
      task: "choose another handle (click, tap, or the keys [ and ]) and see how far its weight reaches.",
      alone: "choose “Weight” under “Colour” in the See panel, then select a handle of your own cage.",
    },
    grid: {
      title: "The grid",
      claim: () =>
        "A weight is a temperature: this cage vertex is held at 1 and all others at 0. Inside, each cell of a grid settles at the mean of its neighbours. Such weights are called harmonic coordinates.",
      task: "move the slice through the rat, then look at the cells themselves.",
      alone: "the See panel slices the grid of every bound model.",
    },
    paper: {
      title: "The published method, with 16 cells",
      claim: () =>
        "The published method (Joshi et al. 2007, as K. Smith describes it) gives every point the weights of its grid cell. With 16 cells along each side, all points of a cell land on one spot. The wireframe shows where they should be.",
      task: "choose 32 cells. The steps get smaller but do not vanish.",
      alone: "choose “Published” under “How it works” in step Bind.",
    },
    smoothing: {
      title: "Too little smoothing",
      claim: () =>
        "A sweep replaces every cell inside by the mean of its neighbours, so heat gets one cell further. If the sweeps stop at a change of 1e-3 (tau), the heat has not spread everywhere yet, and the rat does not fill its wireframe.",
      task: "continue until a sweep changes less than 1e-5.",
      alone: "“Advanced” in step Bind sets tau and the iteration limit.",
    },
    delta: {
      title: "Three ways to the same weights",
      claim: () =>
        "Three solvers for the same equations: Jacobi needs hundreds of sweeps, conjugate gradients dozens of steps, multigrid a handful of cycles.",
      task: "halve the grid to 16 cells. Which number stays the same?",
      alone: "step Bind lets you choose the solver and plots its convergence.",
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
      alone: "step Bind shows the times of every bind, and compares them with earlier ones.",
    },
    error: {
      title: "Error over grid and tau",
      claim: () =>
        "A finer grid needs a smaller tau: stopped at 1e-3, the rat comes out worse with 32 cells than with 16.",
      task: "choose a number to see the rat it belongs to.",
      alone: "choose “Error” under “Colour” in the See panel to see where the rest error is.",
    },
    coordinates: {
      title: "Harmonic, mean value, Green",
      claim: () =>
        "The lower jaw opens. With harmonic coordinates the upper jaw stays. Mean value coordinates act across the gap and drag it along. With Green coordinates it moves a little, but details keep their shape best.",
      task: "pull the upper jaw up and see what follows.",
      alone: "“Coordinates side by side” in the See panel compares them on your own model.",
    },
    smooth: {
      title: "A smooth cage, and a bone inside",
      claim: () =>
        "Where it bends, a cage of flat faces leaves its edges on the model. A smooth subdivision surface with the same handles does not. A bone inside adds a handle in the middle of the model.",
      task: "choose 2 steps and watch the bend, then put the bone in and pull it down.",
      alone: "“Smooth its surface” and “Controls inside” in step Cage do this for your own cage.",
    },
    splat: {
      title: "What a splat is",
      claim: () =>
        "This cow has no triangles: 10,000 splats, soft ellipsoids with a colour, show it. The cage deforms the space around each splat. Close to the splat, that is a stretch and a rotation, which turn a small sphere into an ellipsoid and a splat into another splat.",
      task: "pull the head, then point at the neck or tap it.",
      alone: "drop a capture (.ply, .splat, .spz or .sog) on the page.",
    },
  },
};
