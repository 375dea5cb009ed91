/** Tool tips of elements with `data-tip`. They appear on hovering, on keyboard focus, and on a long press. */

/** Hover time before a tip appears, ms. */
const REST_MS = 500;
/** Time for which a tip stays visible after the finger is lifted, ms. */
const LINGER_MS = 2500;
/** Distance of a tip from its element, and minimum distance from the window's edge, CSS pixels. */
const GAP = 6;

interface Size {
  readonly width: number;
  readonly height: number;
}

/**
 * Finds the upper left corner of a tip: below its element, above it if there is no room, or beside it in a vertical
 * toolbar.
 */
export function placeTip(box: DOMRectReadOnly, tip: Size, isInColumn: boolean, window: Size) {
  const inside = (at: number, size: number, limit: number) => Math.min(Math.max(GAP, at), limit - size - GAP);
  if (isInColumn) {
    const right = box.right + GAP;
    const x = right + tip.width < window.width ? right : box.x - tip.width - GAP;
    return { x, y: inside(box.y + (box.height - tip.height) / 2, tip.height, window.height) };
  }
  const below = box.bottom + GAP;
  const y = below + tip.height < window.height ? below : box.y - tip.height - GAP;
  return { x: inside(box.x + (box.width - tip.width) / 2, tip.width, window.width), y };
}

/** Whether an element is in a vertical toolbar. */
function isInColumn(element: Element): boolean {
  return element.closest("[role=toolbar]")?.getAttribute("aria-orientation") === "vertical";
}

export function attachTips(): void {
  const tip = document.createElement("div");
  tip.className = "tip";
  tip.id = "tip";
  tip.popover = "manual";
  tip.setAttribute("role", "tooltip");
  document.body.append(tip);
  let about: Element | null = null;
  let timer: ReturnType<typeof setTimeout> | undefined;

  const place = (target: Element) => {
    const box = target.getBoundingClientRect();
    const { width, height } = tip.getBoundingClientRect();
    const { x, y } = placeTip(box, { width, height }, isInColumn(target), {
      width: innerWidth,
      height: innerHeight,
    });
    tip.style.translate = `${x}px ${y}px`;
  };
  /** Moves the tip with its element when the contents of a dialog change. */
  const resized = new ResizeObserver(() => about && place(about));
  const hide = () => {
    clearTimeout(timer);
    resized.disconnect();
    if (about?.getAttribute("aria-describedby") === tip.id) about.removeAttribute("aria-describedby");
    about = null;
    if (tip.matches(":popover-open")) tip.hidePopover();
  };
  const show = (target: Element) => {
    const text = target.getAttribute("data-tip");
    if (!text || !target.isConnected) return;
    tip.textContent = text;
    if (!target.hasAttribute("aria-describedby")) target.setAttribute("aria-describedby", tip.id);
    if (!tip.matches(":popover-open")) tip.showPopover();
    place(target);
    const dialog = target.closest("dialog");
    if (dialog) resized.observe(dialog);
  };
  const later = (target: Element | null, ms: number) => {
    if (target === about) return;
    hide();
    about = target;
    if (target) timer = setTimeout(() => show(target), ms);
  };
  const of = (event: Event) => (event.target instanceof Element ? event.target.closest("[data-tip]") : null);

  document.addEventListener("pointerover", (event) => {
    if (event.pointerType === "mouse") later(of(event), REST_MS);
  });
  document.addEventListener("focusin", (event) => {
    if (event.target instanceof Element && event.target.matches(":focus-visible")) later(of(event), 0);
  });
  document.addEventListener("focusout", hide);
  document.addEventListener("pointerdown", (event) => {
    hide();
    if (event.pointerType !== "mouse") later(of(event), REST_MS);
  });
  document.addEventListener("pointerup", (event) => {
    if (event.pointerType === "mouse") return;
    clearTimeout(timer);
    timer = setTimeout(hide, LINGER_MS);
  });
  document.addEventListener("keydown", hide);
  document.addEventListener("scroll", hide, { capture: true, passive: true });
}
