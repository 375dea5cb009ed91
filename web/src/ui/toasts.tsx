/**
 * Messages. Short ones disappear after a few seconds; problems stay until they are closed or fixed. Screen readers
 * announce both.
 */

import { type Signal, signal } from "@preact/signals";
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import type { Fix, Messages } from "../actions/context";
import { type Message, textOf } from "../strings";
import { T } from "../words";
import { Button, IconButton, Say } from "./controls";
import { Icon } from "./icons";

/** Time for which a message is shown, ms. */
const TOAST_MS = 5000;
/** Time for which a message with a button is shown, ms. */
const TOAST_WITH_BUTTON_MS = 12_000;
/**
 * Time for which a message is shown before a touch beside it can close it, ms. An earlier touch is not a reaction to
 * the message.
 */
const LINGER_MS = 1000;
/** Maximum number of visible messages of a kind, so that they do not hide the model. */
const MAX_TOASTS = 3;

interface Toast {
  readonly id: number;
  /** Headline of a problem, which stays until it is closed. */
  readonly title?: string;
  readonly text: Message;
  readonly fixes: readonly Fix[];
  /** Whether the message stays until the user closes it. */
  readonly stays?: boolean;
  /** Time at which the message was shown, ms. */
  readonly since: number;
}

/** A message with several buttons is a question, which stays until it is answered or something new starts. */
const isQuestion = (fixes: readonly Fix[]) => fixes.length > 1;

type List = Signal<readonly Toast[]>;

const close = (list: List, id: number) => {
  list.value = list.value.filter((toast) => toast.id !== id);
};

let next = 0;

export function createToasts() {
  const said = signal<readonly Toast[]>([]);
  const problems = signal<readonly Toast[]>([]);

  /** Adds a message. If the same message is already shown, replaces it. */
  const add = (list: List, toast: Omit<Toast, "id" | "since">) => {
    const isSame = ({ title, text }: Toast) => title === toast.title && textOf(text) === textOf(toast.text);
    const others = list.value.filter((other) => !isSame(other));
    next += 1;
    const all = [...others, { ...toast, id: next, since: performance.now() }];
    const latest = all.filter(({ stays }) => !stays).slice(-MAX_TOASTS);
    list.value = all.filter((one) => one.stays || latest.includes(one));
  };
  const tell: Messages = {
    say: (text, ...fixes) => add(said, { text, fixes }),
    problem: ({ title, message }, fix) => add(problems, { title, text: message, fixes: fix ? [fix] : [] }),
    clear() {
      problems.value = [];
      said.value = said.value.filter(({ fixes }) => !isQuestion(fixes));
    },
    closeLatest() {
      const lists = [said, problems];
      const ids = lists.flatMap((list) => list.value.map(({ id }) => id));
      for (const list of lists) close(list, Math.max(...ids));
      return ids.length > 0;
    },
  };

  return {
    Toasts: () => <Stack said={said} problems={problems} />,
    tell,
    /** Shows an offer that stays until it is taken or closed. */
    offer: (text: string, fix: Fix) => add(said, { text, fixes: [fix], stays: true }),
  };
}

function Stack({ said, problems }: { said: List; problems: List }) {
  const element = useRef<HTMLDivElement>(null);
  const isEmpty = said.value.length + problems.value.length === 0;
  useLayoutEffect(() => {
    const { current } = element;
    const isOpen = current?.matches(":popover-open");
    // Reopen the popover, so that it is above a dialog opened in the meantime.
    if (isOpen && (isEmpty || document.querySelector("dialog[open]"))) current?.hidePopover();
    if (!isEmpty && !current?.matches(":popover-open")) current?.showPopover();
  }, [said.value, problems.value]);
  useEffect(() => {
    // A touch beside the messages closes them, because they cover much of the model on a small screen.
    const press = ({ pointerType, target, timeStamp }: PointerEvent) => {
      if (pointerType !== "touch" || element.current?.contains(target as Node)) return;
      for (const { id, stays, since } of said.value)
        if (!stays && timeStamp - since > LINGER_MS) close(said, id);
    };
    document.addEventListener("pointerdown", press, true);
    return () => document.removeEventListener("pointerdown", press, true);
  }, []);
  return (
    <div class="toasts" id="toasts" popover="manual" ref={element}>
      <div class="toast-list" role="alert">
        {problems.value.map((toast) => (
          <Item key={toast.id} toast={toast} close={() => close(problems, toast.id)} />
        ))}
      </div>
      <div class="toast-list" role="status" aria-live="polite">
        {said.value.map((toast) => (
          <Item key={toast.id} toast={toast} close={() => close(said, toast.id)} />
        ))}
      </div>
    </div>
  );
}

function Item({ toast: { title, text, fixes, stays }, close }: { toast: Toast; close: () => void }) {
  const timer = useRef<ReturnType<typeof setTimeout>>(undefined);
  const leaveIn = (ms: number) => {
    clearTimeout(timer.current);
    if (!title && !stays && !isQuestion(fixes)) timer.current = setTimeout(close, ms);
  };
  // Do not close a message that is hovered or focused.
  const stay = () => clearTimeout(timer.current);
  useEffect(() => {
    leaveIn(fixes.length > 0 ? TOAST_WITH_BUTTON_MS : TOAST_MS);
    return stay;
  }, []);
  return (
    <div
      class={title ? "toast problem" : "toast"}
      onPointerEnter={stay}
      onPointerLeave={() => leaveIn(TOAST_MS)}
      onFocusIn={stay}
    >
      <Icon name={title ? "warning" : "info"} />
      <div class="grow">
        {title && <strong>{title}</strong>}
        <Say text={text} />
      </div>
      <IconButton icon="close" label={T.toast.close} onClick={close} kind="small" />
      {fixes.length > 0 && (
        <div class="row wrap toast-fix">
          {fixes.map(({ label, run }) => {
            const take = () => {
              close();
              run();
            };
            return <Button key={label} label={label} onClick={take} />;
          })}
        </div>
      )}
    </div>
  );
}
