/** The section Walk of step Pose: a clip of another file that the cage follows. */

import type { App } from "../app";
import { duration } from "../format";
import { T } from "../words";
import { Button, Section, Select } from "./controls";

export function Walk({ app }: { app: App }) {
  const { model, cage, walk, bound, playing } = app.store.get();
  if (!model || !cage || model.rigged || model.clips.length > 0) return null;
  return (
    <Section title={T.walk.title}>
      <div class="stack">
        <p class="hint">{T.walk.sentence}</p>
        <Button label={T.walk.open} disabled={!bound} onClick={app.chooseRig} />
        {walk && (
          <>
            <Select
              label={T.walk.clip}
              none={T.walk.rest}
              options={walk.clips.map(([name, seconds], k) => [
                k,
                T.clips.named(name, duration(1000 * seconds)),
              ])}
              value={walk.clip}
              onChange={app.walk.choose}
            />
            <Button label={playing ? T.walk.stop : T.walk.play} onClick={app.walk.toggle} />
            <p class="hint">{T.walk.exported(walk.name)}</p>
          </>
        )}
      </div>
    </Section>
  );
}
