/** Modal dialog. With `onClose`, Escape, a button and clicks on the backdrop close it. */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { T } from "../words";
import { IconButton, useUid } from "./controls";

interface DialogProps {
  title: string;
  isOpen: boolean;
  /** Called after the dialog was closed. Without this function, the user cannot close the dialog. */
  onClose?: () => void;
  kind?: string;
  onKeyDown?: (event: KeyboardEvent) => void;
  children: ComponentChildren;
}

export function Dialog({ title, isOpen, onClose, kind = "", onKeyDown, children }: DialogProps) {
  const element = useRef<HTMLDialogElement>(null);
  const id = useUid();
  useLayoutEffect(() => {
    const { current } = element;
    if (isOpen && !current?.open) current?.showModal();
    if (!isOpen && current?.open) current.close();
  }, [isOpen]);
  const close = () => element.current?.close();
  return (
    <dialog
      ref={element}
      class={`sheet ${kind}`.trim()}
      aria-labelledby={id}
      onClose={onClose}
      onCancel={(event) => onClose || event.preventDefault()}
      onClick={(event) => onClose && event.target === element.current && close()}
      onKeyDown={onKeyDown}
    >
      <div class="row sheet-head">
        <h2 class="grow" id={id}>
          {title}
        </h2>
        {onClose && <IconButton icon="close" label={T.close} onClick={close} />}
      </div>
      {children}
    </dialog>
  );
}
