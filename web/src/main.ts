/** Entry point of the page. */

import { lackOf } from "@cagework/core/session/adapter";
import { loadPart } from "@cagework/core/session/parts";
import { createApp } from "./app";
import type { Session } from "./contract";
import { watchCrashes } from "./crash";
import { attachDrafts } from "./draft";
import { attachBrush } from "./input/brush";
import { attachDrop } from "./input/drop";
import { attachKeyboard } from "./input/keyboard";
import { attachPointer } from "./input/pointer";
import { attachPress } from "./input/press";
import { keepOffline } from "./offline/keep";
import { openSession } from "./session";
import { createStore } from "./signals";
import { isFresh, startUp } from "./start";
import { INITIAL_STATE } from "./state";
import { forgetCrash } from "./store";
import { explain, messageOf, textOf } from "./strings";
import { askAfterCrash } from "./ui/crashed";
import { createLost } from "./ui/lost";
import { mount, mountUnsupported } from "./ui/page";
import { showHiddenCharacters, shown } from "./ui/shown";
import { createToasts } from "./ui/toasts";
import { createStage } from "./ui/viewport";
import { chooseLanguage, T } from "./words";

function byId(id: string): HTMLElement {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page lacks #${id}`);
  return element;
}

/** Reloads the page without the share link in its address, because the link may have caused the crash. */
function restart(): void {
  window.history.replaceState(null, "", location.pathname + location.search);
  location.reload();
}

/** Downloads the code of the gallery and shows the gallery. */
async function gallery(): Promise<void> {
  // Tell the service worker which build is in use. The gallery does not register it.
  keepOffline(() => undefined);
  try {
    const { showGallery } = await loadPart(import("./gallery/gallery"));
    await showGallery();
  } catch (error) {
    document.body.textContent = shown(textOf(messageOf(error)));
  }
}

async function main(): Promise<void> {
  await chooseLanguage();
  showHiddenCharacters();
  // gallery.html has the content of index.html. Some servers omit the ending in the address.
  if (/\/gallery(\.html)?$/.test(location.pathname)) return gallery();
  const stage = createStage(byId("stage"));
  const store = createStore({ ...INITIAL_STATE, busy: T.opening.starting });
  const { Toasts, tell, offer } = createToasts();
  let session: Session | undefined;
  const app = createApp({
    store,
    tell,
    viewport: () => stage.viewport.getBoundingClientRect(),
    session: () => {
      if (!session) throw new Error("The page is still starting.");
      return session;
    },
  });
  const crashes = watchCrashes(store, restart, (crash) => {
    askAfterCrash(crash, () => {
      forgetCrash();
      void app.works.excludeOwn().finally(restart);
    });
  });
  const offline = keepOffline((adopt) => {
    offer(T.offline.ready, {
      label: T.offline.reload,
      run: () => void app.works.flush().then(adopt).then(app.reload),
    });
  });
  const lost = createLost(stage.freshCanvas, () => {
    app.view.resized();
    void app.bind.prepareCompare(store.get().scene.compare);
  });
  attachPress();
  attachDrafts(window);
  mount({ app, Toasts, Lost: lost.Lost, byId });
  try {
    session = await openSession(stage, { fresh: isFresh(), changed: app.take });
  } catch (error) {
    store.set({ busy: null });
    const lack = lackOf(error);
    if (lack) mountUnsupported(lack);
    else tell.problem(explain(error, T.failed.start), app.ctx.fixFor("reload"));
    return;
  }
  attachPointer(stage, app);
  attachBrush(stage.viewport, app);
  attachKeyboard(stage.viewport, app);
  attachDrop(byId("panel"), app);
  lost.watch(session);
  startUp({ app, stage, crashes, offline });
}

void main();
