/** The shortcut sheet, generated from the same table as the keyboard handler. */

import type { App } from "../app";
import { caps, GROUPS, SHORTCUTS, type Shortcut } from "../input/shortcuts";
import { SHEET, T } from "../words";
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
    <Dialog title={SHEET.title} isOpen={isOpen} onClose={onClose} onKeyDown={byItsKey}>
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: scrollable regions must be reachable by keyboard */}
      <section class="sheet-body" tabIndex={0} aria-label={SHEET.all}>
        <section class="keys">
          <Button
            label={T.tour.begin}
            icon="tour"
            onClick={() => {
              onClose();
              app.run("tour");
            }}
          />
        </section>
        {GROUPS.map((group) => (
          <section class="keys" key={group}>
            <h3>{SHEET.groups[group]}</h3>
            <dl>
              {SHORTCUTS.filter((s) => s.group === group && SHEET.commands[s.command]).map((shortcut) => (
                <Row key={shortcut.command} shortcut={shortcut} mac={mac} />
              ))}
            </dl>
          </section>
        ))}
        <section class="keys">
          <h3>{SHEET.pointer}</h3>
          <dl>
            {SHEET.pointers.flatMap(([what, does]) => [
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
            {i > 0 && !shortcut.shown && <span class="or">{SHEET.or}</span>}
            <span class="caps">
              {caps(combination, mac).map((cap) => (
                <kbd key={cap}>{cap}</kbd>
              ))}
            </span>
          </>
        ))}
      </dt>
      <dd>{SHEET.commands[shortcut.command]}</dd>
    </>
  );
}
