/** The shortcut sheet, generated from the same table as the keyboard handler. */

import type { App } from "../app";
import { caps, GROUPS, SHORTCUTS, type Shortcut } from "../input/shortcuts";
import { T } from "../words";
import { Button } from "./controls";
import { Dialog } from "./dialog";

export function Sheet({ app, isOpen, onClose }: { app: App; isOpen: boolean; onClose: () => void }) {
  const { mac } = app;
  const byItsKey = (event: KeyboardEvent) => {
    if (event.key !== "?") return;
    event.preventDefault();
    onClose();
  };
  return (
    <Dialog title={T.sheet.title} isOpen={isOpen} onClose={onClose} onKeyDown={byItsKey}>
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: scrollable regions must be reachable by keyboard */}
      <section class="sheet-body" tabIndex={0} aria-label={T.sheet.all}>
        <section class="keys">
          <Button
            label={T.tour.begin}
            icon="tour"
            kind="small"
            onClick={() => {
              onClose();
              app.run("tour");
            }}
          />
        </section>
        {GROUPS.map((group) => (
          <section class="keys" key={group}>
            <h3>{T.sheet.groups[group]}</h3>
            <dl>
              {SHORTCUTS.filter((s) => s.group === group && T.sheet.commands[s.command]).map((shortcut) => (
                <Row key={shortcut.command} shortcut={shortcut} mac={mac} />
              ))}
            </dl>
          </section>
        ))}
        <section class="keys">
          <h3>{T.sheet.pointer}</h3>
          <dl>
            {T.sheet.pointers.flatMap(([what, does]) => [
              <dt key={what}>
                <span>{what}</span>
              </dt>,
              <dd key={does}>{does}</dd>,
            ])}
          </dl>
        </section>
      </section>
    </Dialog>
  );
}

function Row({ shortcut, mac }: { shortcut: Shortcut; mac: boolean }) {
  return (
    <>
      <dt>
        {(shortcut.shown ?? shortcut.keys).map((combination, i) => (
          <>
            {i > 0 && !shortcut.shown && <span class="or">{T.sheet.or}</span>}
            <span class="caps">
              {caps(combination, mac).map((cap) => (
                <kbd key={cap}>{cap}</kbd>
              ))}
            </span>
          </>
        ))}
      </dt>
      <dd>{T.sheet.commands[shortcut.command]}</dd>
    </>
  );
}
