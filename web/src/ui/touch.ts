import { useLayoutEffect, useState } from "preact/hooks";

/** Whether the main pointer is a finger. It can change while the page is open. */
export function useTouch(): boolean {
  const [query] = useState(() => matchMedia("(pointer: coarse)"));
  const [isTouch, setTouch] = useState(query.matches);
  useLayoutEffect(() => {
    const hear = () => setTouch(query.matches);
    query.addEventListener("change", hear);
    return () => query.removeEventListener("change", hear);
  }, [query]);
  return isTouch;
}
