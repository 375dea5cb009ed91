/** Recovers from a lost graphics device, and shows the overlay during recovery. */

import { signal } from "@preact/signals";
import type { Session } from "../contract";
import { type Message, messageOf, sentence } from "../strings";
import { T } from "../words";
import { Button, Say } from "./controls";
import { Icon } from "./icons";

/** If a device is lost again within this time, ms, the page asks before it recovers: the device may be broken. */
const REPEATED_LOSS_MS = 10_000;

interface Loss {
  readonly title: string;
  readonly reason?: Message;
  readonly text: string;
  readonly retry: boolean;
}

/** Returns the overlay, and `watch`, which starts recovery when the session reports a loss. */
export function createLost(freshCanvas: () => HTMLCanvasElement, recovered: () => void) {
  const message = signal<Loss | null>(null);
  let recover = async () => {};

  const watch = (session: Session) => {
    let last = Number.NEGATIVE_INFINITY;
    recover = async () => {
      message.value = { title: T.lost.title, text: T.lost.back, retry: false };
      try {
        await session.recover(freshCanvas());
        message.value = null;
        recovered();
      } catch (error) {
        message.value = { title: T.lost.notBack, reason: messageOf(error), text: T.lost.kept, retry: true };
      }
    };
    session.onLost((reason) => {
      const now = performance.now();
      const isAgain = now - last < REPEATED_LOSS_MS;
      last = now;
      if (isAgain)
        message.value = { title: T.lost.again, reason: sentence(reason), text: T.lost.others, retry: true };
      else void recover();
    });
  };

  const Lost = () => {
    if (!message.value) return null;
    const { title, reason, text, retry } = message.value;
    return (
      <div class="lost" role="alert">
        <div class="lost-card">
          <Icon name="warning" />
          <strong>{title}</strong>
          {reason && <Say text={reason} />}
          <p>{text}</p>
          {retry && (
            <div class="row">
              <Button label={T.tryAgain} onClick={() => void recover()} kind="primary" />
              <Button label={T.reload} onClick={() => location.reload()} kind="" />
            </div>
          )}
        </div>
      </div>
    );
  };
  return { Lost, watch };
}
