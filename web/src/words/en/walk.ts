/** Text about clips of another file that the cage follows. */

export const walk = {
  sentence:
    "Opens a humanoid with a clip (GLB or VRM), fits its joints to this model, and lets the cage follow the clip.",
  open: "Walk with a rig's clip…",
  close: "Close the rig",
  exported: (name: string) =>
    `To export the frames, or to correct the joints: cagework deform MODEL --cage CAGE --rig ${name} --clip CLIP -o walk.ply`,
  again: "The model or its cage has changed: open the rig again.",
  failed: "The model cannot walk",
};
