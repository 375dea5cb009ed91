/** Options of the cage's smoothing and of its inner controls. */

import { useState } from "preact/hooks";
import type { App } from "../app";
import type { CageState, InnerKind } from "../contract";
import { SLIDERS } from "../defaults";
import { percent } from "../format";
import { T } from "../words";
import { Button, Fold, Segments, Slider, Toggle } from "./controls";
import type { IconName } from "./icons";

/** Default number of subdivision steps. More steps change the surface little. */
const DEFAULT_STEPS = 2;
const STEPS = [1, 2, 3];
const KINDS: readonly (readonly [InnerKind, IconName])[] = [
  ["point", "vertex"],
  ["line", "bone"],
  ["face", "face"],
];

export function Smooth({ app, cage }: { app: App; cage: CageState }) {
  const { smooth } = cage.controls;
  return (
    <div class="stack">
      <Toggle
        label={T.cage.smoothOn}
        sentence={T.cage.smoothSentence}
        value={smooth > 0}
        onChange={(on) => app.cage.setSmooth(on ? DEFAULT_STEPS : 0)}
      />
      {smooth > 0 && (
        <Segments
          label={T.cage.steps}
          values={STEPS}
          labels={String}
          value={smooth}
          onChange={app.cage.setSmooth}
        />
      )}
    </div>
  );
}

export function Inside({ app, cage }: { app: App; cage: CageState }) {
  const { placing, selected } = app.store.get();
  const { inner, elements } = cage.controls;
  const many = (kind: InnerKind) => elements.filter((element) => kind in element).length;
  const isSelected = (selected.last ?? 0) >= cage.info.vertices;
  return (
    <Fold title={T.cage.inside} open={inner > 0 || placing !== null}>
      <div class="stack">
        <p class="hint">{T.cage.insideSentence}</p>
        <div class="tool-grid">
          {KINDS.map(([kind, icon]) => (
            <Button
              key={kind}
              label={T.cage.kinds[kind]}
              icon={icon}
              tip={T.cage.kindTips[kind]}
              pressed={placing === kind}
              disabled={!cage.usable}
              onClick={() => app.controls.arm(placing === kind ? null : kind)}
            />
          ))}
          <Button label={T.cage.openControls} icon="file" onClick={app.chooseControls} />
        </div>
        {placing && <p class="hint">{T.cage.kindTips[placing]}</p>}
        {inner > 0 && (
          <>
            <p>{T.cage.count(many("point"), many("line"), many("face"))}</p>
            {many("point") + many("line") > 0 && <Radius app={app} cage={cage} />}
            <div class="tool-grid">
              <Button
                label={T.cage.removeSelected}
                icon="trash"
                disabled={!isSelected}
                onClick={app.controls.remove}
              />
              <Button label={T.cage.clear} icon="close" onClick={app.controls.clear} />
            </div>
            <p class="hint">{T.cage.moveThem(app.key("restMode"))}</p>
          </>
        )}
      </div>
    </Fold>
  );
}

function Radius({ app, cage }: { app: App; cage: CageState }) {
  /** Value while the slider is dragged. On release it becomes the radius, and the model is bound again. */
  const [held, setHeld] = useState<number | null>(null);
  const { min, max } = cage.info.bounds;
  const longest = Math.max(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
  return (
    <Slider
      label={T.cage.radius}
      {...SLIDERS.radius}
      format={(share) => T.pose.ofCage(percent(share, 1))}
      value={held ?? cage.radius / longest}
      onChange={setHeld}
      onCommit={(share) => {
        app.controls.setRadius(share * longest);
        setHeld(null);
      }}
    />
  );
}
