/** How much of the view its overlays cover. */

type Box = Pick<DOMRect, "left" | "top" | "right" | "bottom">;

/**
 * Selectors of overlays along a side of the view. Overlays in a corner, such as the axes and the status, are not
 * counted, because they cover little.
 */
const OVERLAYS = ".mode, .tools, .looks, .hint-line";

/** Widths of the margins under overlays: left, top, right, bottom, CSS pixels. */
export type Margins = [left: number, top: number, right: number, bottom: number];

export function coveredIn(viewport: HTMLElement): Margins {
  const overlays = viewport.parentElement?.querySelectorAll(OVERLAYS) ?? [];
  const boxes = Array.from(overlays, (overlay) => overlay.getBoundingClientRect());
  return marginsOf(viewport.getBoundingClientRect(), boxes);
}

/**
 * Widths of the margins of a view that overlays hide. An overlay that is taller than it is wide counts towards the left
 * or right margin, whichever is nearer; any other counts towards the top or bottom.
 */
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
