/** The page's icons: 24 x 24, strokes only, drawn for this page. */

import { svg } from "./dom";

const PATHS = {
  model: "M12 3 20 7.5v9L12 21l-8-4.5v-9Z M4 7.5 12 12l8-4.5 M12 12v9",
  cage: "M5 6.5 13 4l6 4.5v8L11 20l-6-5Z M5 6.5l6 4.5 8-2.5 M11 11v9",
  bind: "M10 13.5a4 4 0 0 0 6 .5l3-3a4 4 0 0 0-6-6l-1 1 M14 10.5a4 4 0 0 0-6-.5l-3 3a4 4 0 0 0 6 6l1-1",
  pose: "M12 4.5a1.5 1.5 0 1 0 0 .01 M5 9c3 1 11 1 14-1 M12 8.5v6 M12 14.5 8.5 20.5 M12 14.5l4 6",
  export: "M12 15V4 M8 8l4-4 4 4 M5 14v4.5A1.5 1.5 0 0 0 6.5 20h11a1.5 1.5 0 0 0 1.5-1.5V14",
  open: "M4 18.5V6a1 1 0 0 1 1-1h4.5l2 2.5H19a1 1 0 0 1 1 1v10a1 1 0 0 1-1 1H5a1 1 0 0 1-1-1Z",
  upload: "M12 4v11 M8 11l4 4 4-4 M5 19.5h14",
  download: "M12 4v11 M8 11l4 4 4-4 M5 19.5h14",
  undo: "M8 5 4 9l4 4 M4 9h10a5.5 5.5 0 0 1 0 11h-3",
  redo: "m16 5 4 4-4 4 M20 9H10a5.5 5.5 0 0 0 0 11h3",
  eye: "M2.5 12S6 5.5 12 5.5 21.5 12 21.5 12 18 18.5 12 18.5 2.5 12 2.5 12Z M12 9.2a2.8 2.8 0 1 0 0 5.6 2.8 2.8 0 0 0 0-5.6Z",
  share:
    "M9 12.5 15.5 9 M9 11.5l6.5 3.5 M6.5 9.5a2.5 2.5 0 1 0 0 5 2.5 2.5 0 0 0 0-5Z M18 5.5a2.5 2.5 0 1 0 0 5 2.5 2.5 0 0 0 0-5Z M18 13.5a2.5 2.5 0 1 0 0 5 2.5 2.5 0 0 0 0-5Z",
  sun: "M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8Z M12 2.5v2 M12 19.5v2 M2.5 12h2 M19.5 12h2 M5.3 5.3l1.4 1.4 M17.3 17.3l1.4 1.4 M18.7 5.3l-1.4 1.4 M6.7 17.3l-1.4 1.4",
  moon: "M19.5 14A8 8 0 0 1 10 4.5 8 8 0 1 0 19.5 14Z",
  auto: "M12 3.5a8.5 8.5 0 1 0 0 17 8.5 8.5 0 0 0 0-17Z M12 3.5v17 M12 8h6.5 M12 12h8.5 M12 16h6.5",
  select: "M5 3.5 18 12l-6 1.5L9.5 20Z",
  move: "M12 3v18 M3 12h18 M9.5 5.5 12 3l2.5 2.5 M9.5 18.5 12 21l2.5-2.5 M5.5 9.5 3 12l2.5 2.5 M18.5 9.5 21 12l-2.5 2.5",
  rotate: "M19.5 12a7.5 7.5 0 1 1-2.5-5.6 M19.5 3.5v4h-4",
  scale: "M4 14v6h6 M4 20l7-7 M14 4h6v6 M20 4l-7 7",
  vertex: "M12 8.5a3.5 3.5 0 1 0 0 7 3.5 3.5 0 0 0 0-7Z M12 3v2.5 M12 18.5V21 M3 12h2.5 M18.5 12H21",
  edge: "M6 18 18 6 M6 16a2 2 0 1 0 0 4 2 2 0 0 0 0-4Z M18 4a2 2 0 1 0 0 4 2 2 0 0 0 0-4Z",
  face: "M12 4 20.5 19h-17Z M9 14.5h6",
  symmetry: "M12 3v18 M9 7 4 17h5Z M15 7l5 10h-5Z",
  proportional:
    "M12 10.5a1.5 1.5 0 1 0 0 3 1.5 1.5 0 0 0 0-3Z M12 7a5 5 0 1 0 0 10 5 5 0 0 0 0-10Z M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18Z",
  box: "M4 4h3 M10.5 4h3 M17 4h3v3 M20 10.5v3 M20 17v3h-3 M13.5 20h-3 M7 20H4v-3 M4 13.5v-3 M4 7V4",
  frame: "M4 9V4h5 M15 4h5v5 M20 15v5h-5 M9 20H4v-5 M12 9.5a2.5 2.5 0 1 0 0 5 2.5 2.5 0 0 0 0-5Z",
  perspective: "M7 5h10l3 14H4Z M12 5v14 M5.8 11h12.4",
  check: "M5 12.5 10 17.5 19.5 7",
  close: "M6 6l12 12 M18 6 6 18",
  warning: "M12 4 21.5 20h-19Z M12 10v4.5 M12 17.3v.01",
  info: "M12 3.5a8.5 8.5 0 1 0 0 17 8.5 8.5 0 0 0 0-17Z M12 11v5.5 M12 7.7v.01",
  lock: "M6 10.5h12V20H6Z M8.5 10.5V8a3.5 3.5 0 0 1 7 0v2.5",
  play: "M7.5 5v14l11-7Z",
  stop: "M7 7h10v10H7Z",
  plus: "M12 5v14 M5 12h14",
  trash: "M5 7h14 M9.5 7V4.5h5V7 M7 7l1 13h8l1-13 M10.5 11v5 M13.5 11v5",
  reset: "M4.5 12a7.5 7.5 0 1 0 2.5-5.6 M4.5 3.5v4h4",
  spark: "M12 3.5 14 10l6.5 2L14 14l-2 6.5L10 14l-6.5-2L10 10Z",
  hull: "M8 4.5h8l4.5 7.5-4.5 7.5H8L3.5 12Z",
  file: "M6 3.5h8l4.5 4.5V20.5H6Z M14 3.5V8h4.5",
  image: "M4 5h16v14H4Z M4 16l5-5 4 4 2.5-2.5L20 17 M15.5 8.3a1 1 0 1 0 0 .01",
  layers: "M12 4 20.5 8.5 12 13 3.5 8.5Z M3.5 12.5 12 17l8.5-4.5 M3.5 16.5 12 21l8.5-4.5",
  table: "M4 5h16v14H4Z M4 10h16 M4 14.5h16 M10 5v14",
  save: "M5 4h11l3 3v13H5Z M8 4v5h7V4 M8 20v-6h8v6",
  help: "M12 3.5a8.5 8.5 0 1 0 0 17 8.5 8.5 0 0 0 0-17Z M9.8 9.7a2.2 2.2 0 1 1 3.3 2c-.8.5-1.1.9-1.1 1.8 M12 16.5v.01",
  split: "M12 3.5v17 M4 6h5v12H4Z M15 6h5v12h-5Z",
  merge: "M4 6l7 6-7 6 M20 6l-7 6 7 6",
  extrude: "M4 15l8 4 8-4-8-4Z M12 11V3.5 M9 6l3-3 3 3",
  patch: "M12 4l7.5 5.5-3 9h-9l-3-9Z M9 12h6 M12 9v6",
} as const;

export type IconName = keyof typeof PATHS;

/** An icon; it says nothing to screen readers, the button around it does. */
export function icon(name: IconName): SVGSVGElement {
  const path = svg("path", { d: PATHS[name] });
  return svg("svg", { viewBox: "0 0 24 24", class: "icon", "aria-hidden": "true" }, path);
}

/** The product's mark: a cage. */
export function mark(): SVGSVGElement {
  const spots: readonly (readonly [number, number])[] = [
    [16, 3.2],
    [27, 9.5],
    [27, 22.5],
    [16, 28.8],
    [5, 22.5],
    [5, 9.5],
    [16, 16],
  ];
  const stroke = { fill: "none", stroke: "currentColor", "stroke-width": 2.2, "stroke-linejoin": "round" };
  return svg(
    "svg",
    { viewBox: "0 0 32 32", class: "mark", "aria-hidden": "true" },
    svg("path", { d: "M16 3 27 9.5v13L16 29 5 22.5v-13Z", ...stroke }),
    svg("path", { d: "M5 9.5 16 16l11-6.5M16 16v13", opacity: 0.6, ...stroke }),
    ...spots.map(([cx, cy]) => svg("circle", { cx, cy, r: 2.7, fill: "currentColor" })),
  );
}
