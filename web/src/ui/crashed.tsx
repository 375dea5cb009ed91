/** What the page shows of a crash: its report, and the choice when it would come again. */

import { render } from "preact";
import type { Crash } from "../crash";
import { T } from "../words";
import { Button } from "./controls";
import { Dialog } from "./dialog";

/** The report's text, to be read and copied. */
export function showReport(crash: Crash): void {
  const place = document.createElement("div");
  document.body.append(place);
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

/** It stopped a second time: nothing is opened until the user has chosen. Behind it there is no page that could be used. */
export function askAfterCrash(crash: Crash, startFresh: () => void): void {
  const place = document.createElement("div");
  document.body.append(place);
  render(
    <Dialog title={T.crash.again} isOpen kind="ways">
      <div class="sheet-body">
        <p>{T.crash.second(crash.during)}</p>
        <p>{T.crash.fresh}</p>
        <Report crash={crash} />
        <div class="row wrap">
          <Button label={T.works.fresh} onClick={startFresh} kind="primary" />
          <Button label={T.tryAgain} onClick={() => location.reload()} />
        </div>
      </div>
    </Dialog>,
    place,
  );
}

function Report({ crash: { report } }: { crash: Crash }) {
  return (
    // biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be reached by keys
    <section class="report" tabIndex={0} aria-label={T.crash.report}>
      <pre>{report}</pre>
    </section>
  );
}
