/** Mounts all components of the page. */

import { type FunctionComponent, render } from "preact";
import type { App } from "../app";
import type { Lack } from "../contract";
import { Bar } from "./bar";
import { Hover } from "./hover";
import { Panel } from "./panel";
import { See } from "./see";
import { Sheet } from "./sheet";
import { Overlays } from "./stage";
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

function Dialogs({ app }: { app: App }) {
  const { sheetOpen } = app.store.get();
  return (
    <>
      <Sheet app={app} isOpen={sheetOpen} onClose={() => app.store.set({ sheetOpen: false })} />
      <WaysDialog app={app} />
      <WorksList app={app} />
    </>
  );
}

export function mountUnsupported(lack: Lack): void {
  document.body.replaceChildren();
  render(<Unsupported lack={lack} />, document.body);
}
