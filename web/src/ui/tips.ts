/** Tool tips of elements with `data-tip`: after hovering, on keyboard focus, and on a long press. */

/** Hover time before a tip appears, ms. */
const REST_MS = 500;
/** Time a tip stays after the finger is lifted, ms. */
const READ_MS = 2500;
/** Distance of a tip to its element and to the window's edge, CSS pixels. */
const GAP = 6;

export function attachTips(): void {
  const tip = document.createElement("div");
  tip.className = "tip";
  tip.id = "tip";
  tip.popover = "manual";
  tip.setAttribute("role", "tooltip");
  document.body.append(tip);
  let about: Element | null = null;
  let timer: ReturnType<typeof setTimeout> | undefined;

  const hide = () => {
    clearTimeout(timer);
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
    const box = target.getBoundingClientRect();
    const { width, height } = tip.getBoundingClientRect();
    const x = Math.min(Math.max(GAP, box.x + (box.width - width) / 2), innerWidth - width - GAP);
    const below = box.bottom + GAP;
    const y = below + height < innerHeight ? below : box.top - height - GAP;
    tip.style.translate = `${x}px ${y}px`;
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
    timer = setTimeout(hide, READ_MS);
  });
  document.addEventListener("keydown", hide);
  document.addEventListener("scroll", hide, { capture: true, passive: true });
}
