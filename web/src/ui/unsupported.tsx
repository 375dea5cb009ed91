/** For browsers without WebGPU: the reason, the steps that switch it on, and a notice. */

import { useState } from "preact/hooks";
import type { App } from "../app";
import type { WebGpuFault } from "../contract";
import { hasSeen, markSeen } from "../store";
import { T } from "../words";
import { Button, Fold, IconButton } from "./controls";
import { Dialog } from "./dialog";
import { Icon, Mark } from "./icons";

export type Browser = "chrome" | "edge" | "firefox" | "safari" | "other";
export type System = "windows" | "mac" | "linux" | "android" | "ios" | "other";

/** Browser and system that a user agent names. They determine only which steps are shown first. */
export function recognise(agent: string): { browser: Browser; system: System } {
  const systems: [System, RegExp][] = [
    ["android", /android/i],
    ["ios", /iphone|ipad/i],
    ["windows", /windows/i],
    ["mac", /mac os/i],
    ["linux", /linux|x11|cros/i],
  ];
  const browsers: [Browser, RegExp][] = [
    ["edge", /edg\//i],
    ["firefox", /firefox|fxios/i],
    ["chrome", /chrome|chromium|crios/i],
    ["safari", /safari/i],
  ];
  return {
    browser: browsers.find(([, name]) => name.test(agent))?.[0] ?? "other",
    system: systems.find(([, name]) => name.test(agent))?.[0] ?? "other",
  };
}

type Way = keyof typeof T.without.ways;

/** Key of the steps for a browser; undefined for an unknown browser. */
function wayOf({ browser, system }: ReturnType<typeof recognise>): Way | undefined {
  if (browser === "other") return undefined;
  if (system === "linux" && browser === "chrome") return "chromeLinux";
  if (system === "linux" && browser === "firefox") return "firefoxLinux";
  return browser;
}

/** Why WebGPU is missing, as a sentence. */
export function sayLack(lack: WebGpuFault, secure: boolean): string {
  return lack === "NoWebGPU" && !secure ? T.without.insecure : T.without.reasons[lack];
}

function Steps({ way }: { way: Way }) {
  return (
    <ol class="numbered">
      {T.without.ways[way].steps.map((step) => (
        <li key={step}>{step}</li>
      ))}
    </ol>
  );
}

/** The steps for this browser, then those for other browsers, collapsed. */
function Ways() {
  const mine = wayOf(recognise(navigator.userAgent));
  const all = Object.keys(T.without.ways) as Way[];
  return (
    <>
      {mine && (
        <section class="card stack">
          <h2 class="way-title">{T.without.ways[mine].title}</h2>
          <Steps way={mine} />
        </section>
      )}
      <h2 class="way-title others">{mine ? T.without.others : T.without.thatWork}</h2>
      {all
        .filter((way) => way !== mine)
        .map((way) => (
          <Fold key={way} title={T.without.ways[way].title}>
            <Steps way={way} />
          </Fold>
        ))}
    </>
  );
}

/** Dialog that says how to switch WebGPU on. Offered while the page draws with WebGL2. */
export function WaysDialog({ app }: { app: App }) {
  const { lack, waysOpen } = app.store.get();
  return (
    <Dialog
      title={T.without.title}
      isOpen={waysOpen}
      onClose={() => app.store.set({ waysOpen: false })}
      kind="ways"
    >
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: scrollable regions must be reachable by keyboard */}
      <section class="sheet-body" tabIndex={0} aria-label={T.without.steps}>
        <p>{`${sayLack(lack ?? "NoWebGPU", isSecureContext)} ${T.without.different}`}</p>
        <Ways />
      </section>
    </Dialog>
  );
}

const NOTICE = "without-webgpu";

/** Notice that the page draws with WebGL2. Once it was closed, it is not shown again in this browser. */
export function Notice({ app }: { app: App }) {
  const [isClosed, setClosed] = useState(() => hasSeen(NOTICE));
  const { lack } = app.store.get();
  if (!lack || isClosed) return null;
  const close = () => {
    setClosed(true);
    markSeen(NOTICE);
  };
  return (
    <div class="notice" role="status">
      <Icon name="info" />
      <p>
        {T.without.notice(T.without.short[lack])}
        <button type="button" class="as-link" onClick={() => app.store.set({ waysOpen: true })}>
          {T.without.how}
        </button>
      </p>
      <IconButton icon="close" label={T.without.closeNotice} onClick={close} kind="small" />
    </div>
  );
}

/** Shown instead of the page if WebGL2 is missing, too. */
export function Unsupported({ lack }: { lack: WebGpuFault }) {
  return (
    <main class="unsupported">
      <div class="unsupported-card">
        <div class="row">
          <Mark />
          <strong>{T.product}</strong>
        </div>
        <h1>{T.without.needs}</h1>
        <p>{T.without.noWebGl(sayLack(lack, isSecureContext))}</p>
        <Ways />
        <p class="hint">
          <Icon name="info" />
          {T.without.command}
        </p>
        <Button label={T.tryAgain} onClick={() => location.reload()} kind="primary" icon="reset" />
      </div>
    </main>
  );
}
