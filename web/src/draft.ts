/** Text that the user types into a field, until it is committed or dropped. */

/** What a field shows, and what it does with the text that the user enters. */
export interface Entry<T> {
  /** Text of the value in use. */
  readonly text: string;
  /** Reads entered text. Undefined if it is malformed: it then stays in the field. */
  readonly parse: (text: string) => T | undefined;
  /** Takes the value. Returns false if it is refused: the field then shows the value in use. */
  readonly onCommit: (value: T) => unknown;
}

/** An input or a textarea. */
interface Field {
  value: string;
}

/** Commits the draft that is being typed. The user types into one field at a time. */
let commitTyped: (() => void) | undefined;
/** The field of this draft. */
let typedField: unknown;

/** Commits the draft that is being typed, if there is one. Call this before an action that reads or changes values. */
export function commitDraft(): void {
  commitTyped?.();
}

/**
 * Commits the draft before the page handles a press, click or drop outside its field, and before the page is left. Not
 * all of these take the focus from the field: a tap on a button does not in Safari.
 */
export function attachDrafts(window: EventTarget): void {
  const leave = ({ target }: Event) => {
    if (target !== typedField) commitDraft();
  };
  for (const type of ["pointerdown", "click", "drop", "pagehide"]) {
    window.addEventListener(type, leave, { capture: true });
  }
}

/** Creates the draft of one field. */
export function createDraft<T>() {
  let field: Field | undefined;
  let entry: Entry<T> | undefined;
  let malformed = false;

  const isTyping = () => commitTyped === commit;
  const stop = () => {
    if (isTyping()) [commitTyped, typedField] = [undefined, undefined];
  };
  const show = () => {
    malformed = false;
    if (field && entry && field.value !== entry.text) field.value = entry.text;
  };
  const commit = () => {
    if (!isTyping() || !field || !entry) return;
    // Stop first, so that `onCommit` can run actions that commit the draft, and so that it is called once.
    stop();
    if (field.value === entry.text) return;
    const value = entry.parse(field.value);
    malformed = value === undefined;
    if (value !== undefined && entry.onCommit(value) === false) show();
  };
  return {
    /** Shows the value in use, unless the user is typing or has entered malformed text for this value. */
    update(to: Field, next: Entry<T>) {
      const isOther = field !== to || next.text !== entry?.text;
      [field, entry] = [to, next];
      if (!isTyping() && (isOther || !malformed)) show();
    },
    /** Notes that the user has changed the text. */
    type() {
      if (!isTyping()) commitDraft();
      malformed = false;
      [commitTyped, typedField] = [commit, field];
    },
    /** Passes what was typed to `onCommit`, once. */
    commit,
    /** Shows the value in use in place of what was typed. */
    drop() {
      stop();
      show();
    },
    isMalformed: () => malformed,
  };
}

/** Allowed numbers: from `min` to `max`, and `step` apart if there is one. */
export interface NumberRange {
  readonly min?: number | undefined;
  readonly max?: number | undefined;
  readonly step?: number | undefined;
}

/** Reads a number. Undefined if the text is not one, or not in the range. */
export function numberIn(
  text: string,
  { min = -Infinity, max = Infinity, step }: NumberRange,
): number | undefined {
  const value = text.trim() === "" ? Number.NaN : Number(text);
  if (!Number.isFinite(value) || value < min || value > max) return undefined;
  const steps = step === undefined ? 0 : (value - (Number.isFinite(min) ? min : 0)) / step;
  return Math.abs(steps - Math.round(steps)) < 1e-6 ? value : undefined;
}
