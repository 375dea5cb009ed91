/**
 * Toolbar, by the toolbar pattern of WAI-ARIA: it is one tab stop, and arrow keys, Home and End move the focus in it.
 */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useRef, useState } from "preact/hooks";

interface ToolbarProps {
  label: string;
  /** Class names from stage.css. */
  kind: string;
  children: ComponentChildren;
}

export function Toolbar({ label, kind, children }: ToolbarProps) {
  const element = useRef<HTMLDivElement>(null);
  const stop = useRef<HTMLElement | null>(null);
  const [isColumn, setColumn] = useState(false);

  const buttons = () =>
    Array.from(element.current?.querySelectorAll<HTMLElement>("button:not(:disabled)") ?? []).filter(
      (button) => button.checkVisibility(),
    );
  const stopAt = (button: HTMLElement | undefined) => {
    stop.current = button ?? null;
    for (const one of element.current?.querySelectorAll("button") ?? []) {
      one.tabIndex = one === button ? 0 : -1;
    }
  };

  const keepStop = () => {
    const all = buttons();
    stopAt(all.find((button) => button === stop.current) ?? all[0]);
  };
  useLayoutEffect(keepStop);
  useLayoutEffect(() => {
    const { current } = element;
    if (!current) return;
    // The style sheet determines whether the toolbar is a row or a column.
    const observer = new ResizeObserver(() => {
      setColumn(current.clientHeight > current.clientWidth);
      // In a low view the style sheet hides the toolbar, and buttons that are not visible are no tab stops.
      keepStop();
    });
    observer.observe(current);
    return () => observer.disconnect();
  }, []);

  const move = (event: KeyboardEvent) => {
    const all = buttons();
    const next = nextTool(event.key, isColumn, all.indexOf(event.target as HTMLElement), all.length);
    if (next === undefined || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    event.preventDefault();
    all[next]?.focus();
  };

  return (
    <div
      class={`floating ${kind}`}
      role="toolbar"
      aria-label={label}
      aria-orientation={isColumn ? "vertical" : "horizontal"}
      ref={element}
      onKeyDown={move}
      onFocusIn={({ target }) => stopAt(target as HTMLElement)}
    >
      {children}
    </div>
  );
}

/** Index of the tool that gets the focus after a key at tool `from`; undefined if the key does not move it. */
export function nextTool(key: string, isColumn: boolean, from: number, count: number): number | undefined {
  const [back, forth] = isColumn ? ["ArrowUp", "ArrowDown"] : ["ArrowLeft", "ArrowRight"];
  if (key === "Home") return 0;
  if (key === "End") return count - 1;
  if (key === back) return (from + count - 1) % count;
  if (key === forth) return (from + 1) % count;
  return undefined;
}
