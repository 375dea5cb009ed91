/** How much of the view its overlays cover. */

type Box = Pick<DOMRect, "left" | "top" | "right" | "bottom">;

/** Overlays along a side of the view. Those in a corner, such as the axes and the status, cover too little. */
const OVERLAYS = ".mode, .tools, .looks, .hint-line";

/** Widths of the margins under overlays: left, top, right, bottom, CSS pixels. */
export type Margins = [left: number, top: number, right: number, bottom: number];

export function coveredIn(viewport: HTMLElement): Margins {
  const overlays = viewport.parentElement?.querySelectorAll(OVERLAYS) ?? [];
  const boxes = Array.from(overlays, (overlay) => overlay.getBoundingClientRect());
  return marginsOf(viewport.getBoundingClientRect(), boxes);
}

/** A column covers the nearer of the left and right sides, a row the nearer of the top and the bottom. */
export function marginsOf(view: Box, overlays: readonly Box[]): Margins {
  const margins: Margins = [0, 0, 0, 0];
  for (const { left, top, right, bottom } of overlays) {
    const reach = [right - view.left, bottom - view.top, view.right - left, view.bottom - top];
    if (right <= left && bottom <= top) continue;
    const start = bottom - top > right - left ? 0 : 1;
    const [near = 0, far = 0] = [reach[start], reach[start + 2]];
    const side = start + (near < far ? 0 : 2);
    margins[side] = Math.max(margins[side] ?? 0, Math.min(near, far));
  }
  return margins;
}
