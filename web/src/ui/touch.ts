import { useLayoutEffect, useState } from "preact/hooks";

/** Whether the main pointer is a finger. Updates the component when this changes. */
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
