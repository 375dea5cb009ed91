/**
 * Messages. Short ones disappear after a few seconds; problems stay until they are closed or fixed. Screen readers
 * announce both.
 */

import { signal } from "@preact/signals";
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

let next = 0;

export interface ToastParts {
  readonly Toasts: () => preact.JSX.Element;
  readonly tell: Messages;
  /** Shows an offer that stays until it is taken or closed. */
  offer(text: string, fix: Fix): void;
}

export function createToasts(): ToastParts {
  const said = signal<readonly Toast[]>([]);
  const problems = signal<readonly Toast[]>([]);

  /** Adds a message. If the same message is already shown, replaces it. */
  const add = (list: typeof said, toast: Omit<Toast, "id" | "since">) => {
    const isSame = ({ title, text }: Toast) => title === toast.title && textOf(text) === textOf(toast.text);
    const others = list.value.filter((other) => !isSame(other));
    next += 1;
    const all = [...others, { ...toast, id: next, since: performance.now() }];
    const latest = all.filter(({ stays }) => !stays).slice(-MAX_TOASTS);
    list.value = all.filter((one) => one.stays || latest.includes(one));
  };
  const closing = (list: typeof said) => (id: number) => {
    list.value = list.value.filter((toast) => toast.id !== id);
  };

  return {
    Toasts: () => (
      <Stack
        said={said.value}
        problems={problems.value}
        closeSaid={closing(said)}
        closeProblem={closing(problems)}
      />
    ),
    tell: {
      say: (text, ...fixes) => add(said, { text, fixes }),
      problem: ({ title, message }, fix) => add(problems, { title, text: message, fixes: fix ? [fix] : [] }),
      clear: () => {
        problems.value = [];
        said.value = said.value.filter(({ fixes }) => !isQuestion(fixes));
      },
    },
    offer: (text, fix) => add(said, { text, fixes: [fix], stays: true }),
  };
}

interface StackProps {
  said: readonly Toast[];
  problems: readonly Toast[];
  closeSaid: (id: number) => void;
  closeProblem: (id: number) => void;
}

function Stack({ said, problems, closeSaid, closeProblem }: StackProps) {
  const element = useRef<HTMLDivElement>(null);
  const isEmpty = said.length + problems.length === 0;
  useLayoutEffect(() => {
    const { current } = element;
    const isOpen = current?.matches(":popover-open");
    // Reopen the popover, so that it is above a dialog opened in the meantime.
    if (isOpen && (isEmpty || document.querySelector("dialog[open]"))) current?.hidePopover();
    if (!isEmpty && !current?.matches(":popover-open")) current?.showPopover();
  }, [said, problems, isEmpty]);
  useEffect(() => {
    // A touch beside the messages closes them, because they cover much of the model on a small screen.
    const press = ({ pointerType, target, timeStamp }: PointerEvent) => {
      if (pointerType !== "touch" || element.current?.contains(target as Node)) return;
      for (const { id, stays, since } of said) if (!stays && timeStamp - since > LINGER_MS) closeSaid(id);
    };
    document.addEventListener("pointerdown", press, true);
    return () => document.removeEventListener("pointerdown", press, true);
  }, [said]);
  return (
    <div class="toasts" id="toasts" popover="manual" ref={element}>
      <div class="toast-list" role="alert">
        {problems.map((toast) => (
          <Problem key={toast.id} toast={toast} close={() => closeProblem(toast.id)} />
        ))}
      </div>
      <div class="toast-list" role="status" aria-live="polite">
        {said.map((toast) => (
          <Said key={toast.id} toast={toast} close={() => closeSaid(toast.id)} />
        ))}
      </div>
    </div>
  );
}

function Fixes({ fixes, close }: { fixes: readonly Fix[]; close: () => void }) {
  if (fixes.length === 0) return null;
  return (
    <div class="row wrap toast-fix">
      {fixes.map(({ label, run }) => (
        <Button
          key={label}
          label={label}
          kind="small"
          onClick={() => {
            close();
            run();
          }}
        />
      ))}
    </div>
  );
}

function Said({ toast: { text, fixes, stays }, close }: { toast: Toast; close: () => void }) {
  const timer = useRef<ReturnType<typeof setTimeout>>(undefined);
  const leaveIn = (ms: number) => {
    clearTimeout(timer.current);
    if (!stays && !isQuestion(fixes)) timer.current = setTimeout(close, ms);
  };
  // Do not close a message that is hovered or focused.
  const stay = () => clearTimeout(timer.current);
  useEffect(() => {
    leaveIn(fixes.length > 0 ? TOAST_WITH_BUTTON_MS : TOAST_MS);
    return stay;
  }, []);
  return (
    <div class="toast" onPointerEnter={stay} onPointerLeave={() => leaveIn(TOAST_MS)} onFocusIn={stay}>
      <Icon name="info" />
      <Say text={text} />
      <IconButton icon="close" label={T.toast.close} onClick={close} kind="small" />
      <Fixes fixes={fixes} close={close} />
    </div>
  );
}

function Problem({ toast: { title, text, fixes }, close }: { toast: Toast; close: () => void }) {
  return (
    <div class="toast problem">
      <Icon name="warning" />
      <div class="grow">
        <strong>{title}</strong>
        <Say text={text} />
      </div>
      <IconButton icon="close" label={T.toast.close} onClick={close} kind="small" />
      <Fixes fixes={fixes} close={close} />
    </div>
  );
}
