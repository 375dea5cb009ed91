/** Text of gallery.html, downloaded with it. */

export const galleryWords = {
  name: "Gallery - Cagework",
  title: "gallery",
  sentence:
    "Live examples, computed in this page. Drag a view to turn it. Click a title to open and change the example.",
  play: "Play",
  playOf: (title: string) => `Play: ${title}`,
  /** Titles and texts of the examples, by their keys in gallery/links.json. */
  examples: {
    pull: { title: "Pull the model", text: "One point of the head is pulled, and the cage follows." },
    capture: { title: "Bend a capture", text: "10,000 Gaussian splats move, turn and stretch." },
    walk: { title: "Reshape a walk", text: "The cage makes the legs longer; the clip stays the same." },
    dress: { title: "Dress a body", text: "A dummy, a dress and a belt in one cage." },
    smooth: {
      title: "Smooth the cage",
      text: "Catmull-Clark subdivision: faces bend, with the same handles.",
    },
    compare: {
      title: "Compare coordinates",
      text: "A jaw opens by harmonic, mean value and Green coordinates, from left to right.",
    },
  },
};
