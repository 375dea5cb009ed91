/** Dialogs after a crash: the report, and the choice after a second crash. */

import { render } from "preact";
import type { Crash } from "../crash";
import { T } from "../words";
import { Button } from "./controls";
import { Dialog } from "./dialog";

/** Shows the text of a crash report, so that the user can read and copy it. */
export function showReport(crash: Crash): void {
  const place = document.body.appendChild(document.createElement("div"));
  const close = () => {
    render(null, place);
    place.remove();
  };
  render(
    <Dialog title={T.crash.report} isOpen onClose={close} kind="ways">
      <div class="sheet-body">
        <Report crash={crash} />
      </div>
    </Dialog>,
    place,
  );
}

/** Asks what to do after a second crash. The dialog cannot be closed, because the page behind it is not usable. */
export function askAfterCrash(crash: Crash, startFresh: () => void): void {
  const place = document.body.appendChild(document.createElement("div"));
  render(
    <Dialog title={T.crash.again} isOpen kind="ways">
      <div class="sheet-body">
        <p>{T.crash.second(crash.during)}</p>
        <p>{T.crash.fresh}</p>
        <Report crash={crash} />
        <div class="row wrap">
          <Button label={T.works.fresh} onClick={startFresh} kind="primary" />
          <Button label={T.tryAgain} onClick={() => location.reload()} kind="" />
        </div>
      </div>
    </Dialog>,
    place,
  );
}

function Report({ crash: { report } }: { crash: Crash }) {
  return (
    // biome-ignore lint/a11y/noNoninteractiveTabindex: scrollable regions must be reachable by keyboard
    <section class="report" tabIndex={0} aria-label={T.crash.report}>
      <pre lang="en">{report}</pre>
    </section>
  );
}
