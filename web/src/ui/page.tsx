/** Mounts all components of the page. */

import { loadPart } from "@cagework/core/session/parts";
import { type FunctionComponent, render } from "preact";
import { useEffect, useState } from "preact/hooks";
import { attempt } from "../actions/context";
import type { App } from "../app";
import type { WebGpuFault } from "../contract";
import { loadSheet, T } from "../words";
import { Bar } from "./bar";
import { Hover } from "./hover";
import { Panel } from "./panel";
import { See } from "./see";
import { Overlays } from "./stage";
import { Timeline } from "./timeline";
import { attachTips } from "./tips";
import { Notice, Unsupported, WaysDialog } from "./unsupported";
import { WorksList } from "./works";

interface Parts {
  app: App;
  Toasts: FunctionComponent;
  Lost: FunctionComponent;
  byId: (id: string) => HTMLElement;
}

export function mount({ app, Toasts, Lost, byId }: Parts): void {
  const stage = byId("stage");
  /** Appends an element with `display: contents`, so that it does not affect the layout. */
  const within = (parent: HTMLElement) => {
    const place = document.createElement("div");
    place.className = "contents";
    parent.append(place);
    return place;
  };
  render(<Bar app={app} showSheet={() => app.store.set({ sheetOpen: true })} />, byId("bar"));
  render(<Panel app={app} />, byId("panel"));
  render(
    <>
      <Overlays app={app} stage={stage} />
      <Lost />
    </>,
    within(stage),
  );
  render(
    <>
      <Notice app={app} />
      <See app={app} />
      <Timeline app={app} />
      <Tour app={app} />
      <Dialogs app={app} />
      <Hover app={app} />
      <Toasts />
    </>,
    within(byId("app")),
  );
  attachTips();
}

/** The card of the tour; nothing while the tour is not running. */
function Tour({ app }: { app: App }) {
  const { tour } = app.store.get();
  const loaded = app.tour.loaded();
  return tour && loaded ? <loaded.Card app={app} tour={tour} guide={loaded.guide} /> : null;
}

let Sheet: typeof import("./sheet").Sheet | undefined;

/** Downloads the shortcut sheet with its sentences. */
export async function loadSheetPart(): Promise<void> {
  const [part] = await loadPart(Promise.all([import("./sheet"), loadSheet()]));
  Sheet = part.Sheet;
}

/** The shortcut sheet, which is downloaded when it is first opened. */
function LateSheet({ app }: { app: App }) {
  const { sheetOpen } = app.store.get();
  const [, setLoaded] = useState(false);
  const close = () => app.store.set({ sheetOpen: false });
  useEffect(() => {
    if (!sheetOpen || Sheet) return;
    void attempt(app.ctx, T.failed.sheet, loadSheetPart).then((went) => (went ? setLoaded(true) : close()));
  }, [sheetOpen]);
  return Sheet ? <Sheet app={app} isOpen={sheetOpen} onClose={close} /> : null;
}

function Dialogs({ app }: { app: App }) {
  return (
    <>
      <LateSheet app={app} />
      <WaysDialog app={app} />
      <WorksList app={app} />
    </>
  );
}

export function mountUnsupported(lack: WebGpuFault): void {
  document.body.replaceChildren();
  render(<Unsupported lack={lack} />, document.body);
}
