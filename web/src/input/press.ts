/** Clicks of buttons that move while they are pressed. */

/** The parts of an element that a press reads. */
interface Pressable {
  readonly isConnected: boolean;
  contains(other: unknown): boolean;
}

interface Box {
  readonly left: number;
  readonly top: number;
  readonly right: number;
  readonly bottom: number;
}

/** What to do with a click: deliver it as it is, or to the button that was pressed, or drop it. */
type Delivery<B> = "as is" | "drop" | B;

/**
 * A press may redraw its panel, for example because it commits a number that was typed, and so move the pressed button.
 * Browsers then deliver the click to whatever is around both places. The button that was pressed gets it instead, if
 * the pointer was released where the button was.
 */
export function createPress<B extends Pressable>() {
  let pressed: { button: B; box: Box; pointer: number; inside: boolean } | undefined;
  return {
    down(pointer: number, button: B | null, box?: Box) {
      pressed = button && box ? { button, box, pointer, inside: false } : undefined;
    },
    up(pointer: number, x: number, y: number) {
      if (pressed?.pointer !== pointer) return;
      const { left, top, right, bottom } = pressed.box;
      pressed.inside = x >= left && x <= right && y >= top && y <= bottom;
    },
    cancel() {
      pressed = undefined;
    },
    click(target: unknown): Delivery<B> {
      const press = pressed;
      pressed = undefined;
      if (!press?.inside || press.button.contains(target)) return "as is";
      return press.button.isConnected ? press.button : "drop";
    },
  };
}

export function attachPress(): void {
  const press = createPress<HTMLElement>();
  const capture = { capture: true };
  window.addEventListener(
    "pointerdown",
    ({ pointerId, target, isPrimary, button }) => {
      const isPress = isPrimary && button === 0 && target instanceof Element;
      const found = isPress ? target.closest<HTMLElement>("button, summary, a, label") : null;
      press.down(pointerId, found, found?.getBoundingClientRect());
    },
    capture,
  );
  window.addEventListener(
    "pointerup",
    ({ pointerId, clientX, clientY }) => press.up(pointerId, clientX, clientY),
    capture,
  );
  window.addEventListener("pointercancel", press.cancel, capture);
  window.addEventListener(
    "click",
    (event) => {
      const delivery = press.click(event.target);
      if (delivery === "as is") return;
      event.stopImmediatePropagation();
      event.preventDefault();
      if (delivery !== "drop") delivery.click();
    },
    capture,
  );
}
